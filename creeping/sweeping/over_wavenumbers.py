"""T-matrices of one body over wavenumbers, and its cross sections in the mean of all orientations.

Each wavenumber is a task of its own, in this process or on a cluster; with a store each matrix is there whole or not.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creeping._progress import reporting
from creeping._typing import Any, ArrayLike, FloatArray
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked
from creeping.field.boundary import BoundaryLike, boundary_name
from creeping.field.tmatrix.computing import SECONDS, refuse, t_matrix
from creeping.field.tmatrix.patterns import Averages
from creeping.field.tmatrix.result import TMatrix
from creeping.geometry.checks import unit_of
from creeping.geometry.surface import Surface
from creeping.sweeping.results import in_unit, require
from creeping.sweeping.run import Progress

if TYPE_CHECKING:
    import xarray


def t_matrices(
    body: Surface,
    *,
    wavenumbers: ArrayLike,
    boundary: BoundaryLike,
    center: ArrayLike | None = None,
    order: int | None = None,
    seconds: float = SECONDS,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | bool | None = None,
) -> Iterator[TMatrix]:
    """Iterate over the T-matrices of a body at several wavenumbers, each as `creeping.t_matrix` gives it.

    Parameters
    ----------
    wavenumbers : float or (k,), 1/L
        See `creeping.wavenumber` for frequencies.
    body, boundary, center, order
        As for `creeping.t_matrix`.
    seconds : float
        Approximate limit of the run time of one matrix. An error is raised before the first one if it would be
        exceeded.
    store : path, optional
        Folder for the matrices. Those that are there are read, whichever call has made them; an interrupted call
        resumes.
    client : distributed.Client or str, optional
        Dask cluster that computes a matrix per task, or the address of its scheduler. All workers must see the store.
    progress : callable or bool, optional
        True shows a bar. A callable is called as ``progress(done, total, seconds)`` after each matrix.

    Returns
    -------
    iterator of TMatrix
        In the order of the wavenumbers. One matrix is in memory at a time; with a cluster, all that are finished.

    Raises
    ------
    CreepingError
        As by `creeping.t_matrix`, or if the cluster cannot be reached or loses a worker.

    Examples
    --------
    >>> import creeping as cr, scatterers as sc
    >>> [T.order for T in cr.t_matrices(sc.Sphere(), wavenumbers=[1.0, 2.0], boundary="soft")]
    [5, 6]
    """
    numbers = np.atleast_1d(np.asarray(wavenumbers))
    k = [checked(value, 2, body) for value in numbers.tolist()]
    if numbers.ndim != 1 or not k:
        raise InvalidInputError(f"wavenumbers of shape {numbers.shape} are not one or more numbers")
    refuse(body, max(k), boundary, order, seconds)
    asked: dict[str, Any] = {"center": center, "order": order, "seconds": seconds, "store": store}
    return _made(partial(t_matrix, body, boundary=boundary, **asked), k, client, progress)


def _made(make: Any, wavenumbers: list[float], client: Any, progress: Progress | bool | None) -> Iterator[TMatrix]:
    """Matrices of the wavenumbers, one after the other or on a cluster."""
    started = time.perf_counter()
    with ExitStack() as stack:
        told = stack.enter_context(reporting(progress, "matrices"))
        if client is None:
            each: Iterator[TMatrix] = (make(wavenumber=k) for k in wavenumbers)
        else:
            require("distributed")
            from creeping.sweeping.cluster import connected, in_order

            own = stack.enter_context(connected(client)) if isinstance(client, str) else client
            each = in_order(own, make, [{"wavenumber": k} for k in wavenumbers])
        for done, T in enumerate(each, 1):
            if told:
                told(done, len(wavenumbers), time.perf_counter() - started)
            yield T


def orientation_averages(
    body: Surface,
    *,
    wavenumbers: ArrayLike,
    boundary: BoundaryLike,
    seconds: float = SECONDS,
    store: str | Path | None = None,
    client: Any = None,
    progress: Progress | bool | None = None,
) -> xarray.Dataset:
    """Cross sections and target strength of a body, averaged over all its orientations, at several wavenumbers.

    One T-matrix per wavenumber gives each average as a finite sum: no orientations are sampled.

    Parameters
    ----------
    body, wavenumbers, boundary, seconds, store, client, progress
        As for `creeping.t_matrices`.

    Returns
    -------
    xarray.Dataset
        By ``wavenumber``: ``backscattering``, ``scattering`` and ``extinction`` cross sections, L^2, as in
        `TMatrix.orientation_average`; ``target_strength``, 10 log10(backscattering/4 pi), dB; and
        ``target_strength_error``, dB.

    Raises
    ------
    CreepingError
        As by `creeping.t_matrices`.

    Examples
    --------
    >>> import creeping as cr, scatterers as sc
    >>> ds = cr.orientation_averages(sc.Ellipsoid(0.5, 0.3, 0.2), wavenumbers=[1.0, 4.0], boundary="hard")
    >>> ds.target_strength.round(1).values.tolist()
    [-32.2, -15.6]
    """
    asked: dict[str, Any] = {"wavenumbers": wavenumbers, "boundary": boundary, "seconds": seconds}
    matrices = t_matrices(body, store=store, client=client, progress=progress, **asked)
    return averages_of(body, boundary, [(T.wavenumber, T.orientation_average()) for T in matrices])


def averages_of(body: Surface, boundary: BoundaryLike, rows: list[tuple[float, Averages]]) -> xarray.Dataset:
    """Dataset of `orientation_averages`; a row is k, 1/L, and averages."""
    library, unit = require("xarray"), unit_of(body)
    means = "averaged over all orientations" + " and both polarisations" * (boundary_name(boundary) == "pec")
    words = {
        "backscattering": ("L^2", f"4 pi |f(d, -d)|^2, {means}"),
        "scattering": ("L^2", f"scattering cross section, {means}"),
        "extinction": ("L^2", f"extinction cross section, {means}"),
        "target_strength": ("dB re 1 L", "10 log10(backscattering/4 pi)"),
        "target_strength_error": ("dB", "error of the target strength"),
    }

    def column(values: list[float], units: str, text: str) -> tuple[str, FloatArray, dict[str, str]]:
        return "wavenumber", np.array(values), {"units": in_unit(units, unit), "description": text}

    variables = {name: column([getattr(found, name) for _, found in rows], *of) for name, of in words.items()}
    coordinates = {"wavenumber": column([k for k, _ in rows], "1/L", "k")}
    attributes = {"body": " ".join(repr(body).split()), "boundary": boundary_name(boundary)}
    attributes["creeping_version"] = __version__
    dataset: xarray.Dataset = library.Dataset(variables, coordinates, attributes)
    return dataset
