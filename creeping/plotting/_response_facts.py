"""What the tables of couplings, patterns of sources, responses and echoes say."""

from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import brief
from creeping._typing import Any, BoolArray, FloatArray
from creeping.plotting._facts import Facts, wave_words

if TYPE_CHECKING:
    from creeping.field.coupling_result import Coupling
    from creeping.field.echo import Echo
    from creeping.field.impulse import ImpulseResponse
    from creeping.field.slant_range import RangeProfile
    from creeping.field.sources import SourcePattern


def of_coupling(found: "Coupling") -> Facts:
    """Facts of a coupling matrix."""
    yield "body", brief(found.body, 200)
    yield "ports", str(len(found.ports))
    yield from _wave(found)
    yield "order", str(found.order)
    yield "geodesics up to", f"{found.length:.6g} {found.length_unit}"
    yield from _states(found)
    yield from _sizes(np.abs(found.values), found.error, found.ok & np.isfinite(found.values))


def of_pattern(found: "SourcePattern") -> Facts:
    """Facts of far fields of sources."""
    yield "sources", str(len(found.sources))
    yield "directions", str(len(found.directions))
    yield from _wave(found)
    yield from _states(found)
    yield from _sizes(np.abs(found.values), found.error, found.ok)


def of_impulse(found: "ImpulseResponse") -> Facts:
    """Facts of a response to a pulse."""
    yield "responses", " x ".join(map(str, found.values.shape[1:])) or "1"
    yield "delays", f"{len(found.delay)}, {found.delay[0]:.6g} to {found.delay[-1]:.6g} {found.unit}"
    yield "resolution", f"{found.resolution:.4g} {found.unit}"
    yield "repeats after", f"{found.period:.6g} {found.unit}"
    yield "largest", f"{np.max(found.envelope, initial=0.0):.6g}"
    yield "error at most", f"{np.max(found.error, initial=0.0):.2g}"
    if found.values.ndim == 1:
        yield "arrivals", ", ".join(f"{t:.6g}" for t in found.arrivals()) + f" {found.unit}"


def of_profile(found: "RangeProfile") -> Facts:
    """Facts of a range profile."""
    yield "ranges", f"{len(found.range)}, {found.range[0]:.6g} to {found.range[-1]:.6g}"
    yield "resolution", f"{found.resolution:.4g}"
    size = np.abs(found.values)
    yield "largest", f"{size.max():.6g} at {found.range[int(np.argmax(size))]:.6g}"


def of_echo(found: "Echo") -> Facts:
    """Facts of an echo."""
    told = found.summary()
    yield "quantity", f"{told['quantity']}, {told['unit']}"
    yield "channels", ", ".join(found.channels)
    yield "angles", f"{told['angles']} of {found.angle_name or 'one direction'}"
    yield "frequencies", f"{told['frequencies']}, {found.hertz.min():.6g} to {found.hertz.max():.6g} Hz"
    for channel, level in told["largest"].items():
        yield f"largest {channel}", "none" if level is None else f"{level:.2f} {told['unit']}"
    if told["error_db_median"] is not None:
        yield "error", f"{told['error_db_median']:.2g} dB in the median, {told['error_db_95']:.2g} dB at 95 of 100"
    yield "unresolved", f"{told['unresolved']} of {told['values']} values"
    yield "served by currents", f"{told['by_currents']} of {told['values']}, else by {told['otherwise_by']}"


def _wave(found: Any) -> Facts:
    yield "wavenumber", wave_words(found.wavenumber, found.length_unit)
    yield "boundary", found.boundary


def _states(found: Any) -> Facts:
    for name, count in found.status_counts.items():
        yield name, f"{count} values"


def _sizes(size: FloatArray, error: FloatArray, ok: BoolArray) -> Facts:
    if np.any(ok):
        yield "largest where OK", f"{size[ok].max():.6g}"
        yield "error where OK", f"{np.median(error[ok]):.2g} in the median, {error[ok].max():.2g} at most"
