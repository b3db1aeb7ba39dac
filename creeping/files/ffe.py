"""Far fields as FEKO far-field text (.ffe), read by POSTFEKO and others.

Its time factor is e^{+jωt} and ours e^{-iωt}, so every number is written conjugated: with 1 V/m incident,

    E(θ, φ) = f* in V,   RCS = 4π|f|² in m²,   frequency = k c/(2π),   L the metre

Rows run over θ first, then φ, in degrees.

Also here: far fields from FEKO text (.ffe), those of `write_ffe` and of others.

The file's time factor is e^{+jωt} and ours e^{-iωt}: numbers are conjugated, and come back as they were written.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import os
import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.field.frequency import frequency, wavenumber
from creeping.field.results.far_result import turned_to_azimuth
from creeping.files.measured import lines_of
from creeping.files.tables import angles_of
from creeping.geometry.directions import directions_from_angles, unit_direction
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    from creeping.field.results.far_result import FarField

COLUMNS = ("Theta", "Phi", "Re(Etheta)", "Im(Etheta)", "Re(Ephi)", "Im(Ephi)")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)


def grid_directions(theta: ArrayLike, phi: ArrayLike) -> FloatArray:
    """Unit directions of a grid in radians, φ the faster: (t,), (p,) -> (t p, 3)."""
    return directions_from_angles(*(grid.ravel() for grid in np.meshgrid(theta, phi, indexing="ij")))


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
    remedy = "; give far_field the directions of grid_directions(theta, phi)"
    if t.ndim != 1 or p.ndim != 1 or not (np.all(np.isfinite(t)) and np.all(np.isfinite(p))):
        raise InvalidInputError(f"theta {t.shape} and phi {p.shape} are not axes (t,), (p,) of finite radians")
    directions = np.asarray(far.directions)
    if len(directions) != t.size * p.size:
        raise InvalidInputError(
            f"a .ffe file holds a grid: the far field has {len(directions)} directions, a grid of {t.size} theta "
            f"by {p.size} phi has {t.size * p.size}{remedy}"
        )
    off = np.linalg.norm(directions - grid_directions(t, p), axis=1)
    if wrong := int(np.sum(off > 1e-9)):
        worst = int(np.argmax(off))
        raise InvalidInputError(
            f"a .ffe file holds a grid: {wrong} of {len(directions)} directions are not on it "
            f"(worst: row {worst}, off by {off[worst]:.2g}){remedy}"
        )
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


def _lines(far: FarField, theta: FloatArray, phi: FloatArray, direction: ArrayLike | None) -> Iterator[str]:
    vector = np.ndim(far.total) == 3
    yield "##File Type: Far field"
    yield "##File Format: 8"
    yield f"##Source: creeping {__version__}"
    yield f"** {far.boundary} boundary, order {far.order}, k = {far.wavenumber!r} 1/{far.unit}"
    taken = "" if far.unit == "m" else "L is taken as the metre and "
    yield f"** frequency: {taken}the wave's speed as that of light"
    yield "** time factor exp(+jwt): complex conjugates of the far field f of creeping, exp(-iwt)"
    served = ", ".join(sorted({str(name) for name in far.method}))
    doubtful = f"{int(np.sum(far.unresolved))} of {len(far.method)} directions"
    yield f"** computed by {served or 'nothing'}; unresolved in {doubtful}"
    if far.stated_error is not None:
        rms, worst = far.stated_error
        yield f"** error of |f| by {far.error_source}: {rms:.3e} m rms over the directions, {worst:.3e} m at most"
    if not vector:
        yield "** SCALAR field: f stands in the columns of Etheta, those of Ephi are 0"
    for number, name in enumerate(("theta", "phi") if vector else ("scalar",)):
        yield ""
        if vector:
            yield f"** incident E along the {name} unit vector of the incident wave's direction of travel, 1 V/m"
        yield f"#Configuration Name: incident_{name}"
        yield "#Request Name: FarField"
        yield f"#Frequency: {float(frequency(far.wavenumber)):.14E}"
        yield "#Coordinate System: Spherical"
        yield f"#No. of Theta Samples: {len(theta)}"
        yield f"#No. of Phi Samples: {len(phi)}"
        yield "#Result Type: RCS"
        if direction is not None:
            source = np.degrees(angles_of(-unit_direction(direction)))
            yield f"#Incident Wave Direction: ({source[0]:.10g}, {source[1]:.10g})"
        yield "#No. of Header Lines: 1"
        names = (f'"{name}"' for name in (*COLUMNS, "RCS(Theta)", "RCS(Phi)", "RCS(Total)"))
        yield "#" + "".join(f"{name:>26}" for name in names)
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


@dataclass(frozen=True, eq=False)
class FfeBlock:
    """One request of a .ffe file: a far field in n directions at one frequency, for one incident wave.

    Attributes
    ----------
    name : str
        Name of the FEKO configuration.
    frequency : float, Hz
    theta, phi : (n,), degrees
    field : (n, 2) complex
        Along θ̂ and φ̂ of each row's own angles, time factor e^{-iωt}: f in metres if 1 V/m is incident, else rE in V.
    keys : dict
        Entries of the block's header, as text by name.
    """

    name: str
    frequency: float
    theta: FloatArray
    phi: FloatArray
    field: ComplexArray
    keys: dict[str, str]

    @property
    def directions(self) -> FloatArray:
        """Unit vectors (n, 3) of ``theta`` and ``phi``."""
        return directions_from_angles(np.radians(self.theta), np.radians(self.phi))

    @property
    def wavenumber(self) -> float:
        """Wavenumber k of an electromagnetic wave of this frequency, 1/m."""
        return float(wavenumber(self.frequency))

    @property
    def incidence(self) -> tuple[float, float] | None:
        """Direction from which the incident wave comes: theta and phi, degrees; None if the file does not give it."""
        numbers = _NUMBER.findall(self.keys.get("Incident Wave Direction", ""))
        return (float(numbers[0]), float(numbers[1])) if len(numbers) == 2 else None


@dataclass
class _Open:
    """A block while it is read."""

    keys: dict[str, str] = field(default_factory=dict)
    columns: list[int] = field(default_factory=list)
    count: int = 0
    rows: array[float] = field(default_factory=lambda: array("d"))


def read_ffe(path: str | os.PathLike[str]) -> tuple[FfeBlock, ...]:
    """Read a FEKO far-field file.

    Parameters
    ----------
    path : str or path

    Returns
    -------
    tuple of FfeBlock
        In the order of the file.

    Raises
    ------
    InvalidInputError
        If the file is not a FEKO far-field file or is damaged; the message gives the number of the line.

    Examples
    --------
    >>> import tempfile, numpy as np, creeping as cr, scatterers as sc
    >>> from creeping.files import read_ffe, write_ffe
    >>> from creeping.files.ffe import grid_directions
    >>> fan = cr.launch(cr.DirectFlow(sc.Sphere(), rtol=1e-6), cr.shadow_line(sc.Sphere(), (0, 0, 1)), n_rays=16)
    >>> theta, phi = np.radians([30.0, 60.0]), np.radians([0.0, 90.0])
    >>> far = cr.far_field(fan, grid_directions(theta, phi), wavenumber=30.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_ffe(f"{folder}/far.ffe", far, theta, phi)
    ...     block, = read_ffe(f"{folder}/far.ffe")
    >>> block.name, round(block.wavenumber, 9), bool(np.all(block.field[:2, 0] == far.total[[0, 2]]))
    ('incident_scalar', 30.0, True)
    """
    file = Path(path)
    found = tuple(_blocks(file))
    if not found:
        raise InvalidInputError(f"{file} has no far field: no rows below a header of {', '.join(COLUMNS)}")
    return found


def _blocks(file: Path) -> Iterator[FfeBlock]:
    block, number, blocks, rows = _Open(), 0, 0, 0
    for number, line in lines_of(file, 512_000_000, 4096):
        if line.startswith(("##", "**")):
            continue
        place = f"{file}, line {number}"
        if line.startswith("#"):
            if block.rows:
                yield _closed(f"{file}, block before line {number}", block)
                blocks, block = blocks + 1, _Open()
                if blocks >= 10_000:
                    raise InvalidInputError(f"{place}: more than 10000 blocks")
            _header(place, line, block)
        else:
            rows += 1
            if rows > 5_000_000:
                raise InvalidInputError(f"{place}: more than 5000000 rows; split the file")
            block.rows.extend(_row(place, line, block))
    if block.rows:
        yield _closed(f"{file}, block before line {number}", block)


def _header(place: str, line: str, block: _Open) -> None:
    """Take over a key, or the names of the columns."""
    key, colon, value = line[1:].partition(":")
    if colon and key.strip() and '"' not in key:
        name, told = key.strip(), value.strip()
        if block.keys.setdefault(name, told) != told:
            raise InvalidInputError(f"{place}: {name[:40]!r} is given twice, with other values")
        if len(block.keys) > 100:
            raise InvalidInputError(f"{place}: more than 100 keys of one block")
        return
    names = re.findall(r'"([^"]*)"', line)
    missing = [name for name in COLUMNS if name not in names]
    if missing:
        raise InvalidInputError(f"{place}: no column {missing[0]} among {', '.join(names) or 'none'}")
    block.columns, block.count = [names.index(name) for name in COLUMNS], len(names)


def _row(place: str, line: str, block: _Open) -> list[float]:
    cells = line.split()
    if not block.columns:
        raise InvalidInputError(f"{place}: a row before the names of the columns")
    if len(cells) != block.count:
        raise InvalidInputError(f"{place}: {len(cells)} numbers in {block.count} columns")
    values = [float(text) if _NUMBER.fullmatch(text) else np.nan for text in cells]
    strange = [cells[at] for at in block.columns if not np.isfinite(values[at])]
    if strange:
        raise InvalidInputError(f"{place}: {strange[0][:40]!r} is no finite number")
    return [values[at] for at in block.columns]


def _closed(place: str, block: _Open) -> FfeBlock:
    """The block that ends at a place."""
    sizes = []
    for key in ("No. of Theta Samples", "No. of Phi Samples"):
        if not re.fullmatch(r"[0-9]{1,9}", block.keys.get(key, "")):
            raise InvalidInputError(f"{place}: no whole number as {key!r}")
        sizes.append(int(block.keys[key]))
    rows = np.array(block.rows).reshape(-1, len(COLUMNS))
    if sizes[0] * sizes[1] != len(rows):
        raise InvalidInputError(f"{place}: {len(rows)} rows, not {sizes[0]} theta x {sizes[1]} phi")
    text = block.keys.get("Frequency", "")
    hertz = float(text) if _NUMBER.fullmatch(text) else np.nan
    if not (np.isfinite(hertz) and hertz > 0):
        raise InvalidInputError(f"{place}: no positive number as 'Frequency'")
    e = np.stack([rows[:, 2] + 1j * rows[:, 3], rows[:, 4] + 1j * rows[:, 5]], axis=-1)
    name = block.keys.get("Configuration Name", "")
    return FfeBlock(name, hertz, rows[:, 0], rows[:, 1], np.conj(e), dict(block.keys))
