"""The T-matrix of a body: its integral equation solved for every regular wave at once.

    scalar      p_lm = ik int [u d/dn - du/dn] (j_l conj Y_lm) dS,   u or du/dn of incoming psi_l'm'
    conductor   p = -k^2 int conj(V).J dS,   V = N_lm or M_lm regular,   J of incoming E = V', H = curl E/(ik)

since G = ik sum h_l Y_lm(x) j_l conj Y_lm(y), and the same with N and M for E; all about one centre. The right sides of
the equation are regular waves at the nodes and at the points beneath them. Its matrix is factorised where memory holds
it; else GMRES serves for blocks of waves.

A body of radius R scatters waves of degrees up to kR, and of those beyond less by a factor that falls faster than
exponentially, over a width of (kR)^(1/3): that of Airy's function, which j_l is next to l = kR.

Sources: [W71]; [MTL02, sec. 5.8]; Derivations, F36.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from creeping._progress import telling
from creeping._typing import Any, ArrayLike, ComplexArray, FloatArray
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import Boundary, BoundaryLike, boundary_name
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.currents import inside_points
from creeping.field.equation.effort import (
    PRODUCTS,
    Load,
    equation_boundary,
    fewest_nodes,
    load_of,
    load_on,
    pair_seconds,
    plan_of,
)
from creeping.field.equation.matrix import Matrix
from creeping.field.equation.mirrors import mirrors_of, no_mirrors
from creeping.field.tmatrix.result import TMatrix
from creeping.field.tmatrix.solved_waves import SolvedWaves
from creeping.field.tmatrix.spherical_waves import count, vector_count
from creeping.geometry.arguments import folder_path, real_array, shown, whole_number
from creeping.geometry.checks import unit_of
from creeping.geometry.surface import Surface, fingerprint, memo
from creeping.kernels.threads import thread_count
from creeping.storage.memory import budget, within_budget
from creeping.storage.parts import Arrays, Keeping, Parts, not_kept

SECONDS = 300.0
"""What it may take, unless the caller says."""
DIGITS = 2.3
"""Digits that waves of the degrees kept give: of a flat-ended cylinder, k = 5, 10 and 20, f lacks 3e-5, 1e-5 and 2e-5
of the largest at 1600 pairs of directions for want of higher ones; 1.4e-4, 8e-5 and 2e-5 with 2 digits."""
FINER = 1.03
"""Wavenumber of the tiles, over that of the waves: entries of a sphere, ka = 20, err by 2e-4 of the largest at 1."""
LEAST = 3
"""Degrees at least."""
RATE, PER_SUM = 3e10, 4e-9
"""Single-precision operations that LAPACK does in a second on a core, and seconds of a sum over images, about."""
WAVE_BYTES = 80
"""Bytes of a wave at a node while all are solved: five complex numbers."""
LOWER = "lower the wavenumber, or let creeping.solve serve for few incidences"
"""What else one can do where a T-matrix takes too much."""
RESULT = "matrix"
"""Part of a store that is left at the end."""
KEPT = 0.1
"""Share of the memory that the matrices kept with a body may take."""
DENSE = 0.7
"""Share of the memory that the factors and the waves at the nodes may take."""


def t_matrix(
    body: Surface,
    *,
    wavenumber: float,
    boundary: BoundaryLike,
    center: ArrayLike | None = None,
    order: int | None = None,
    seconds: float = SECONDS,
    store: str | Path | None = None,
    progress: Callable[[str], None] | bool | None = None,
) -> TMatrix:
    """T-matrix of a body, which gives the scattering of every incident wave, from the integral equation.

    Parameters
    ----------
    body : Surface
        Smooth, or of pieces with edges, joints and tips.
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    center : (3,), L, optional
        Centre of the spherical waves; by default the centre of the body's bounding box.
    order : int, optional
        Highest degree of the waves. By default truncation changes far fields by less than 1e-4 of the largest.
    seconds : float
        Approximate limit of the run time on all cores. An error is raised before the start if it would be exceeded.
    store : path, optional
        Folder for solved columns, stored as they are computed, and for the finished matrix. An interrupted call resumes
        from it, and a repeated call reads its result. Matrices of several wavenumbers, boundaries and bodies may share
        a folder, and several processes may fill it, e.g. one per frequency.
    progress : callable or bool, optional
        Called with a line of text before each step, with the number of nodes, the time and the memory; True shows them.

    Returns
    -------
    TMatrix

    Raises
    ------
    InvalidInputError
        On bad arguments, for a weighted body, if the solution would exceed the limits of time or memory, or if a store
        is given for an admittance that varies, which the store cannot identify.
    SurfaceError
        If the body cannot be meshed.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> T = cr.t_matrix(sc.Sphere(), wavenumber=2.0, boundary="soft")
    >>> T.order, T.matrix.shape, bool(T.unitarity < 1e-3)
    (6, (49, 49), True)
    >>> far = T.far_field((0, 0, 1), [(0, 0, -1), (1, 0, 0)])
    >>> far.method.tolist(), bool(far.error.max() < 0.01 * abs(far.total).max())
    (['t-matrix', 't-matrix'], True)
    """
    checked_plain(body)
    kind = equation_boundary(boundary)
    k = checked(wavenumber, 2, body)
    middle = _center(body, center)
    highest = None if order is None else whole_number(order, "order")

    def made(T: ComplexArray, extinction: float) -> TMatrix:
        return TMatrix(
            matrix=T,
            wavenumber=k,
            center=middle,
            boundary=boundary_name(boundary),
            vector=kind.kind == "conductor",
            body=" ".join(repr(body).split()),
            extinction=extinction,
            absorbing=kind.kind == "impedance",
            unit=unit_of(body),
        )

    with telling(progress) as tell:
        if store is None:
            return made(*_computed(body, k, kind, middle, highest, seconds, tell, not_kept))
        if kind.varies:
            raise InvalidInputError("a store cannot identify an admittance that varies; leave out store=")
        key = {"body": fingerprint(body), "wavenumber": k, "boundary": boundary_name(boundary), "order": highest}
        parts = Parts(folder_path(store, "store"), key | {"center": middle.tolist(), "version": __version__})

        def whole() -> Arrays:
            T, extinction = _computed(body, k, kind, middle, highest, seconds, tell, parts)
            return {"matrix": T, "extinction": np.array([extinction])}

        found = parts(RESULT, whole)
        parts.forget(but=RESULT)
        return made(np.array(found["matrix"]), float(found["extinction"][0]))


def _computed(
    body: Surface,
    k: float,
    kind: Boundary,
    middle: FloatArray,
    order: int | None,
    seconds: float,
    tell: Callable[[str], None],
    keep: Keeping,
) -> tuple[ComplexArray, float]:
    """The matrix, and what is left of plane waves inside the body."""
    within_budget(_least_bytes(body, k, kind, order), f"the T-matrix at wavenumber {k:g}", LOWER)
    tiles = body_tiles(body, FINER * k, kind)
    radius = float(np.max(np.linalg.norm(tiles.points - middle, axis=1)))
    degree = order_for(k * radius) if order is None else order
    matrix = Matrix(tiles, k, kind)
    mirrors = mirrors_of(tiles, kind, middle)
    plan = plan_for(load_on(tiles, FINER * k, kind), kind, degree, len(mirrors.images))
    what = f"the T-matrix of order {degree} at wavenumber {k:g} by {len(tiles.points)} nodes"
    _refuse(plan, what, seconds)
    tell(f"{what}: about {plan.seconds:.2g} s and {plan.memory / 1e9:.2g} GB")
    # what it was begun with, whatever memory is free now
    direct = bool(keep("plan", lambda: {"direct": np.array([plan.direct])})["direct"][0])
    planes = mirrors if direct else no_mirrors(len(matrix.root), matrix.columns)
    solved = SolvedWaves(matrix, middle, degree, planes, tell, direct=direct, keep=keep)
    tell("what is left inside")
    return solved.T, solved.extinction(inside_points(body, tiles, 2 * np.pi / k))


def order_for(size: float, digits: float = DIGITS) -> int:
    """Highest degree of waves for a body of kR = ``size``.

    Examples
    --------
    >>> [order_for(size) for size in (1e-3, 5.0, 30.0)]
    [3, 11, 40]
    """
    return max(LEAST, int(np.ceil(size + 1.8 * digits ** (2 / 3) * np.cbrt(size))))


class Plan(NamedTuple):
    """Seconds and bytes that a T-matrix takes, about, and whether by factors of the whole matrix."""

    seconds: float
    memory: float
    direct: bool


def plan_for(load: Load, kind: Boundary, order: int, parts: int = 1) -> Plan:
    """Cost of a T-matrix from the load of the equation; ``parts`` of the body are images of each other."""
    nodes, c = load.nodes, 2 if kind.kind == "conductor" else 1
    n, waves = float(c * nodes), float(vector_count(order) if c == 2 else count(order))
    # values of all waves, waves at the nodes of a part, and the matrix itself
    tables = 8 * n * waves + WAVE_BYTES * n * waves / parts + 64 * waves**2 + 2e4 * n
    memory = 8 * n**2 / parts + tables
    if memory <= DENSE * budget():
        own, each = n / parts, waves / parts
        solved = 8 / 3 * own**3 + 8 * own**2 * each + 8 * own * each**2
        added = 2 * n**2 / parts * (2 + np.log2(parts)) * PER_SUM
        made = (pair_seconds(nodes, kind) + load.near) / parts
        return Plan(made + (parts * solved / RATE + added) / thread_count(), memory, True)
    memory = max(load.memory, WAVE_BYTES * n * waves + 2e4 * n)
    return Plan(load.seconds + PRODUCTS * waves * load.product, memory, False)


def expected(body: Surface, wavenumber: float, boundary: BoundaryLike) -> Plan:
    """What the T-matrix of a body takes, by the nodes that its equation has."""
    kind = equation_boundary(boundary)
    if (least := _least_bytes(body, wavenumber, kind, None)) > budget():
        return Plan(np.inf, least, False)
    load = load_of(body, FINER * wavenumber, kind)
    return plan_for(load, kind, order_for(wavenumber * _radius(body)), load.parts)


def _radius(body: Surface) -> float:
    """Half the diagonal of the body's box, L."""
    return 0.5 * float(np.linalg.norm(np.ptp(np.asarray(body.bounds, dtype=float), axis=0)))


