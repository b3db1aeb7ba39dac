"""T-matrices as HDF5 files in the layout tmat.h5, which treams reads and writes.

    tmatrix (n, n)                  out of, and in to, the waves below
    angular_vacuum_wavenumber       with its unit, m^{-1}: L stands as the metre where the body does not know its unit
    modes/l, modes/m                degree and order of each wave
    modes/polarization              "electric" or "magnetic"; none of a scalar field
    modes/positions (1, 3)          the centre, unless it is the origin
    embedding/...                   1: of empty space
    computation, scatterer          what it is of, how it was made

The layout has no word for scalar fields: theirs is the same without polarisations, with "acoustic" among the keywords,
and acoustotreams takes the arrays. Waves may stand in any order; waves of a degree that a file lacks are 0.

A file is data: sizes are checked before arrays are read, and nothing in it is executed.

Sources: [BFR24], treams 0.4.7, `treams.io`.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, ComplexArray, IntArray
from creeping._version import __version__
from creeping.errors import CreepingError, InvalidInputError
from creeping.field.tmatrix.patterns import degrees_of
from creeping.field.tmatrix.spherical_waves import count, degrees, vector_count, vector_degrees
from creeping.storage.atomic import written_aside
from creeping.storage.memory import required, within_budget

if TYPE_CHECKING:
    import xarray


INVERSE_METRES = {"nm^{-1}": 1e9, "um^{-1}": 1e6, "µm^{-1}": 1e6, "mm^{-1}": 1e3, "cm^{-1}": 1e2, "m^{-1}": 1.0}
"""Units of wavenumbers that are read."""
ELECTRIC, MAGNETIC = ("electric", "tm", "N"), ("magnetic", "te", "M")
"""What files call the polarisations."""
LARGEST = 200
"""Degree beyond which a file is not believed."""
ACOUSTIC = "acoustic"


def write_t_matrix(T: Any, path: str | os.PathLike[str]) -> None:
    """Write a T-matrix; the file is replaced at once when complete.

    Parameters
    ----------
    T : TMatrix
    path : str or path
        By custom of suffix .tmat.h5.

    Raises
    ------
    CreepingError
        If h5py is missing, or the file cannot be written.
    """
    h5py = required("h5py", use="T-matrices are stored by", extra="tmatrix")
    with written_aside(path) as aside, h5py.File(aside, "w") as file:
        file.attrs["storage_format_version"] = "v1"
        file.attrs["name"] = T.body or "T-matrix"
        traits = [ACOUSTIC] * (not T.vector) + ["reciprocal"] + ([] if T.absorbing else ["lossless"])
        file.attrs["keywords"] = ", ".join(traits)
        file["tmatrix"] = T.matrix
        file["angular_vacuum_wavenumber"] = T.wavenumber
        file["angular_vacuum_wavenumber"].attrs["unit"] = "m^{-1}"
        modes = file.create_group("modes")
        deg, m = (vector_degrees(T.order) if T.vector else degrees(T.order))[:2]
        modes["l"], modes["m"] = deg, m
        if T.vector:
            modes["polarization"] = ["electric", "magnetic"] * (len(deg) // 2)
        if np.any(T.center):
            modes["positions"] = T.center[None]
            modes["positions"].attrs["unit"] = "m"
        embedding = file.create_group("embedding")
        embedding.attrs["name"] = "Air, Vacuum"
        embedding["relative_permittivity"] = embedding["relative_permeability"] = 1.0
        computation = file.create_group("computation")
        computation.attrs.update(method="integral equation", software=f"creeping={__version__}, numpy={np.__version__}")
        computation.attrs.update(boundary=T.boundary, extinction=T.extinction, unit=T.unit, absorbing=T.absorbing)
        scatterer = file.create_group("scatterer")
        scatterer.attrs["name"] = T.body or "body"
        scatterer.create_group("geometry").attrs["unit"] = "m"
        scatterer.create_group("material").attrs["name"] = T.boundary


def as_dataset(T: Any) -> xarray.Dataset:
    """The matrix with names on its axes: see `TMatrix.to_xarray`."""
    library = required("xarray", use="labelled results need", extra="sweep")
    deg, m = degrees_of(T.order, vector=T.vector)
    names = ("outgoing", "incoming")
    coordinates: dict[str, Any] = {"center": ("axis", T.center, {"units": T.unit})}
    for name in names:
        coordinates |= {f"degree_{name}": (name, deg), f"order_{name}": (name, m)}
        if T.vector:
            coordinates[f"polarisation_{name}"] = (name, np.tile(["electric", "magnetic"], len(deg) // 2))
    words = {"wavenumber": T.wavenumber, "boundary": T.boundary, "body": T.body}
    words |= {"reciprocity": T.reciprocity, "unitarity": T.unitarity, "conventions": "exp(-i omega t)"}
    found: xarray.Dataset = library.Dataset({"T": (names, T.matrix)}, coordinates, words)
    return found


def read_t_matrix(path: str | os.PathLike[str]) -> dict[str, Any]:
    """What a `TMatrix` is made of, from a file.

    Raises
    ------
    CreepingError
        If h5py is missing, or the file cannot be read.
    InvalidInputError
        If it is no T-matrix of one body, wavenumber and centre, or too large.
    """
    h5py = required("h5py", use="T-matrices are stored by", extra="tmatrix")
    try:
        with h5py.File(Path(path), "r") as file:
            return _read(file, h5py)
    except (OSError, KeyError, RuntimeError) as error:
        raise CreepingError(f"{path} is no T-matrix that can be read: {error}") from error


def _read(file: Any, library: Any) -> dict[str, Any]:
    table = _array(file, library, "tmatrix")
    shape = table.shape[-2:]
    # treams writes lists of them: one of one is as good
    if len(shape) != 2 or np.prod(table.shape[:-2]) != 1 or table.dtype.kind not in "cfiu":
        raise InvalidInputError(
            f"the T-matrix of a file has shape {table.shape} and type {table.dtype}; one matrix of numbers is needed"
        )
    within_budget(48.0 * float(np.prod([float(n) for n in shape])), "the T-matrix of a file", "take a lower order")
    polarised = "polarization" in file["modes"] or "polarization_incident" in file["modes"]
    rows, columns = (_numbers(file, library, shape[axis], axis, polarised) for axis in (0, 1))
    order = int(max(rows[1], columns[1]))
    n = vector_count(order) if polarised else count(order)
    within_budget(32.0 * n**2, f"a T-matrix of order {order}", "take a lower order")
    matrix: ComplexArray = np.zeros((n, n), dtype=complex)
    matrix[np.ix_(rows[0], columns[0])] = table[()].reshape(shape)
    k, unit = _wavenumber(file, library)
    center = np.zeros(3)
    if "positions" in file["modes"]:
        found = _array(file, library, "modes/positions")
        if found.shape != (1, 3):
            raise InvalidInputError(f"a file has waves about {found.shape[0]} centres; a T-matrix here is about one")
        length = _text(found.attrs.get("unit", "m")) + "^{-1}"
        center = np.asarray(found[()], dtype=float)[0] * unit / INVERSE_METRES.get(length, unit)
    told = file["computation"].attrs if "computation" in file else {}
    keywords = _text(file.attrs.get("keywords", ""))
    return {
        "matrix": matrix,
        "wavenumber": k,
        "center": center,
        "vector": polarised,
        "boundary": _text(told.get("boundary", "unknown")),
        "body": _text(file.attrs.get("name", "")),
        "extinction": float(told.get("extinction", np.nan)),
        "absorbing": bool(told.get("absorbing", "lossless" not in keywords)),
        "unit": _text(told.get("unit", "m")),
    }


def _array(file: Any, library: Any, name: str) -> Any:
    """A data set of the file itself: links to other files are not followed."""
    place = file
    for part in name.split("/"):
        link = place.get(part, getlink=True)
        if not isinstance(link, library.HardLink):
            raise InvalidInputError(f"a file has no {name} of its own")
        place = place[part]
    if not isinstance(place, library.Dataset) or place.external or place.is_virtual:
        raise InvalidInputError(f"{name} of a file is no data of its own")
    return place


def _numbers(file: Any, library: Any, n: int, axis: int, polarised: bool) -> tuple[IntArray, int]:
    """Numbers of the waves along an axis, and their highest degree."""
    suffix = ("_scattered", "_incident")[axis]
    lanes = []
    for name in ("l", "m", "polarization")[: 2 + polarised]:
        own = name + suffix if name + suffix in file["modes"] else name
        found = _array(file, library, f"modes/{own}")
        if found.shape != (n,):
            raise InvalidInputError(f"modes/{own} of a file has shape {found.shape}; the T-matrix has {n} waves there")
        lanes.append(found[()])
    deg, m = (np.asarray(lane) for lane in lanes[:2])
    if deg.dtype.kind not in "iu" or m.dtype.kind not in "iu" or not n:
        raise InvalidInputError("degrees and orders of a file are not whole numbers")
    deg, m = deg.astype(np.int64), m.astype(np.int64)
    if np.any(deg < polarised) or np.any(deg > LARGEST) or np.any(np.abs(m) > deg):
        raise InvalidInputError(
            f"a file has waves of degrees {deg.min()} to {deg.max()} and orders {m.min()} to {m.max()}"
        )
    number = deg * (deg + 1) + m
    if polarised:
        words = [_text(word) for word in lanes[2]]
        unknown = sorted({word for word in words if word not in ELECTRIC + MAGNETIC})
        if unknown:
            raise InvalidInputError(
                f"polarisations {', '.join(unknown)[:80]} of a file are not electric and magnetic; change them there "
                "(treams: changepoltype('parity'))"
            )
        number = 2 * (number - 1) + np.array([word in MAGNETIC for word in words])
    if len(np.unique(number)) != n:
        raise InvalidInputError("a file has a wave twice")
    return number, int(deg.max())


def _wavenumber(file: Any, library: Any) -> tuple[float, float]:
    """Wavenumber in the file's unit, and how many 1/m that is."""
    name = "angular_vacuum_wavenumber"
    if name not in file:
        raise InvalidInputError(f"a file has no {name}; frequencies and wavelengths are not read")
    found = _array(file, library, name)
    if int(np.prod(found.shape)) != 1 or found.dtype.kind not in "fiu":
        raise InvalidInputError(f"a file has wavenumbers of shape {found.shape}; a T-matrix is of one")
    k = float(np.ravel(found[()])[0])
    unit = _text(found.attrs.get("unit", "m^{-1}"))
    if not 0 < k < np.inf or unit not in INVERSE_METRES:
        raise InvalidInputError(f"wavenumber {k:g} {unit} of a file is no positive number of 1/length")
    for part in ("relative_permittivity", "relative_permeability"):
        if f"embedding/{part}" in file and not np.allclose(_array(file, library, f"embedding/{part}")[()], 1.0):
            raise InvalidInputError(f"{part} around the body is not 1; only empty space is known")
    return k, INVERSE_METRES[unit]


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
