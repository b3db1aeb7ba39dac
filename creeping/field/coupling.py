"""The field at each of many ports on a hard body of a unit point source at each other: all geodesics between them.

    u_ij = sum over geodesics of the waves of `creeping.field.port_waves`, or beams where these merge

Error of an entry, where what second order leaves out is of order 1/m^4, with r, B and T of `creeping.field.port_waves`:

    error^2 = (sum |u| [(A/m^4)^2 + (C xi/m^4)^2 (D + (r - 1)^2 + (B/2)^2 + rho^4 T^4) + (k ds)^2]^(1/2))^2
            + (sum_pairs P (|u_i| + |u_j|)/(k |s_i - s_j|))^2 + lost^2

P is over pairs of waves of which one has touched a caustic that the other has not; lost is what geodesics beyond the end
of the fans, and those that have ended where kappa_n <= 0, would bring by the decay of the first mode.

Sources: [PW81], [P82]; Derivations, F25. The factors were set on a sphere and on the ellipsoid (1, 0.8, 0.6).
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from typing import Final, Literal

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import BoundaryLike, boundary_name, scalar_boundaries
from creeping.field.coupling_result import Coupling
from creeping.field.point_result import FieldStatus
from creeping.field.port_beams import PortBeams, beam_width
from creeping.field.port_waves import PathTerms, path_terms, port_waves
from creeping.field.ray_sums import LOST, MERGING, NARROW
from creeping.field.special.airy import hard_modes
from creeping.geodesics.bundle import as_points, on_body
from creeping.geodesics.equations import points_of_charts
from creeping.geometry.arguments import checked_body, positive_number
from creeping.geometry.curvature import curvature_norms
from creeping.geometry.surface import Surface, normal, size
from creeping.geometry.unit import unit_of
from creeping.rays.port_rays import PortRays, rays_between
from creeping.rays.reach import AUTO

FLOOR, GROWING, ROUND = 0.2, 0.4, 0.1
"""A, C and D; on a sphere third order is known, and D is more than it needs."""
SUMMED = 0.3
"""Error of beams, over m^2, as a share of their sum: on spheres a tenth of it."""
COARSER = 0.02
"""Error of polynomials of degree 5, in that of degree 3."""
MERGED, FOLDED = 0.03, 0.1
"""Shares of the waves from which merging of geodesics at a port, and close to it, asks for beams."""
DECAY, GIRTHS = 13.0, (0.65, 1.2)
"""Exponent by which the wave falls along geodesics of length "auto", and bounds of that in girths of the body."""
CLOSEST = 1e-6
"""Least distance of ports, in body sizes."""
NEAR = 2.0
"""How far from a caustic a port is close to it, in terms of (a/k^2)^(1/3)."""
CUTS = (4.0, 6.0, 2.5)
"""Where beams begin, in their widths, that which is farthest from the ends of geodesics;"""
APART = 1.2
"""no geodesic may end within so many widths of it."""
UNRESOLVED = 0.5
"""Error, as a share of the value, from which an entry is unresolved."""
NEVER: Final = np.inf


def coupling(
    body: Surface,
    ports: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "hard",
    order: int = 2,
    length: float | Literal["auto"] = AUTO,
) -> Coupling:
    """Fields between ports on a hard body: u at each of them of a unit point source e^{ikr}/(4 pi r) at each other.

    Parameters
    ----------
    body : Surface
        Smooth and plain.
    ports : (n, 3), L
        On the body, two or more.
    wavenumber : float, 1/L
    boundary : "hard"
        On a soft body the field is 0; that of an impedance is not known here.
    order : 2 or 1
    length : float or "auto", L
        Up to which geodesics are followed; "auto" is where the wave has died away, and at least long enough for both
        ways round to meet.

    Returns
    -------
    Coupling
        A matrix (n, n), 1/L, that acts as an array, with errors, statuses, and the geodesics of each pair. Trouble of a
        pair is a status: CAUSTIC where geodesics merge and beams do not serve, DETACHED where one that mattered has come
        to where kappa_n <= 0, NO_RAY and TRUNCATED where none comes.

    Raises
    ------
    InvalidInputError
        On ports off the body, or two in one place, a bad wavenumber, boundary, order or length, and for a weighted body
        or one with edges.
    SurfaceError
        If geodesics cannot be traced on the body.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> angle = np.radians([0, 40, 80])
    >>> ports = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    >>> u = cr.coupling(sc.Sphere(), ports, wavenumber=30.0)
    >>> np.abs(u[0, 1:]).round(4).tolist(), bool(np.all(u[0, 1:] == u[1:, 0]))
    ([0.1106, 0.0271], True)
    """
    checked_body(body)
    checked_plain(body, smooth="the coupling of ports")
    k = checked(wavenumber, order)
    if scalar_boundaries(boundary)[0].kind != "hard" or boundary == "pec":
        raise InvalidInputError(
            f"boundary = {boundary_name(boundary)!r}: coupling is known on hard bodies only; give 'hard'"
        )
    y = _checked_ports(body, ports)
    far = _length(body, k) if isinstance(length, str) and length == AUTO else positive_number(length, "length")
    rays = rays_between(body, y, far, pad=NEAR * np.cbrt(size(body) / k**2))
    terms = path_terms(rays, k)
    waves, other = (port_waves(rays, terms, k, o) for o in (order, 3 - order))
    return _assembled(rays, terms, waves, other, k, boundary, order)


def _checked_ports(body: Surface, ports: ArrayLike) -> FloatArray:
    """Ports (n, 3) on the body, apart from each other."""
    given = as_points(ports)
    if given.ndim != 2 or len(given) < 2:
        raise InvalidInputError(f"ports have shape {given.shape}; give two or more as (n, 3)")
    y = on_body(body, given)
    from scipy.spatial import cKDTree

    close = cKDTree(y).query_pairs(CLOSEST * size(body), output_type="ndarray")
    if len(close):
        raise InvalidInputError(
            f"{len(close)} pairs of ports are in one place (first: {close[0, 0]} and {close[0, 1]}); give each once"
        )
    return y


def _length(body: Surface, k: float) -> float:
    """Length of geodesics by the decay of the first mode at the root mean square curvature, L."""
    box = np.asarray(body.bounds, dtype=float)
    girth = np.pi * float(np.max(box[1] - box[0]))
    typical = float(np.median(curvature_norms(body, points_of_charts(body)))) / np.sqrt(2)
    decay = float(hard_modes().tau[0].imag) * np.cbrt(k / 2) * np.cbrt(typical) ** 2
    return float(np.clip(DECAY / decay, GIRTHS[0] * girth, GIRTHS[1] * girth))


def _assembled(
    rays: PortRays,
    terms: PathTerms,
    waves: ComplexArray,
    other: ComplexArray,
    k: float,
    boundary: BoundaryLike,
    order: int,
) -> Coupling:
    """The matrix, judged."""
    n = len(rays.ports)
    pair = rays.first * n + rays.second
    size_of = np.abs(waves)
    own = _own_error(rays, terms, waves, other, k, order)
    merging = _merging(pair, rays, size_of, k, n * n)
    lost, ended = _lost(rays, k)
    with np.errstate(invalid="ignore"):
        values = _sums(pair, waves, n * n)
        strength, error = (np.bincount(pair, one, n * n) for one in (size_of, own))
        folds = _first_mode(rays, rays.folds.ravel(), k)
        merges = (merging > MERGED * strength) | (folds > FOLDED * strength)
        narrow = _narrow(rays, k)
        merges[pair[narrow]] = True
        error = np.sqrt(error**2 + merging**2 + lost**2 + ended**2)
    method = np.full(n * n, "rays", dtype="<U5")
    status = np.full(n * n, int(FieldStatus.OK), dtype=np.int64)
    status[merges] = FieldStatus.CAUSTIC
    # waves of a focus are (ka)^(1/2) times those of a ray
    bound = strength + folds * np.sqrt(k * size(rays.body))
    error = np.where(merges, np.maximum(error, bound), error)
    upper = np.triu(np.ones((n, n), dtype=bool), 1).ravel()
    _put_beams(rays, terms, waves, own, k, order, np.flatnonzero(merges & upper), values, error, status, method)
    # what beams have brought, or rays: nothing that is known
    strength = np.where(method == "beams", np.abs(values), strength)
    none = strength == 0
    status[none] = np.where(ended[none] > 0, FieldStatus.DETACHED, FieldStatus.NO_RAY)
    fine = status == FieldStatus.OK
    status[fine & (lost > LOST * strength)] = FieldStatus.TRUNCATED
    status[fine & (ended > LOST * strength)] = FieldStatus.DETACHED
    fine = status == FieldStatus.OK
    with np.errstate(invalid="ignore"):
        status[fine & ~(error <= UNRESOLVED * np.abs(values))] = FieldStatus.UNRESOLVED
    return _result(rays, waves, k, boundary, order, values, error, status, method)


def _result(
    rays: PortRays,
    waves: ComplexArray,
    k: float,
    boundary: BoundaryLike,
    order: int,
    values: ComplexArray,
    error: FloatArray,
    status: IntArray,
    method: np.ndarray[tuple[int, ...], np.dtype[np.str_]],
) -> Coupling:
    n = len(rays.ports)

    def square(upper: np.ndarray, diagonal: object) -> np.ndarray:  # type: ignore[type-arg]
        whole = upper.reshape(n, n)
        out = np.where(np.triu(np.ones((n, n), dtype=bool)), whole, whole.T)
        np.fill_diagonal(out, diagonal)
        return out

    return Coupling(
        body=rays.body,
        ports=rays.ports,
        normals=rays.normals,
        values=square(values, np.inf),
        error=square(error, np.inf),
        status=square(status, int(FieldStatus.CAUSTIC)),
        method=square(method, "none"),
        wavenumber=k,
        boundary=boundary_name(boundary),
        order=order,
        length=rays.length,
        length_unit=unit_of(rays.body),
        _rays=rays,
        _waves=waves,
    )


def _sums(pair: IntArray, waves: ComplexArray, count: int) -> ComplexArray:
    return np.asarray(np.bincount(pair, waves.real, count) + 1j * np.bincount(pair, waves.imag, count))


def _own_error(
    rays: PortRays, terms: PathTerms, waves: ComplexArray, other: ComplexArray, k: float, order: int
) -> FloatArray:
    """Error of each wave by itself (m,), 1/L."""
    strength = np.abs(waves)
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.abs(waves - other)
        bend, lean = np.mean(rays.bend, axis=1), np.mean((rays.torsion / rays.curvature) ** 2, axis=1)
        # r of the whole path, from its second exponent
        r = 4 * (terms.H / terms.xi * terms.square - 0.1 + bend / 60 + 0.15 * lean)
        growing = GROWING * terms.xi * np.sqrt(ROUND + (r - 1) ** 2 + (bend / 2) ** 2 + lean**2)
        parts = (FLOOR / terms.square**2, growing / terms.square**2, COARSER * k * rays.error)
        total = np.sqrt(sum(part**2 for part in parts))
    out = strength * np.minimum(total, 1.0) + (change if order == 1 else 0.0)
    return np.asarray(np.where(np.isfinite(strength), out, 0.0))


def _narrow(rays: PortRays, k: float) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Whether each geodesic (m,) ends on its caustic."""
    rho = np.cbrt(np.prod(1 / np.maximum(rays.curvature, 1e-300), axis=1) * rays.arclength)
    share = np.abs(rays.spreading) / (np.abs(rays.spreading) + rho * np.mean(np.abs(rays.rates), axis=1))
    m = np.cbrt(k * np.sqrt(np.prod(1 / rays.curvature, axis=1)) / 2)
    return np.asarray((share * m < NARROW) & (rays.arclength > 0.25 * size(rays.body)))