def _least_bytes(body: Surface, wavenumber: float, kind: Boundary, order: int | None) -> float:
    """Bytes of all waves at the fewest nodes, known before there are tiles; mirrors part a body into eight at most."""
    degree = order_for(wavenumber * _radius(body)) if order is None else order
    waves = 2 * vector_count(degree) if kind.kind == "conductor" else count(degree)
    return (8 + WAVE_BYTES / 8) * waves * fewest_nodes(body, FINER * wavenumber)


def refuse(body: Surface, wavenumber: float, boundary: BoundaryLike, order: int | None, seconds: float) -> None:
    """Refuse a T-matrix that takes too much by `expected`, before those of lower wavenumbers are computed."""
    if order is None:
        _refuse(expected(body, wavenumber, boundary), f"the T-matrix at wavenumber {wavenumber:g}", seconds)


def _refuse(plan: Plan, what: str, seconds: float) -> None:
    within_budget(plan.memory, what, LOWER)
    if plan.seconds > seconds:
        raise InvalidInputError(
            f"{what} takes about {plan.seconds:.2g} s, more than the {seconds:g} s that it may take; give seconds=, "
            "or a lower wavenumber; for few incidences use creeping.solve or rays"
        )


def pays(body: Surface, wavenumbers: FloatArray, boundary: BoundaryLike, incidences: int) -> bool:
    """Whether T-matrices take less time than the equations of ``incidences``, if these are not refused."""
    left = 0.0
    for k in wavenumbers.tolist():
        equation, plan = plan_of(body, k, boundary, incidences=incidences), expected(body, k, boundary)
        if equation.refused or not (plan.memory <= budget() and plan.seconds < SECONDS):
            return False
        left += equation.seconds - plan.seconds
    return left > 0


