"""The wave on the body where its rays merge: Gaussian beams along all rays of a fan, on every caustic finite.

    u(x) = sum over rays dsigma_perp (k_c eps/2 pi)^(1/2) q^(-1/2) y e^{ik[d.x0 + s] + (i/2) k_c (q'/q) n^2}
    q = J + i eps J2,   J2'' + K J2 = 0,   J2(0) = 0,   J2'(0) = 1,   k_c = k - i y_s/y

(s, n) are the foot of x on the ray and its distance from there, and arg q runs on from 0, which is the index of the
caustics. By stationary phase each ray that passes through x has its own wave of `creeping.field.marching.fan_waves`; on
caustics, folds, cusps and points alike, the sum stays right. k_c, the wavenumber along the surface, is by a factor of
1 + tau/(2 m^2) more than k for a mode: without it the focus behind a sphere of ka = 30 is off by 6 %, with it by 0.6 %.

eps = WIDTH/a is free; what it changes is an error. Beams are cut off at the shadow line, so that they serve no points
within 2 of their widths w = (a/(WIDTH k))^(1/2) of it: there rays have not merged yet, and each that has come less far
than 4 w stands by itself, others by beams.

Sources: [P82], [CPP82]; Derivations, F24.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.integrate import cumulative_trapezoid

from creeping._typing import ComplexArray, FloatArray
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.pieces import trace_pieces
from creeping.geodesics.states import M11, M12, M21, M22, P, X, pack
from creeping.geometry.creased import is_creased
from creeping.geometry.quadrature import BodyNodes, nodes_at
from creeping.geometry.surface import normal, project, size
from creeping.kernels.threads import in_threads
from creeping.rays.fan import RayFan
from creeping.rays.strips import Strip

WIDTH = 2.5
"""Eps a."""
DENSE, STEPS = 6.0, 8.0
"""Beams a wavelength along the line, and steps a wavelength along them."""
FEWEST = 64
"""Beams of a strip, and steps, at least."""
REACH = 0.9
"""How far a beam reaches, in terms of a."""
CUT, YOUNG = 4.0, (2.0, 3.0)
"""Where beams are cut off that of a ray, and up to where rays stand by themselves, in widths w."""
RTOL = 1e-9
SECONDS, MAKING = 2e-8, 3e-6
"""Of a beam's block of steps at one point, and of making one step."""
AT_ONCE = 200_000
"""Steps of beams that are held at once: 60 MB."""
MOST_TURNED = 0.5
"""Bound of |k_c/k - 1|."""


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


@dataclass(frozen=True, eq=False)
class BeamSums:
    """Sums of beams at points (n,), by feet within CUT widths of the line and beyond.

    Attributes
    ----------
    early, late : (n,) complex, (n, c) of a vector
    """

    early: ComplexArray
    late: ComplexArray


def length_scale(fan: RayFan) -> float:
    """A, L: the radius of a ball of the body's size."""
    return float(size(fan.body) / np.sqrt(3))


def width(fan: RayFan, wavenumber: float) -> float:
    """Width w of beams at the shadow line, L."""
    return float(np.sqrt(length_scale(fan) / (WIDTH * wavenumber)))


def _counts(strip: Strip, length: float, wavenumber: float) -> tuple[int, int]:
    """Beams of a strip, and steps along them."""
    low, high = strip.span
    per = wavenumber / (2 * np.pi)
    return max(FEWEST, int(np.ceil(DENSE * (high - low) * per))), max(FEWEST, int(np.ceil(STEPS * length * per)))


def seconds(fan: RayFan, strips: tuple[Strip, ...], wavenumber: float, count: int) -> float:
    """About how long beams take at so many points."""
    sizes = [_counts(strip, fan.length, wavenumber) for strip in strips]
    summing = SECONDS * count * sum(beams * (1 + steps / 16) for beams, steps in sizes)
    return 2 * (summing + MAKING * sum(beams * steps for beams, steps in sizes))


