"""Results as MATLAB files (.mat, version 5): arrays by name, their units in the struct ``units``."""

from __future__ import annotations

import io
import os
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.field.labelled import PARTS, power
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    from creeping.field.echo import Echo
    from creeping.field.far_result import FarField

ABOUT = "time factor exp(-i w t); far field f exp(i k r)/r; 4 pi |f|^2 is the cross section"


def write_mat(path: str | os.PathLike[str], result: Echo | FarField) -> None:
    """Write an echo or a far field for MATLAB, Octave or ``scipy.io.loadmat``.

    Parameters
    ----------
    path : str or path
        File to write; replaced at once when complete.
    result : Echo or FarField
        Arrays keep their axes: channels, angles, frequencies of an echo; directions, scattered and incident θ̂ and φ̂
        of a far field.

    Raises
    ------
    InvalidInputError
        If the result is neither.
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

    from creeping.field.echo import Echo
    from creeping.field.far_result import FarField

    if isinstance(result, Echo):
        content, units = _echo(result)
    elif isinstance(result, FarField):
        content, units = _far(result)
    else:
        raise InvalidInputError(f"{type(result).__name__} is not written to .mat; give an Echo or a FarField")
    content |= {"units": units, "about": ABOUT, "creeping_version": __version__}
    # a full disk is an error of Python's own writing
    whole = io.BytesIO()
    savemat(whole, content, do_compression=True, oned_as="column", long_field_names=True)
    with written_aside(path) as aside:
        aside.write_bytes(whole.getvalue())


def _far(far: FarField) -> tuple[dict[str, Any], dict[str, str]]:
    from creeping.files.far_table import angles_of

    angles, length = np.degrees(angles_of(far.directions)), far.unit
    content: dict[str, Any] = {
        "directions": far.directions,
        "theta": angles[:, 0],
        "phi": angles[:, 1],
        "f": far.total,
        **{name: getattr(far, name) for name in PARTS},
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
    units |= dict.fromkeys(("f", *PARTS, "error"), length)
    area = "dBsm" if length == "m" else f"dB re 1 {length}^2"
    return content, units | {"cross_section": power(length, 2), "cross_section_dB": area}


def _echo(echo: Echo) -> tuple[dict[str, Any], dict[str, str]]:
    from creeping.field.echo import LEVELS

    low, high = echo.bounds()
    content: dict[str, Any] = {
        "quantity": LEVELS[echo.quantity][0],
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
    units |= dict.fromkeys(("level", "level_low", "level_high"), LEVELS[echo.quantity][1])
    return content, {name: unit for name, unit in units.items() if name in content}
