"""Backscatter of a body over angle and frequency, and its bistatic field in a cut: what a radar or a sonar measures.

Angles are those of the radar or of the observer as seen from the body, in degrees: azimuth from x towards y, elevation
from the plane z = 0. The wave of a radar at (azimuth, elevation) travels the other way.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creeping._progress import reporting
from creeping._typing import Any, ArrayLike, FloatArray
from creeping.errors import InvalidInputError, SingularIncidenceError
from creeping.field.arguments import checked, checked_across, checked_method, checked_plain
from creeping.field.boundary import BoundaryLike
from creeping.field.equation.solving import is_rough
from creeping.field.results.comparison import Echo
from creeping.field.routes import by_equation_alone, expected_seconds
from creeping.field.tmatrix.computing import pays
from creeping.field.validity_range import is_reached
from creeping.geodesics.direct_flow import DirectFlow
from creeping.geometry.arguments import checked_body, folder_path, real_array, real_number, shown, whole_number
from creeping.geometry.directions import azimuth_elevation_of, directions_from_azimuth_elevation
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface, size, why_no_rays
from creeping.phaseflow.request import choose_flow
from creeping.rays.fan import launch
from creeping.rays.reach import body_length
from creeping.rays.transport import Flow
from creeping.shadow.line import shadow_line
from creeping.sweeping.blocks import TASK, Told, begun, sizes_of, sweep_blocks
from creeping.sweeping.request import AMPLITUDES, METHODS
from creeping.sweeping.results import SweepFields
from creeping.sweeping.run import Progress, sweep_directions
from creeping.sweeping.sweeper import NoFlow

if TYPE_CHECKING:
    import xarray

MOST = 10_000_000
"""Values of one call."""


def backscatter(
    body: Surface,
    *,
    wavenumbers: ArrayLike,
    azimuth: ArrayLike = 0.0,
    elevation: ArrayLike = 0.0,
    boundary: BoundaryLike = "pec",
    method: str = "auto",
    n_rays: int = 192,
    cache: bool = True,
    store: str | Path | None = None,
    resume: bool = False,
    rows: Told | None = None,
    progress: Progress | bool | None = None,
) -> xarray.Dataset:
    """Backscattered far field for each angle of the radar and each wavenumber.

    Parameters
    ----------
    body : Surface
    wavenumbers : float or (k,), 1/L
        See `creeping.wavenumber` for frequencies.
    azimuth, elevation : float or (n,), degrees
        Position of the radar, seen from the body; one of the two may be a single number.
    boundary : "pec", "soft", "hard" or ImpedanceBoundary
    method : {"auto", "rays", "currents", "equation", "t-matrix"}
        As for `creeping.sweep_directions`. "auto" uses rays, and currents where rays leave a value unresolved and have
        the larger error. For a body that has edges, joints or tips, or parts too sharply curved for rays, it uses the
        integral equation, or the T-matrix if that is faster for the number of angles.
    n_rays : int
        Number of rays per incidence.
    cache : bool
        Whether to cache the phase map for later runs.
    store : path, optional
        Folder in which values are stored as they are computed.
    resume : bool
        Continue an existing store.
    rows : callable, optional
        With a store: called every few seconds with the values known so far, `creeping.sweeping.blocks.Rows`.
    progress : callable or bool, optional
        True shows a bar. A callable is called as ``progress(done, total, seconds)``, see `creeping.sweep_directions`.

    Returns
    -------
    xarray.Dataset
        As from `creeping.sweep_directions`, with coordinates ``azimuth`` and ``elevation`` of the radar in degrees.
        ``dataset.field`` gives totals, decibels and polarisations.

    Raises
    ------
    CreepingError
        On bad input, or if the sweep fails.

    Examples
    --------
    >>> import creeping as cr, scatterers as sc
    >>> ds = cr.backscatter(sc.Sphere(0.15), wavenumbers=cr.wavenumber("10 GHz"))
    >>> float(ds.field.polarisation("VV").dbsm.squeeze().round(1))            # 10 log10(pi radius^2) is -11.5
    -11.4
    """
    azimuths, elevations = _angles(azimuth, elevation)
    radar = directions_from_azimuth_elevation(np.radians(azimuths), np.radians(elevations))
    asked = {"boundary": boundary, "method": method, "n_rays": n_rays, "quantity": "monostatic"}
    angles = {"azimuth": ("incidence", azimuths), "elevation": ("incidence", elevations)}
    return _swept(body, -radar, wavenumbers, asked, angles, cache, progress, (store, resume, rows))


def bistatic(
    body: Surface,
    *,
    wavenumbers: ArrayLike,
    incidence: tuple[float, float] = (0.0, 0.0),
    azimuth: ArrayLike = 0.0,
    elevation: ArrayLike = 0.0,
    boundary: BoundaryLike = "pec",
    method: str = "currents",
    n_rays: int = 192,
    cache: bool = True,
    store: str | Path | None = None,
    resume: bool = False,
    rows: Told | None = None,
    progress: Progress | bool | None = None,
) -> xarray.Dataset:
    """Far field towards observers around the body, for one incidence.

    Parameters
    ----------
    incidence : (azimuth, elevation), degrees
        Position of the radar, seen from the body. The wave travels in the opposite direction.
    azimuth, elevation : float or (m,), degrees
        Positions of the observers, seen from the body.
    body, wavenumbers, boundary, method, n_rays, cache, store, resume, rows, progress
        As for `backscatter`.

    Returns
    -------
    xarray.Dataset
        As from `creeping.sweep_directions`, with coordinates ``azimuth`` and ``elevation`` of the observers in degrees.

    Raises
    ------
    CreepingError
        On bad input, or if the sweep fails.

    Examples
    --------
    >>> import creeping as cr, scatterers as sc
    >>> ds = cr.bistatic(sc.Sphere(), wavenumbers=20.0, azimuth=[0.0, 90.0], boundary="soft")
    >>> ds.field.total.sizes["observer"]
    2
    """
    azimuths, elevations = _angles(azimuth, elevation)
    observers = directions_from_azimuth_elevation(np.radians(azimuths), np.radians(elevations))
    try:
        first, second = (real_number(angle, "incidence") for angle in incidence)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"incidence = {shown(incidence)} is not (azimuth, elevation) in degrees") from error
    radar = directions_from_azimuth_elevation(*(float(np.radians(v[0])) for v in _angles(first, second)))
    asked = {"boundary": boundary, "method": method, "n_rays": n_rays, "quantity": "bistatic", "observation": observers}
    angles = {"azimuth": ("observer", azimuths), "elevation": ("observer", elevations)}
    return _swept(body, -radar[None], wavenumbers, asked, angles, cache, progress, (store, resume, rows))


def seconds_of_currents(body: Surface, k: FloatArray, radar: Any, *, observers: int, boundary: BoundaryLike) -> float:
    """Cost of an echo by currents at all incidences, s, estimated from the first one; 0 if it is not known.

    ``radar``: azimuths and elevations (n,), degrees; ``observers`` directions belong to each.
    """
    if is_piecewise(body) or why_no_rays(body):
        return 0.0
    try:
        line = shadow_line(body, -directions_from_azimuth_elevation(*(np.radians(angles[0]) for angles in radar)))
    except SingularIncidenceError:
        return 0.0
    fan = launch(DirectFlow(body, rtol=1e-6), line, length=size(body), n_rays=8, measured=False)
    return len(radar[0]) * expected_seconds(fan, k, observers, boundary)


def monostatic_method(body: Surface, wavenumbers: FloatArray, boundary: BoundaryLike, incidences: int) -> str:
    """What "auto" is in backscatter: "t-matrix" where the equation would be solved for each incidence and takes longer.

    ``wavenumbers`` (k,), 1/L.
    """
    solved = why_no_rays(body) or is_piecewise(body)
    if not solved and not is_rough(body):
        solved = not is_reached(body, float(np.min(wavenumbers)))
    return "t-matrix" if solved and pays(body, wavenumbers, boundary, incidences) else "auto"


def _angles(azimuth: ArrayLike, elevation: ArrayLike) -> tuple[FloatArray, FloatArray]:
    try:
        given = real_array(azimuth, "azimuths"), real_array(elevation, "elevations")
        a, e = np.broadcast_arrays(*map(np.atleast_1d, given))
    except ValueError as error:
        raise InvalidInputError(f"azimuth and elevation are no numbers of one shape: {error}") from None
    if a.ndim != 1 or not a.size or not (np.all(np.isfinite(a)) and np.all(np.isfinite(e))):
        raise InvalidInputError(
            f"azimuth and elevation of shape {a.shape} are not one or more finite angles in degrees"
        )
    for name, angles in zip(("azimuth", "elevation"), given, strict=True):
        turned = np.abs(np.degrees(angles))
        # none in degrees is within 1e-9 of such a multiple of pi/180 by accident
        if 1 <= np.max(turned, initial=0) < 361 and np.all(np.abs(turned - np.round(turned)) < 1e-9):
            raise InvalidInputError(f"{name} is in radians, for {turned.max():.0f} degrees at most; give np.degrees")
    if np.any(np.abs(e) > 90):
        raise InvalidInputError(f"elevation {e[np.argmax(np.abs(e))]:g} is not between -90 and 90 degrees")
    return a, e


def _swept(
    body: Surface,
    incidences: FloatArray,
    wavenumbers: ArrayLike,
    asked: dict[str, Any],
    angles: dict[str, tuple[str, FloatArray]],
    cache: bool,
    progress: Progress | bool | None,
    storing: tuple[str | Path | None, bool, Told | None],
) -> xarray.Dataset:
    """Sweep of checked arguments, with coordinates of ``angles``, dimension and degrees."""
    if not why_no_rays(body):
        checked_body(body, charts=not is_piecewise(body))
    checked_plain(body)
    checked_method(asked["method"], 2, METHODS)
    asked["n_rays"] = whole_number(asked["n_rays"], "n_rays")
    numbers = np.atleast_1d(np.asarray(wavenumbers))
    k = np.array([checked(value, 2) for value in numbers.tolist()])
    if k.ndim != 1 or not k.size:
        raise InvalidInputError(f"wavenumbers of shape {numbers.shape} are not one or more numbers")
    checked_across(body, float(k.min()), float(k.max()))
    if len(np.unique(k)) < len(k):
        raise InvalidInputError("wavenumbers repeat themselves")
    count = len(incidences) * len(k) * len(asked.get("observation", (None,)))
    if count > MOST:
        raise InvalidInputError(f"{count} values are asked for at once; {MOST} are the most: give a coarser step")
    store, resume, rows = storing
    # before the time is spent
    if store is not None:
        store = folder_path(store, "store")
        if store.exists() and any(store.rglob("zarr.json")) and not resume:
            raise InvalidInputError(f"{store} exists; give resume=True to go on with it, or choose another store")
    elif resume:
        raise InvalidInputError("resume goes with store=, the folder of the results")
    known = begun(store) if store else None
    if asked["method"] == "auto" and asked["quantity"] == "monostatic":
        # what is quicker may be another way today
        told = known and known.key["request"]["method"]
        asked["method"] = told or monostatic_method(body, k, asked["boundary"], len(incidences))
    options: dict[str, Any] = dict(asked)
    flow: Flow | Surface
    if why_no_rays(body) or asked["method"] == "t-matrix":
        flow = body
    elif by_equation_alone(body, k, [asked["boundary"]], len(incidences), method=asked["method"]):
        flow = NoFlow(body)
    else:
        length = body_length(body, float(k.min()))
        # the first block may have needed none, where others do
        stored = known.flow(body) if known else None
        rays = 2 * asked["n_rays"] * len(incidences)
        if stored is None or isinstance(stored, NoFlow):
            stored = choose_flow(body, n_rays=rays, length=length, cache=cache)
        flow = stored
        # small enough that progress is told in time, large enough that a task is not all overhead
        options |= {"chunk": TASK, "length": length}

    def named(found: xarray.Dataset) -> xarray.Dataset:
        words = {"units": "degree", "long_name": "as seen from the body"}
        return found.assign_coords({name: (*one, words) for name, one in angles.items()})

    with reporting(progress, "incidences") as told:
        if store is None:
            return named(sweep_directions(flow, incidences, wavenumbers=k, progress=told, **options))
        options.pop("chunk", None)
        begun_with = known and (len(known.key["request"]["wavenumbers"]), known.chunk)
        sizes = begun_with or sizes_of(flow, incidences, k, options)
        seen = rows and (lambda found: rows(found._replace(dataset=named(found.dataset))))
        options |= {"store": store, "resume": resume, "sizes": sizes, "rows": seen}
        return named(sweep_blocks(flow, incidences, k, progress=told, **options))


def echo_of(
    dataset: xarray.Dataset,
    quantity: str,
    channels: tuple[str, ...],
    angle_name: str,
    *,
    sound_speed: float | None = None,
) -> Echo:
    """Echo of a dataset of `backscatter` or `bistatic`: its arrays by channel, angle and wavenumber.

    ``channels`` are polarisations of a conductor, or the one boundary; a value counts as unresolved in all of them.
    """
    conductor = "total_pec" in dataset
    bistatic_cut = "observer" in dataset.dims
    order = ("observer", "wavenumber") if bistatic_cut else ("incidence", "wavenumber")
    first = dataset.isel(incidence=0) if bistatic_cut else dataset
    fields = SweepFields(first)

    picked = [fields.polarisation(name) if conductor else SweepFields(first.sel(boundary=name)) for name in channels]

    def stacked(name: str) -> np.ndarray[Any, Any]:
        return np.stack([np.asarray(one.dataset[name].transpose(*order).values) for one in picked])

    known, unresolved = picked[0].dataset, stacked("unresolved")
    radar = None
    if bistatic_cut:
        azimuth, elevation = azimuth_elevation_of(-dataset["direction"].values[0])
        radar = (float(np.degrees(azimuth)), float(np.degrees(elevation)))
    return Echo(
        quantity=quantity,
        channels=channels,
        angle_name=angle_name,
        azimuth=dataset["azimuth"].values,
        elevation=dataset["elevation"].values,
        incidence=radar,
        wavenumbers=dataset["wavenumber"].values,
        total=stacked("total"),
        parts={name: stacked(name) for name in AMPLITUDES if name in known and name != "total"},
        error=stacked("error"),
        unresolved=unresolved,
        by_currents=stacked("by_currents") if "by_currents" in known else np.zeros_like(unresolved),
        otherwise=dataset.attrs.get("served_by", "rays"),
        sound_speed=sound_speed,
    )
