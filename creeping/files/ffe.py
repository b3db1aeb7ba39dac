"""Far fields as FEKO far-field text (.ffe), read by POSTFEKO and others.

Its time factor is e^{+jωt} and ours e^{-iωt}, so every number is written conjugated: with 1 V/m incident,

    E(θ, φ) = f* in V,   RCS = 4π|f|² in m²,   frequency = k c/(2π),   L the metre

Rows run over θ first, then φ, in degrees.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.field.polarisation import turned_to_azimuth
from creeping.files.far_table import angles_of
from creeping.geometry.directions import unit_direction
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    from creeping.field.far_result import FarField

LIGHT = 299792458.0
"""Speed of light, m/s."""
_QUANTITIES = ("Re(Etheta)", "Im(Etheta)", "Re(Ephi)", "Im(Ephi)", "RCS(Theta)", "RCS(Phi)", "RCS(Total)")
_COLUMNS = "#" + "".join(f"{name:>26}" for name in ('"Theta"', '"Phi"', *(f'"{name}"' for name in _QUANTITIES)))


def grid_directions(theta: ArrayLike, phi: ArrayLike) -> FloatArray:
    """Unit directions of a grid in radians, φ the faster: (t,), (p,) -> (t p, 3)."""
    t, p = (grid.ravel() for grid in np.meshgrid(theta, phi, indexing="ij"))
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)


def write_ffe(
    path: str | os.PathLike[str],
    far: FarField,
    theta: ArrayLike,
    phi: ArrayLike,
    *,
    direction: ArrayLike | None = None,
) -> None:
    """Write a far field on a grid of θ and φ as a FEKO far-field file.

    A scalar field is written as Eθ, with a comment that says so; a conductor's field in two blocks, incident E along
    θ̂ and along φ̂ of the incident wave's direction of travel.

    Parameters
    ----------
    path : str or path
        File to write; replaced at once when complete.
    far : FarField
        In the directions of `grid_directions(theta, phi)`.
    theta, phi : (t,), (p,), radians
        Axes of the grid.
    direction : (3,), optional
        Where the incident wave travels; the file holds where it comes from.

    Raises
    ------
    InvalidInputError
        If the directions are not those of the grid, or the field is not finite.
    CreepingError
        If the file cannot be written.
    """
    t, p = (np.atleast_1d(np.asarray(axis, dtype=float)) for axis in (theta, phi))
    _check_grid(far, t, p)
    total = np.asarray(far.total)
    bad = np.flatnonzero(~np.all(np.isfinite(total.reshape(len(total), -1)), axis=1))
    if len(bad):
        raise InvalidInputError(
            f"the far field is not finite in {len(bad)} of {len(total)} directions (first: row {bad[0]}), which a .ffe "
            "file cannot hold; move the grid a little, or write CSV",
            rows=bad,
        )
    with written_aside(path) as aside, aside.open("w", encoding="ascii", newline="\n") as stream:
        stream.writelines(line + "\n" for line in _lines(far, t, p, direction))


def _check_grid(far: FarField, theta: FloatArray, phi: FloatArray) -> None:
    remedy = "; give far_field the directions of grid_directions(theta, phi)"
    if theta.ndim != 1 or phi.ndim != 1 or not (np.all(np.isfinite(theta)) and np.all(np.isfinite(phi))):
        raise InvalidInputError(f"theta {theta.shape} and phi {phi.shape} are not axes (t,), (p,) of finite radians")
    directions = np.asarray(far.directions)
    if len(directions) != theta.size * phi.size:
        raise InvalidInputError(
            f"a .ffe file holds a grid: the far field has {len(directions)} directions, a grid of {theta.size} theta "
            f"by {phi.size} phi has {theta.size * phi.size}{remedy}"
        )
    off = np.linalg.norm(directions - grid_directions(theta, phi), axis=1)
    wrong = int(np.sum(off > 1e-9))
    if wrong:
        worst = int(np.argmax(off))
        raise InvalidInputError(
            f"a .ffe file holds a grid: {wrong} of {len(directions)} directions are not on it "
            f"(worst: row {worst}, off by {off[worst]:.2g}){remedy}"
        )


def _trust(far: FarField) -> Iterator[str]:
    """Comments on the errors, which the format has no columns for."""
    served = ", ".join(sorted({str(name) for name in far.method}))
    doubtful = f"{int(np.sum(far.unresolved))} of {len(far.method)} directions"
    yield f"** computed by {served or 'nothing'}; unresolved in {doubtful}"
    if far.stated_error is not None:
        rms, worst = far.stated_error
        yield f"** error of |f| by {far.error_source}: {rms:.3e} m rms over the directions, {worst:.3e} m at most"


def _lines(far: FarField, theta: FloatArray, phi: FloatArray, direction: ArrayLike | None) -> Iterator[str]:
    vector = np.ndim(far.total) == 3
    yield "##File Type: Far field"
    yield "##File Format: 8"
    yield f"##Source: creeping {__version__}"
    yield f"** {far.boundary} boundary, order {far.order}, k = {far.wavenumber!r} 1/{far.unit}"
    taken = "" if far.unit == "m" else "L is taken as the metre and "
    yield f"** frequency: {taken}the wave's speed as that of light"
    yield "** time factor exp(+jwt): complex conjugates of the far field f of creeping, exp(-iwt)"
    yield from _trust(far)
    if not vector:
        yield "** SCALAR field: f stands in the columns of Etheta, those of Ephi are 0"
    for number, name in enumerate(("theta", "phi") if vector else ("scalar",)):
        yield ""
        if vector:
            yield f"** incident E along the {name} unit vector of the incident wave's direction of travel, 1 V/m"
        yield f"#Configuration Name: incident_{name}"
        yield "#Request Name: FarField"
        yield f"#Frequency: {far.wavenumber * LIGHT / (2 * np.pi):.14E}"
        yield "#Coordinate System: Spherical"
        yield f"#No. of Theta Samples: {len(theta)}"
        yield f"#No. of Phi Samples: {len(phi)}"
        yield "#Result Type: RCS"
        if direction is not None:
            source = np.degrees(angles_of(-unit_direction(direction)))
            yield f"#Incident Wave Direction: ({source[0]:.10g}, {source[1]:.10g})"
        yield "#No. of Header Lines: 1"
        yield _COLUMNS
        fields = _components(far, theta, phi, number)
        # theta runs first
        for j, i in np.ndindex(len(phi), len(theta)):
            e = np.conj(fields[i, j]) + 0.0
            sections = 4 * np.pi * np.abs(e) ** 2
            row = (np.degrees(theta[i]), np.degrees(phi[j]), e[0].real, e[0].imag, e[1].real, e[1].imag, *sections)
            yield " " + "".join(f"{value:26.16E}" for value in (*row, float(np.sum(sections))))


def _components(far: FarField, theta: FloatArray, phi: FloatArray, incident: int) -> ComplexArray:
    """θ̂ and φ̂ components for one incident polarisation (t, p, 2); at a pole those of the row's φ, not of φ = 0."""
    total = np.asarray(far.total)
    if total.ndim == 1:
        return np.stack([total, np.zeros_like(total)], axis=-1).reshape(len(theta), len(phi), 2)
    p = np.tile(phi, len(theta))
    turn = turned_to_azimuth(far.directions, p)
    return np.asarray(np.einsum("nab,nb->na", turn, total[:, :, incident])).reshape(len(theta), len(phi), 2)