def _merging(pair: IntArray, rays: PortRays, strength: FloatArray, k: float, count: int) -> FloatArray:
    """Error of waves of one pair that have an odd number of caustics between them (count,)."""
    out = np.zeros(count)
    apart = 1
    while apart < len(pair):
        first = np.flatnonzero(pair[apart:] == pair[:-apart])
        if not len(first):
            break
        first = first[(rays.caustics[first] + rays.caustics[first + apart]) % 2 == 1]
        other = first + apart
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.minimum(MERGING / (k * np.abs(rays.arclength[first] - rays.arclength[other])), 1.0)
            np.add.at(out, pair[first], share * (strength[first] + strength[other]))
        apart += 1
    return out


def _first_mode(rays: PortRays, A: FloatArray, k: float) -> FloatArray:
    """About the wave of the first mode where int kappa_n^(2/3) ds is A (count,), 1/L; 0 where it is infinite."""
    tau, root = hard_modes().tau[0], np.cbrt(k / 2)
    typical = float(np.median(rays.curvature)) if len(rays) else 1 / size(rays.body)
    scale = np.cbrt(typical) * np.sqrt(root / (np.pi * size(rays.body))) / (2 * abs(tau))
    return np.asarray(scale * np.exp(-tau.imag * root * A))


def _lost(rays: PortRays, k: float) -> tuple[FloatArray, FloatArray]:
    """What geodesics beyond the fans' length, and ended ones, would bring (n n,), twice, 1/L."""
    n = len(rays.ports)
    with np.errstate(divide="ignore", invalid="ignore"):
        slow = float(np.min(rays.integrals[:, 0] / rays.arclength, initial=np.inf)) if len(rays) else 0.0
    longer = _first_mode(rays, np.full(n * n, rays.length * (slow if np.isfinite(slow) else 0.0)), k)
    return longer, _first_mode(rays, rays.ended.ravel(), k)