def beam_sums(
    fan: RayFan,
    waves: StripWaves,
    points: FloatArray,
    factors: tuple[float, ...] = (1.0,),
    components: Components | None = None,
) -> list[BeamSums]:
    """Beams of each eps = factor WIDTH/a at points of the body (n, 3), L; those of a vector have ``components``."""
    sums: list[list[ComplexArray]] = [[] for _ in factors]
    for number, strip in enumerate(waves.strips):
        (low, high), (count, steps) = strip.span, _counts(strip, fan.length, waves.wavenumber)
        sigma = low + (high - low) * (np.arange(count) + 0.5) / count
        times = np.linspace(0.0, fan.length, steps + 1)
        some = max(1, AT_ONCE // len(times))
        for first in range(0, count, some):
            beams = _Beams(fan, waves, number, sigma[first : first + some], (high - low) / count, times, components)
            for mine, factor in zip(sums, factors, strict=True):
                mine.append(beams.at(points, WIDTH / beams.a * factor))
    both = [np.sum(mine, axis=0) if mine else np.zeros((2, len(points), 1), dtype=complex) for mine in sums]
    return [BeamSums(*(one[..., 0] if components is None else one)) for one in both]


class _Beams:
    """Beams of places sigma (m,) of a strip, ``apart`` from each other, in steps between ``times`` (steps,)."""

    def __init__(
        self,
        fan: RayFan,
        waves: StripWaves,
        number: int,
        sigma: FloatArray,
        apart: float,
        times: FloatArray,
        components: Components | None,
    ) -> None:
        from creeping.field.kernels.beams import SPAN, spans_of

        body, count = fan.body, len(sigma)
        self.k, self.a = waves.wavenumber, length_scale(fan)
        first = waves.strips[number].at(sigma, np.zeros(count))
        launched = pack(project(body, first.points), first.directions, jacobi=True)
        ended = np.zeros((count, len(times)), dtype=bool)
        if is_creased(body):
            trace = trace_pieces(body, launched, times, rtol=RTOL)
            self.states, ended = trace.states, trace.end[:, None] <= times
        else:
            self.states = trace_states(body, launched, times, rtol=RTOL)
        x, p = (np.ascontiguousarray(self.states[..., part]) for part in (X, P))
        flat = x.reshape(-1, 3)
        nodes = nodes_at(body, flat, normal(body, flat))
        b = np.cross(nodes.normals, p.reshape(-1, 3))
        rows, columns = (part.ravel() for part in np.meshgrid(sigma, times, indexing="ij"))
        y, slope = (part(number, rows, columns).reshape(count, -1) for part in (waves.at, waves.slope))
        with np.errstate(divide="ignore", invalid="ignore"):
            turned = np.nan_to_num(-1j * slope / (self.k * y))
        turned /= np.maximum(1.0, np.abs(turned) / MOST_TURNED)
        # what varies across beams their sum brings in itself
        known = (waves.lean(number, rows, columns).reshape(count, -1) * turned) ** 2
        known = 0.5j * self.k * cumulative_trapezoid(known, times, axis=1, initial=0)
        self.turned = 1 + turned
        self.weight = apart * np.abs(first.width)
        # a ray that has come to a tip ends there
        strength = np.where(ended, 0.0, np.abs(y))
        self.size = np.log(np.maximum(strength, 1e-300)) + 0.5 * np.log(np.abs(self.turned)) + known.real
        self.phase = np.unwrap(np.angle(y), axis=1) + 0.5 * np.angle(self.turned) + known.imag
        S = first.eikonal[:, None] + times
        self.rays = (x, p, b.reshape(x.shape), nodes.curvature(b).reshape(S.shape), S)
        spans = -(-(len(times) - 1) // SPAN)
        self.balls = np.empty((count, spans, 3)), np.empty((count, spans))
        spans_of(x, *self.balls)
        self.cut = int(np.searchsorted(times, CUT * width(fan, self.k)))

        self.V, self.lean = np.ones((1, 1, 1), dtype=complex), np.zeros((1, 1, 1), dtype=complex)
        if components is not None:
            found = components(number, rows, columns, nodes, p.reshape(-1, 3))
            self.V, self.lean = (np.ascontiguousarray(part.reshape(*S.shape, -1), dtype=complex) for part in found)

    def at(self, points: FloatArray, eps: float) -> ComplexArray:
        """Sums of the beams of ``eps``, 1/L, at points (n, 3), early and late ones: (2, n, c)."""
        from creeping.field.kernels.beams import add_beams

        q = self.states[..., M11] + 1j * eps * self.states[..., M12]
        rate = self.states[..., M21] + 1j * eps * self.states[..., M22]
        weight = np.sqrt(self.k * eps / (2 * np.pi)) * self.weight
        size = self.size - 0.5 * np.log(np.abs(q)) + np.log(weight)[:, None]
        phase = self.phase - 0.5 * np.unwrap(np.angle(q), axis=1)
        table = (*self.rays, size, phase, rate / q * self.turned, self.k, self.cut, REACH * self.a, *self.balls)
        out = np.zeros((2, len(points), self.V.shape[2]), dtype=complex)

        def work(part: slice) -> None:
            add_beams(points[part], *table, self.V, self.lean, out[0, part], out[1, part])

        in_threads(work, len(points), least=64, multiple=1, seconds=SECONDS * self.balls[1].size)
        return out
