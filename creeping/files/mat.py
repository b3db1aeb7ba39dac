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


Content = tuple[dict[str, Any], dict[str, str]]
"""Values and units by name."""


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
        content, units = makers[kinds[0]](result)
    elif isinstance(result, Sequence) and all(isinstance(one, IsoPhaseCurve) for one in result):
        content, units = _curves(result)
    else:
        raise InvalidInputError(
            f"{type(result).__name__} is not written to .mat; give one of {', '.join(makers)}, or a list of "
            "IsoPhaseCurve"
        )
    units = {name: unit for name, unit in units.items() if name in content}
    if observed is not None:
        content |= {"observe": np.array(observed[0], dtype=object), "angle": observed[1]}
        units |= {"angle": "degree"}
    about = "time factor exp(-i w t); far field f exp(i k r)/r; 4 pi |f|^2 is the cross section"
    content |= {"units": units, "about": about, "creeping_version": __version__}
    # a full disk is an error of Python's own writing
    whole = io.BytesIO()
    savemat(whole, content, do_compression=True, oned_as="column", long_field_names=True)
    with written_aside(path) as aside:
        aside.write_bytes(whole.getvalue())


def _line(line: ShadowLine) -> Content:
    length = unit_of(line.body)
    content = {
        **_wave(line),
        "curve": number_of(line.curves),
        **{n: joined([getattr(c, n) for c in line.curves]) for n in ("arclength", "curvature")},
        **{n: joined([getattr(c, n) for c in line.curves], 3) for n in ("points", "normals", "tangents")},
        "status": np.array([str(s) for c in line.curves for s in c.status], dtype=object),
        "length": line.length,
    }
    units = {"arclength": length, "points": length, "length": length, "curvature": power(length, -1)}
    units |= dict.fromkeys(("direction", "normals", "tangents"), "1")
    return content, units | {"source": length}


def _wave(line: ShadowLine) -> dict[str, Any]:
    """Direction of a plane wave, or where a point source is."""
    if isinstance(line.source, PointSource):
        return {"source": np.array(line.source.position)}
    return {"direction": line.direction}


def _fan(fan: RayFan) -> Content:
    length = unit_of(fan.body)
    names = (
        *("points", "directions", "travel_time", "eikonal", "spreading", "spreading_rate", "curvature", "attenuation"),
        *("caustic_index", "status", "detachment", "curve_index", "arclength"),
    )
    content = {name: np.asarray(getattr(fan, name)) for name in names} | _wave(fan.line)
    time = length if speed_of(fan.body) is None else "time"
    units = dict.fromkeys(("points", "arclength"), length)
    units |= dict.fromkeys(("travel_time", "eikonal", "detachment"), time)
    units |= dict.fromkeys(("spreading_rate", "curvature"), power(length, -1)) | {"attenuation": f"{length}^(1/3)"}
    units |= dict.fromkeys(("direction", "directions", "spreading"), "1")
    return content, units | {"source": length}


def _curves(curves: Sequence[IsoPhaseCurve]) -> Content:
    content = {
        "curve": number_of(curves),
        "points": joined([c.points for c in curves], 3),
        "rays": joined([c.rays for c in curves]).astype(float),
        "of": np.array([c.of for c in curves], dtype=object),
        "level": np.array([c.level for c in curves]),
        "closed": np.array([c.closed for c in curves], dtype=bool),
    }
    # curves do not know their body
    return content, {"points": UNKNOWN, "level": UNKNOWN}


def _cut(cut: FieldCut) -> Content:
    field: Any = cut.field
    length = field.length_unit
    content: dict[str, Any] = {
        "across": cut.across,
        "up": cut.up,
        "point": cut.point,
        "axes": cut.axes,
        "points": cut.points,
        "outside": cut.outside,
        **{name: cut.on_grid(field.values if name == "u" else getattr(field, name)) for name in cut.quantities},
        "error": cut.error,
        "status": cut.status,
        "method": cut.on_grid(field.method.astype(object), "inside"),
        "wavenumber": field.wavenumber,
        "boundary": field.boundary,
        "order": field.order,
    }
    units = dict.fromkeys(("across", "up", "point", "points"), length) | {"axes": "1"}
    return content, units | dict.fromkeys((*cut.quantities, "error"), field.unit) | {"wavenumber": power(length, -1)}


def _far(far: FarField) -> Content:
    angles, length = np.degrees(angles_of(far.directions)), far.unit
    content: dict[str, Any] = {
        "directions": far.directions,
        "theta": angles[:, 0],
        "phi": angles[:, 1],
        "f": far.total,
        **far.parts,
        "error": far.error,
        "cross_section": far.cross_section,
        "cross_section_dB": far.dbsm,
        "unresolved": far.unresolved,
        "method": far.method.astype(object),
        "wavenumber": far.wavenumber,
        "boundary": far.boundary,
        "order": far.order,
    }
    units = {"directions": "1", "theta": "degree", "phi": "degree", "wavenumber": power(length, -1)}
    units |= dict.fromkeys(("f", *far.parts, "error"), length)
    area = "dBsm" if length == "m" else f"dB re 1 {length}^2"
    return content, units | {"cross_section": power(length, 2), "cross_section_dB": area}


def _echo(echo: Echo) -> Content:
    low, high = echo.bounds()
    content: dict[str, Any] = {
        "quantity": echo.level_name[0],
        "channels": np.array(echo.channels, dtype=object),
        "azimuth": echo.azimuth,
        "elevation": echo.elevation,
        "frequency": echo.hertz,
        "wavenumber": echo.wavenumbers,
        "f": echo.total,
        **echo.parts,
        "error": echo.error,
        "level": echo.levels(),
        "level_low": low,
        "level_high": high,
        "unresolved": echo.unresolved,
        "by_currents": echo.by_currents,
        "otherwise_by": echo.otherwise,
    }
    if echo.incidence is not None:
        content["incidence"] = np.array(echo.incidence)
    if echo.sound_speed is not None:
        content["sound_speed"] = echo.sound_speed
    units = {"azimuth": "degree", "elevation": "degree", "incidence": "degree", "frequency": "Hz"}
    units |= {"wavenumber": "1/m", "sound_speed": "m/s"} | dict.fromkeys(("f", *echo.parts, "error"), "m")
    units |= dict.fromkeys(("level", "level_low", "level_high"), echo.level_name[1])
    return content, units