def _put_beams(
    rays: PortRays,
    terms: PathTerms,
    waves: ComplexArray,
    own: FloatArray,
    k: float,
    order: int,
    asked: IntArray,
    values: ComplexArray,
    error: FloatArray,
    status: IntArray,
    method: np.ndarray[tuple[int, ...], np.dtype[np.str_]],
) -> None:
    """Beams in place of rays for the pairs asked for (numbers i n + j), where these can be told from young rays."""
    n = len(rays.ports)
    pair = rays.first * n + rays.second
    width = beam_width(rays.body, k)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.nan_to_num(own / np.abs(waves), nan=0.0)
    for number in np.unique(asked // n):
        mine = asked[asked // n == number]
        cuts = np.array([_best_cut(rays.arclength[slice(*np.searchsorted(pair, [one, one + 1]))], width) for one in mine])
        mine, cuts = mine[cuts > 0], cuts[cuts > 0]
        if not len(mine):
            continue
        # at a focus no ray is singled out
        from_here = share[np.searchsorted(pair, number * n) : np.searchsorted(pair, number * n + n)]
        small = float(np.median(1 / terms.square))
        usual = float(np.quantile(from_here, 0.9)) if len(from_here) else 1.0
        beams = PortBeams(rays.body, rays.ports[number], rays.normals[number], rays.length, k, order)
        for cut in np.unique(cuts):
            some = mine[cuts == cut]
            one, two = beams.sums(rays.ports[some % n], cut)
            for entry, value, again in zip(some, one, two, strict=True):
                members = np.arange(*np.searchsorted(pair, [entry, entry + 1]))
                young = members[rays.arclength[members] < cut]
                late = np.setdiff1d(members, young)
                known = np.sum(waves[young])
                other = np.max(share[late]) if len(late) else usual
                off = np.abs(value - again) + np.abs(value) * np.hypot(other, SUMMED * small)
                off = np.hypot(off, np.sum(own[young]))
                if off < error[entry]:
                    values[entry], error[entry] = known + value, off
                    status[entry], method[entry] = FieldStatus.OK, "beams"


def _best_cut(arclength: FloatArray, width: float) -> float:
    """Where beams begin so that no geodesic ends close by, L; 0 if there is no such place."""
    for cut in CUTS:
        if not len(arclength) or np.min(np.abs(arclength - cut * width)) > APART * width:
            return cut * width
    return 0.0