def known_t_matrix(body: Surface, wavenumber: float, boundary: BoundaryLike) -> TMatrix | None:
    """The T-matrix of a body that `kept_t_matrix` has made, if it is still there."""
    known: dict[Any, TMatrix] = memo(body, "T-matrices", dict)
    return known.get((wavenumber, boundary))


def kept_t_matrix(body: Surface, wavenumber: float, boundary: BoundaryLike, store: Path | None = None) -> TMatrix:
    """The T-matrix of a body, cached while there is room for it."""
    known: dict[Any, TMatrix] = memo(body, "T-matrices", dict)
    key = wavenumber, boundary
    if key not in known:
        made = t_matrix(body, wavenumber=wavenumber, boundary=boundary, store=store)
        while known and sum(one.matrix.nbytes for one in (made, *known.values())) > KEPT * budget():
            known.pop(next(iter(known)))
        known[key] = made
    return known[key]


def _center(body: Surface, center: ArrayLike | None) -> FloatArray:
    if center is None:
        return np.asarray(np.mean(np.asarray(body.bounds, dtype=float), axis=0))
    given = real_array(center, "center")
    if given.shape != (3,) or not np.all(np.isfinite(given)):
        raise InvalidInputError(f"center = {shown(center)} is not three numbers; give three finite numbers")
    return given
