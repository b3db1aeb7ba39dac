"""Results as MATLAB files (.mat, version 5): arrays by name, their units in the struct ``units``."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, FloatArray
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.field.results.labelled import power
from creeping.files.tables import angles_of, joined, number_of
from creeping.geometry.checks import UNKNOWN, unit_of
from creeping.geometry.evaluators import speed_of
from creeping.geometry.incident import PointSource
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.line import ShadowLine
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    from creeping.field.cut_result import FieldCut
    from creeping.field.results.comparison import Echo
    from creeping.field.results.far_result import FarField


Content = dict[str, tuple[Any, str]]
"""Values and their units by name; of what has none the unit is empty."""


def write_mat(
    path: str | os.PathLike[str],
    result: Echo | FarField | FieldCut | ShadowLine | RayFan | Sequence[IsoPhaseCurve],
    *,
    observed: tuple[Sequence[str], FloatArray] | None = None,
) -> None:
    """Write a result for MATLAB, Octave or ``scipy.io.loadmat``.

    Parameters
    ----------
    path : str or path
        File to write; replaced at once when complete.
    result : Echo, FarField, FieldCut, ShadowLine, RayFan or sequence of IsoPhaseCurve
        Arrays keep their axes: channels, angles, frequencies of an echo; directions, scattered and incident θ̂ and φ̂
        of a far field; ``up`` and ``across`` of a field on a plane, NaN and status -1 inside the body; rays and steps
        of a fan. A line and iso-phase curves are one point a row, with the number of its curve.
    observed : (texts, angles), optional
        Of a far field: what each direction was asked for as, and its angle along the cut (m,), degrees.

    Raises
    ------
    InvalidInputError
        If the result is none of these.
    CreepingError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile, creeping as cr, scatterers as sc, scipy.io
    >>> from creeping.files import write_mat
    >>> fan = cr.launch(cr.DirectFlow(sc.Sphere(), rtol=1e-6), cr.shadow_line(sc.Sphere(), (0, 0, 1)), n_rays=16)
    >>> far = cr.far_field(fan, [(0, 1, 0), (1, 0, 0)], wavenumber=30.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_mat(f"{folder}/far.mat", far)
    ...     back = scipy.io.loadmat(f"{folder}/far.mat", squeeze_me=True)
    >>> bool((back["f"] == far.total).all()), str(back["units"]["f"])
    (True, 'L')
    """
    from scipy.io import savemat

    # by name: a field's classes need not be imported for a line to be written
    makers: dict[str, Callable[[Any], Content]] = {
        "Echo": _echo,
        "FarField": _far,
        "FieldCut": _cut,
        "ShadowLine": _line,
        "RayFan": _fan,
    }
    kinds = [kind.__name__ for kind in type(result).__mro__ if kind.__name__ in makers]
    if kinds:
        found = makers[kinds[0]](result)
    elif isinstance(result, Sequence) and all(isinstance(one, IsoPhaseCurve) for one in result):
        found = _curves(result)
    else:
        raise InvalidInputError(
            f"{type(result).__name__} is not written to .mat; give one of {', '.join(makers)}, or a list of "
            "IsoPhaseCurve"
        )
    if observed is not None:
        found |= {"observe": (np.array(observed[0], dtype=object), ""), "angle": (observed[1], "degree")}
    content = {name: value for name, (value, _) in found.items()}
    units = {name: unit for name, (_, unit) in found.items() if unit}
    about = "time factor exp(-i w t); far field f exp(i k r)/r; 4 pi |f|^2 is the cross section"
    content |= {"units": units, "about": about, "creeping_version": __version__}
    # a full disk is an error of Python's own writing
    whole = io.BytesIO()
    savemat(whole, content, do_compression=True, oned_as="column", long_field_names=True)
    with written_aside(path) as aside:
        aside.write_bytes(whole.getvalue())


def _attributes(result: Any, **units: str) -> Content:
    """Attributes of a result with their units."""
    return {name: (getattr(result, name), unit) for name, unit in units.items()}


def _words(texts: Any) -> tuple[Any, str]:
    """Texts, as MATLAB has them in a cell array."""
    return np.array(texts, dtype=object), ""


def _line(line: ShadowLine) -> Content:
    unit, curves = unit_of(line.body), line.curves
    numbers, vectors = (
        {"arclength": unit, "curvature": power(unit, -1)},
        {"points": unit, "normals": "1", "tangents": "1"},
    )
    return {
        **_wave(line),
        "curve": (number_of(curves), ""),
        **{name: (joined([getattr(c, name) for c in curves]), of) for name, of in numbers.items()},
        **{name: (joined([getattr(c, name) for c in curves], 3), of) for name, of in vectors.items()},
        "status": _words([str(s) for c in curves for s in c.status]),
        "length": (line.length, unit),
    }


def _wave(line: ShadowLine) -> Content:
    """Direction of a plane wave, or where a point source is."""
    if isinstance(line.source, PointSource):
        return {"source": (np.array(line.source.position), unit_of(line.body))}
    return {"direction": (line.direction, "1")}


def _fan(fan: RayFan) -> Content:
    length = unit_of(fan.body)
    time, curved = length if speed_of(fan.body) is None else "time", power(length, -1)
    of_points = _attributes(fan, points=length, directions="1", travel_time=time, eikonal=time, spreading="1")
    of_points |= _attributes(fan, spreading_rate=curved, curvature=curved, attenuation=f"{length}^(1/3)")
    of_rays = _attributes(fan, caustic_index="", status="", detachment=time, curve_index="", arclength=length)
    return {name: (np.asarray(value), unit) for name, (value, unit) in (of_points | of_rays).items()} | _wave(fan.line)


def _curves(curves: Sequence[IsoPhaseCurve]) -> Content:
    # curves do not know their body
    return {
        "curve": (number_of(curves), ""),
        "points": (joined([c.points for c in curves], 3), UNKNOWN),
        "rays": (joined([c.rays for c in curves]).astype(float), ""),
        "of": _words([c.of for c in curves]),
        "level": (np.array([c.level for c in curves]), UNKNOWN),
        "closed": (np.array([c.closed for c in curves], dtype=bool), ""),
    }


def _cut(cut: FieldCut) -> Content:
    field: Any = cut.field
    length = field.length_unit
    values = {name: field.values if name == "u" else getattr(field, name) for name in cut.quantities}
    return {
        **_attributes(cut, across=length, up=length, point=length, axes="1", points=length, outside=""),
        **{name: (cut.on_grid(one), field.unit) for name, one in values.items()},
        **_attributes(cut, error=field.unit, status=""),
        "method": (cut.on_grid(field.method.astype(object), "inside"), ""),
        **_attributes(field, wavenumber=power(length, -1), boundary="", order=""),
    }


def _far(far: FarField) -> Content:
    angles, length = np.degrees(angles_of(far.directions)), far.unit
    return {
        "directions": (far.directions, "1"),
        "theta": (angles[:, 0], "degree"),
        "phi": (angles[:, 1], "degree"),
        **{name: (values, length) for name, values in {"f": far.total, **far.parts, "error": far.error}.items()},
        "cross_section": (far.cross_section, power(length, 2)),
        "cross_section_dB": (far.dbsm, "dBsm" if length == "m" else f"dB re 1 {length}^2"),
        "unresolved": (far.unresolved, ""),
        "method": (far.method.astype(object), ""),
        **_attributes(far, wavenumber=power(length, -1), boundary="", order=""),
    }


def _echo(echo: Echo) -> Content:
    (low, high), (name, unit) = echo.bounds(), echo.level_name
    found: Content = {
        "quantity": (name, ""),
        "channels": _words(echo.channels),
        **_attributes(echo, azimuth="degree", elevation="degree"),
        "frequency": (echo.hertz, "Hz"),
        "wavenumber": (echo.wavenumbers, "1/m"),
        **{part: (values, "m") for part, values in {"f": echo.total, **echo.parts, "error": echo.error}.items()},
        "level": (echo.levels(), unit),
        "level_low": (low, unit),
        "level_high": (high, unit),
        **_attributes(echo, unresolved="", by_currents=""),
        "otherwise_by": (echo.otherwise, ""),
    }
    if echo.incidence is not None:
        found["incidence"] = (np.array(echo.incidence), "degree")
    if echo.sound_speed is not None:
        found["sound_speed"] = (echo.sound_speed, "m/s")
    return found
