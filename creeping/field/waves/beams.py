"""Gaussian beams along geodesics of a body, from a line or from a point: their sum is finite on every caustic.

    u(x) = sum over rays dsigma (k eps/2 pi)^(1/2) (k_c/k)^(1/2) q^(-1/2) y e^{ik S + (i/2) k_c (q'/q) n^2}
    from a line    q = J1 + i eps J2          from a point    q = J2 - i eps J1
    k_c = k - i y_s/y

S is the phase along a ray, (s, n) the foot of x on it and the distance from there, and J1, J2 are the Jacobi fields
J'' + K J = 0 with J1(0) = J2'(0) = 1, J1'(0) = J2(0) = 0. arg q is continuous along the ray, from 0 or -pi/2: it counts
the caustics. By stationary phase each ray that passes through x contributes its own wave, y |J|^(-1/2). eps is free, a
length from a point and its inverse from a line; what it changes is an error. A vector's beams have V + (k_c/k)
(q'/q) n V' for components.

Also here: the wave on the body where its rays merge: beams along all rays of a fan, and which of rays and beams to
take.

    u(x) = the sum from the line, S = d.x0 + s, dsigma across the line

k_c, the wavenumber along the surface, is by a factor of 1 + tau/(2 m^2) more than k for a mode: without it the focus
behind a sphere of ka = 30 is off by 6 %, with it by 0.6 %. Beams are cut off at the shadow line, so that they serve no
points within 2 of their widths w = (a/(WIDTH k))^(1/2) of it: there rays have not merged yet, and each that has come
less far than 4 w stands by itself, others by beams.

Of the rays through a point and the beams:

    u = (u_r e_b^2 + u_b e_r^2)/(e_r^2 + e_b^2)

u_r is the sum over the rays through the point, u_b that of beams. Both have the error of the wave itself; the rest of
it is, for rays that merge, e_r as of `creeping.field.waves.ray_sums`; for beams

    e_b^2 = sum min(|u_i|, 1.5 |y_i|)^2 (A + B eta)^2 + A^2 |u_b|^2 + C^2 |u_b - u_b'|^2
    eta = |d(log y)/dsigma_perp|^2/(2 k eps)

with u_b' by beams of another width: eta is what a beam that varies across itself errs by. What u_r and u_b differ by
beyond 2 e_b is added to e_r: on the dark side of a caustic rays know nothing of it.

Sources: [P82], [CPP82]; Derivations, F22, F24 and F25. A to C were set on the triaxial and the twisted ellipsoid.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.integrate import cumulative_trapezoid

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray
from creeping.field.boundary import Boundary
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.ray_sums import LOST, RaySum, fold_share, judged_sum, magnitude, merging_error, total_of
from creeping.field.waves.shed_wave import smoothstep
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.pieces import trace_pieces
from creeping.geodesics.states import M11, M12, M21, M22, P, X, pack
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.quadrature import BodyNodes, nodes_at
from creeping.geometry.surface import Surface, normal, project, size
from creeping.kernels.threads import in_threads
from creeping.rays.fan import RayFan
from creeping.rays.shedding import ShedRays
from creeping.rays.strips import Strip

WIDTH = 2.5
"""Eps/a from a point, eps a from a line: free (F24); what another one changes is part of the error, and within it
(``tests/field/test_port_beams.py``)."""
MOST_TURNED = 0.5
"""Bound of |k_c/k - 1|, which is tau/2m^2 of a mode (F24) and infinite where y is 0."""


def beam_length(body: Surface) -> float:
    """Length a, L: the radius of a ball of the body's size."""
    return float(size(body) / np.sqrt(3))


class GaussianBeams:
    """Beams along rays (m,), known at the same steps (steps,).

    Parameters
    ----------
    body : Surface
    wavenumber : float, 1/L
    states : (m, steps, 10)
        Of the rays, with their Jacobi matrix.
    sides : (m, steps, 3)
        b = n x p.
    curvature : (m, steps), 1/L
        Normal curvature along b.
    S : (m, steps), L
        Phase over k.
    logarithm, slope : (m, steps) complex, 1 and 1/L
        log y without jumps, and y_s/y.
    weight : (m,) or float
        dsigma of each ray: L across a line, radians at a point.
    known : (m, steps) complex, or 0
        Added to log y, without a part in k_c.
    """

    def __init__(
        self,
        body: Surface,
        wavenumber: float,
        states: FloatArray,
        sides: FloatArray,
        curvature: FloatArray,
        S: FloatArray,
        logarithm: ComplexArray,
        slope: ComplexArray,
        weight: FloatArray | float,
        known: ComplexArray | float = 0.0,
    ) -> None:
        from creeping.field.kernels.ray_profile import SPAN, spans_of

        self.k, self.a, self.states = wavenumber, beam_length(body), states
        turned = turned_by(slope, wavenumber)
        self.turned = 1 + turned
        strength = logarithm + known
        self.size = strength.real + 0.5 * np.log(np.abs(self.turned)) + np.log(np.reshape(weight, (-1, 1)))
        self.phase = strength.imag + 0.5 * np.angle(self.turned)
        x, p, b, bent, S = (np.ascontiguousarray(of) for of in (states[..., X], states[..., P], sides, curvature, S))
        self.rays = x, p, b, bent, S
        rays, steps = S.shape
        spans = -(-(steps - 1) // SPAN)
        self.balls = np.empty((rays, spans, 3)), np.empty((rays, spans))
        spans_of(x, *self.balls)
        self.V, self.lean = np.ones((1, 1, 1), dtype=complex), np.zeros((1, 1, 1), dtype=complex)

    def carry(self, V: ComplexArray, lean: ComplexArray) -> None:
        """Take V and V' (m, steps, c) for components."""
        self.V, self.lean = (np.ascontiguousarray(part, dtype=complex) for part in (V, lean))

    def sums(self, points: FloatArray, eps: float, cut: int, *, from_point: bool = False) -> ComplexArray:
        """Sums at points (n, 3), by feet before the step ``cut`` and behind it: (2, n, c)."""
        from creeping.field.kernels.ray_profile import add_beams

        one, other = (-1j * eps, 1.0) if from_point else (1.0, 1j * eps)
        q = one * self.states[..., M11] + other * self.states[..., M12]
        rate = one * self.states[..., M21] + other * self.states[..., M22]
        amplitude = self.size - 0.5 * np.log(np.abs(q)) + 0.5 * np.log(self.k * eps / (2 * np.pi))
        phase = self.phase - 0.5 * np.unwrap(np.angle(q), axis=1)
        # a beam reaches as far as (ka)^(1/2) of its widths, so that nothing is lost from ka = 10 on
        table = (*self.rays, amplitude, phase, rate / q * self.turned, self.k, cut, 0.9 * self.a, *self.balls)
        out = np.zeros((2, len(points), self.V.shape[2]), dtype=complex)

        def work(part: slice) -> None:
            add_beams(points[part], *table, self.V, self.lean, out[0, part], out[1, part])

        in_threads(work, len(points), least=64, multiple=1)
        return out


def turned_by(slope: ComplexArray, wavenumber: float) -> ComplexArray:
    """Bounded k_c/k - 1 of waves with y_s/y = slope, 1/L."""
    # where a wave vanishes its slope is infinite, and tells nothing
    turned = np.nan_to_num(-1j / wavenumber * np.where(np.isfinite(slope), slope, 0.0))
    return np.asarray(turned / np.maximum(1.0, np.abs(turned) / MOST_TURNED))


CUT = 4.0
"""Length of rays up to which they stand by themselves and beams count as early, in widths w."""
LEAST, VARIES, BROADER = 0.02, 0.5, 1.5
"""A, B and C."""
FACTORS = (1.3, 0.8)
"""Widths of the beams that serve, and of those by which they are judged."""


class StripWaves(Protocol):
    """Waves on the strips of a fan: y, its derivative y_s, and Lambda where y knows what it varies by across rays."""

    @property
    def strips(self) -> tuple[Strip, ...]: ...  # noqa: D102

    @property
    def wavenumber(self) -> float: ...  # noqa: D102

    def at(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray: ...  # noqa: D102

    def slope(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray: ...  # noqa: D102

    def lean(self, strip: int, sigma: FloatArray, s: FloatArray) -> FloatArray: ...  # noqa: D102


Components = Callable[[int, FloatArray, FloatArray, BodyNodes, FloatArray], tuple[ComplexArray, ComplexArray]]
"""V and V' (n, c) of a vector's beams at places sigma, s (n,) of a strip, points of the body and tangents (n, 3)."""


def width(fan: RayFan, wavenumber: float) -> float:
    """Width w of beams at the shadow line, L."""
    return float(np.sqrt(beam_length(fan.body) / (WIDTH * wavenumber)))


def _counts(strip: Strip, length: float, wavenumber: float) -> tuple[int, int]:
    """Beams of a strip, six a wavelength, and steps along them, eight."""
    low, high = strip.span
    per = wavenumber / (2 * np.pi)
    return max(64, int(np.ceil(6 * (high - low) * per))), max(64, int(np.ceil(8 * length * per)))


def seconds(fan: RayFan, strips: tuple[Strip, ...], wavenumber: float, count: int) -> float:
    """Time of beams at ``count`` points, s, about."""
    sizes = [_counts(strip, fan.length, wavenumber) for strip in strips]
    # 20 ns for a block of a beam's steps at one point, 3 us to make a step
    summing = 2e-8 * count * sum(beams * (1 + steps / 16) for beams, steps in sizes)
    return 2 * (summing + 3e-6 * sum(beams * steps for beams, steps in sizes))


def beam_sums(
    fan: RayFan,
    waves: StripWaves,
    points: FloatArray,
    factors: tuple[float, ...],
    components: Components | None,
) -> list[ComplexArray]:
    """Beams of each eps = factor WIDTH/a at points of the body (n, 3), L; those of a vector have ``components``.

    Sums (2, n) or (2, n, c) by feet within CUT widths of the line and beyond.
    """
    sums: list[list[ComplexArray]] = [[] for _ in factors]
    for number, strip in enumerate(waves.strips):
        (low, high), (count, steps) = strip.span, _counts(strip, fan.length, waves.wavenumber)
        sigma = low + (high - low) * (np.arange(count) + 0.5) / count
        times = np.linspace(0.0, fan.length, steps + 1)
        # 60 MB are held at once
        some = max(1, 200_000 // len(times))
        cut = int(np.searchsorted(times, CUT * width(fan, waves.wavenumber)))
        for first in range(0, count, some):
            beams = _beams_of(fan, waves, number, sigma[first : first + some], (high - low) / count, times, components)
            for mine, factor in zip(sums, factors, strict=True):
                mine.append(beams.sums(points, WIDTH / beams.a * factor, cut))
    both = [np.sum(mine, axis=0) if mine else np.zeros((2, len(points), 1), dtype=complex) for mine in sums]
    return [one[..., 0] if components is None else one for one in both]


def _beams_of(
    fan: RayFan,
    waves: StripWaves,
    number: int,
    sigma: FloatArray,
    apart: float,
    times: FloatArray,
    components: Components | None,
) -> GaussianBeams:
    """Beams of places sigma (m,) of a strip, ``apart`` from each other, in steps between ``times`` (steps,)."""
    body, count, k = fan.body, len(sigma), waves.wavenumber
    first = waves.strips[number].at(sigma, np.zeros(count))
    launched = pack(project(body, first.points), first.directions, jacobi=True)
    ended = np.zeros((count, len(times)), dtype=bool)
    if is_piecewise(body):
        trace = trace_pieces(body, launched, times, rtol=1e-9)
        states, ended = trace.states, trace.end[:, None] <= times
    else:
        states = trace_states(body, launched, times, rtol=1e-9)
    flat, p = states[..., X].reshape(-1, 3), states[..., P].reshape(-1, 3)
    nodes = nodes_at(body, flat, normal(body, flat))
    b = np.cross(nodes.normals, p)
    rows, columns = (part.ravel() for part in np.meshgrid(sigma, times, indexing="ij"))
    y, slope = (part(number, rows, columns).reshape(count, -1) for part in (waves.at, waves.slope))
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = slope / y
    # a ray that has come to a tip ends there
    strength = np.where(ended, 0.0, np.abs(y))
    logarithm = np.log(np.maximum(strength, 1e-300)) + 1j * np.unwrap(np.angle(y), axis=1)
    # what varies across beams their sum brings in itself
    known = (waves.lean(number, rows, columns).reshape(count, -1) * turned_by(slope, k)) ** 2
    known = 0.5j * k * cumulative_trapezoid(known, times, axis=1, initial=0)
    shape, S = (count, len(times)), first.eikonal[:, None] + times
    bent = nodes.curvature(b).reshape(shape)
    weight = apart * np.abs(first.width)
    beams = GaussianBeams(body, k, states, b.reshape(*shape, 3), bent, S, logarithm, slope, weight, known)
    if components is not None:
        V, lean = components(number, rows, columns, nodes, p)
        beams.carry(V.reshape(*shape, -1), lean.reshape(*shape, -1))
    return beams


def variation(fan: RayFan, shed: ShedRays, y: ComplexArray, across: ComplexArray, wavenumber: float) -> FloatArray:
    """eta (m,) of waves y whose derivative in sigma is ``across`` (m,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        eta = (
            np.abs(across / (y * shed.rays.width)) ** 2 * beam_length(fan.body) / (2 * wavenumber * WIDTH * FACTORS[0])
        )
    return np.nan_to_num(eta, nan=0.0, posinf=1.0)


def beams_beside_rays(
    fan: RayFan,
    waves: StripWaves,
    shed: ShedRays,
    points: FloatArray,
    own: ComplexArray,
    share: FloatArray,
    components: Components | None,
) -> tuple[ComplexArray, ComplexArray]:
    """Sums of beams of both widths at points (n, 3), the waves ``own`` (m, ...) of young rays with them: (n, ...)."""
    near, clear = _apart_from_line(fan, shed, waves.wavenumber, len(points))
    alone = total_of(np.where(wide(near, own), own, 0.0), shed.observer, len(points))
    clear, share = wide(clear, alone), wide(share, alone)

    def together(sums: ComplexArray) -> ComplexArray:
        early, late = (one.reshape(alone.shape) for one in sums)
        return np.asarray(clear * (share * early + late) + (1 - clear) * (alone + late))

    by_beams, others = (together(sums) for sums in beam_sums(fan, waves, points, FACTORS, components))
    return by_beams, others


def blended_sum(
    fan: RayFan,
    shed: ShedRays,
    own: ComplexArray,
    strength: FloatArray,
    size: FloatArray,
    part: FloatArray,
    eta: FloatArray,
    beams: tuple[ComplexArray, ComplexArray],
    wavenumber: float,
    boundary: Boundary,
) -> RaySum:
    """Sum of the waves ``own`` (m, ...) of rays and of beams at points, both sums (n, ...).

    Where rays merge they err by shares of ``strength``, by themselves by shares of ``size`` (m,), which is bounded.
    ``part`` (m,) is the error of each wave as a share of it, 1 or more where there is none.
    """
    (by_beams, others), observer = beams, shed.observer
    count = len(by_beams)
    plain = np.zeros(count)
    by_rays = total_of(own, observer, count)
    e_b = np.sqrt(total_of((size * (LEAST + np.minimum(VARIES * eta, 1.0))) ** 2, observer, count))
    e_b = np.linalg.norm(
        [e_b, LEAST * magnitude(by_beams, plain), BROADER * magnitude(by_beams - others, plain)], axis=0
    )
    near = _apart_from_line(fan, shed, wavenumber, count)[0]
    bent = np.where(near, 0.0, np.minimum(fold_share(fan_strips(fan), shed, wavenumber), 1.0))
    e_r = np.sqrt(total_of(strength**2 * bent, observer, count) + merging_error(shed, strength, wavenumber, count) ** 2)
    e_r = np.sqrt(e_r**2 + np.maximum(0.0, magnitude(by_beams - by_rays, plain) ** 2 - (2 * e_b) ** 2))
    both = e_r**2 + e_b**2
    with np.errstate(invalid="ignore", divide="ignore"):
        beta = wide(np.where(both > 0, e_r**2 / both, 0.0), by_beams)
        # the error of merging
        rest = np.where(both > 0, e_r * e_b / np.sqrt(both), 0.0)
    values = np.asarray((1 - beta) * by_rays + beta * by_beams)
    bounded = np.where(np.isfinite(part), np.minimum(part, 1.0), 1.0)
    # at a focus more rays come than those that are found
    sums = total_of(size, observer, count)
    field = magnitude(values, sums)
    more = np.maximum(1.0, field / np.maximum(sums, 1e-300))
    # and at one where all rays of a fan come their number says how dense it is, and no more
    crowd = total_of(np.ones(len(size)), observer, count) > 8
    more = np.where(crowd, np.minimum(more, 2 * field / np.maximum(sums, 1e-300)), more)
    error = np.hypot(more * total_of(size * bounded, observer, count), rest)
    # a ray without a wave, or with one that errs by its size
    lacking = part >= 1
    unknown = total_of(np.where(lacking, size, 0.0), observer, count) > LOST * sums
    unknown[observer[lacking & (size == 0)]] = True
    return judged_sum(fan, shed, size, values, error, (unknown, np.zeros(count, bool)), wavenumber, boundary)


def wide(values: FloatArray | BoolArray | ComplexArray, like: ComplexArray) -> Any:
    """Values (n,) with as many axes as ``like`` (n, ...)."""
    return np.asarray(values).reshape(-1, *(1,) * (like.ndim - 1))


def _apart_from_line(fan: RayFan, shed: ShedRays, k: float, count: int) -> tuple[BoolArray, FloatArray]:
    """Which rays stand by themselves next to the line (m,), and how far points are from where beams are cut (n,)."""
    w = width(fan, k)
    near = shed.rays.time < CUT * w
    clear = np.ones(count)
    np.minimum.at(clear, shed.observer[near], smoothstep(shed.rays.time[near] / w, 2, 3))
    return near, clear
