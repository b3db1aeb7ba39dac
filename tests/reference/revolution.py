"""Scattering by bodies of revolution whose profile has joints and tips, by rings of sources that crowd under them.

Sources of the azimuth's order m stand on rings inside, q_j cos(m phi), and are fitted to each order of the plane wave
e^{ikd.x}, d = (sin theta, 0, cos theta), on its own, in least squares on the profile:

    G_m = (1/2 pi) int e^{ikR}/R cos(m phi) dphi,   u_s = sum_m cos(m phi) sum_j q_mj G_m(x, y_j)
    e^{ikd.x} = sum_m eps_m i^m J_m(k rho sin theta) e^{ikz cos theta} cos(m phi)
    f(r) = sum_m cos(m phi) (-i)^m sum_j q_mj J_m(k rho_j sin t) e^{-ik z_j cos t}

Where the profile is not analytic no ring at one depth serves: spacing and depth of the rings fall in proportion to the
distance from the place [GT19]. The residual of the condition, on points of its own, bounds the error, as in
`tests.reference.fundamental`.

Sources: [GT19] Gopal, Trefethen, PNAS 116, 10223 (2019).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import dct
from scipy.integrate import cumulative_simpson
from scipy.interpolate import CubicSpline
from scipy.special import jv

from tests.reference.clouds import Cloud
from tests.reference.conditions import Boundary, ComplexArray, FloatArray, condition, positive
from tests.reference.fundamental import least_squares

BLOCK = 1_500_000
"""Values of a kernel held at once."""
DEPTH = 3.0
"""Depth of a ring, in spacings of the rings there."""
CROWDED = 0.25
"""Spacing next to a joint or tip, over the distance from it."""
AXIS = 0.5
"""Depth of a ring at most, over its distance from the axis next to a tip."""
TIP = 0.02
"""Distance from a tip, in wavelengths, within which the condition is not asked for: nothing of that size radiates."""
DENSER = 2.2
"""Points at which the condition is imposed, over rings."""
DIGITS = 30.0
"""-ln of the error of the sum over the azimuth."""
SPLINED = 100_001
"""Places by which the arc length of a spheroid is kept: to 1e-12 of it."""
STRIPS = 2000
"""Of a body, whose areas are added."""


@dataclass(frozen=True)
class Profile:
    """Half of a section through the axis, from its upper end to its lower one.

    Parameters
    ----------
    at : callable
        Arc length (n,), L, to (rho, z) and the outward normal there, (n, 2) each.
    length : float, L
    joints, tips : tuple of float, L
        Arc lengths at which it is not analytic; tips are on the axis.
    radius : float, L
        Least radius of curvature.
    """

    at: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    length: float
    joints: tuple[float, ...]
    tips: tuple[float, ...]
    radius: float


def capsule_profile(radius: float, length: float) -> Profile:
    """Cylinder with hemispheres at its ends, of this length in all, about the origin."""
    positive(radius=radius, length=length)
    a, quarter, flat = radius, 0.5 * np.pi * radius, length - 2 * radius

    def at(s: FloatArray) -> tuple[FloatArray, FloatArray]:
        turn = np.where(s < quarter, s, np.maximum(s - flat, quarter)) / a
        n = np.stack([np.sin(turn), np.cos(turn)], axis=-1)
        middle = 0.5 * flat - np.clip(s - quarter, 0.0, flat)
        return a * n + np.stack([np.zeros_like(s), middle], axis=-1), n

    return Profile(at, 2 * quarter + flat, (quarter, quarter + flat), (), a)


def spheroid_profile(radius: float, half: float) -> Profile:
    """Spheroid of a radius and a half-axis along z, about the origin; its arc length is kept by a spline."""
    positive(radius=radius, half=half)
    t = np.linspace(0.0, np.pi, SPLINED)
    speed = np.hypot(radius * np.cos(t), half * np.sin(t))
    s = np.concatenate([[0.0], cumulative_simpson(speed, x=t)])
    angle = CubicSpline(s, t)

    def at(where: FloatArray) -> tuple[FloatArray, FloatArray]:
        turn = angle(where)
        n = np.stack([half * np.sin(turn), radius * np.cos(turn)], axis=-1)
        x = np.stack([radius * np.sin(turn), half * np.cos(turn)], axis=-1)
        return x, n / np.linalg.norm(n, axis=-1, keepdims=True)

    return Profile(at, float(s[-1]), (), (), min(radius**2 / half, half**2 / radius))


def cone_sphere_profile(radius: float, length: float) -> Profile:
    """Cone with its tip above, that touches a sphere about the origin, of this length in all."""
    positive(radius=radius, length=length)
    a, top = radius, length - radius
    half = np.arcsin(a / top)
    side = a / np.tan(half)

    def at(s: FloatArray) -> tuple[FloatArray, FloatArray]:
        turn = np.maximum(s - side, 0.0) / a + 0.5 * np.pi - half
        n = np.stack([np.sin(turn), np.cos(turn)], axis=-1)
        flat = np.minimum(s, side)
        cone = np.stack([flat * np.sin(half), top - flat * np.cos(half)], axis=-1)
        return np.where((s < side)[..., None], cone, a * n), n

    return Profile(at, side + a * (0.5 * np.pi + half), (side,), (0.0,), a)


@dataclass(frozen=True)
class Revolved:
    """Points spread evenly over the body of revolution of a profile, about z (`tests.reference.clouds.Spread`)."""

    profile: Profile
    mirrors: tuple[int, ...] = (0, 1)

    def area(self) -> float:
        """Area of the whole body, L²."""
        s = (np.arange(STRIPS) + 0.5) * self.profile.length / STRIPS
        return float(2 * np.pi * np.mean(self.profile.at(s)[0][:, 0]) * self.profile.length)

    def spread(self, spacing: float) -> Cloud:
        """Points a spacing h apart, L, on the sides x_i > 0 of both mirrors."""
        bands = max(1, round(self.profile.length / spacing))
        sides = self.profile.at((np.arange(bands) + 0.5) * self.profile.length / bands)
        points, normals = [], []
        for (rho, z), (outward, up) in zip(*sides, strict=True):
            count = max(1, round(0.5 * np.pi * rho / spacing))
            psi = (np.arange(count) + 0.5) * 0.5 * np.pi / count
            around = np.stack([np.cos(psi), np.sin(psi), 0 * psi], axis=-1)
            points.append(rho * around + np.array([0.0, 0.0, z]))
            normals.append(outward * around + np.array([0.0, 0.0, up]))
        return Cloud(np.concatenate(points), np.concatenate(normals))


def wave_directions(polar: FloatArray) -> FloatArray:
    """Unit vectors (d, 3) of waves along (sin theta, 0, cos theta)."""
    return np.stack([np.sin(polar), 0 * polar, np.cos(polar)], axis=-1)


@dataclass(frozen=True)
class RingSolution:
    """Scattered fields of a body of revolution for several plane waves.

    Attributes
    ----------
    wavenumber : float, 1/L
    polar : (d,)
        theta, radians: the waves go along (sin theta, 0, cos theta).
    rings : (s, 2), L
        rho and z.
    strengths : (m, s, d), L
    residual : (d,)
        Largest boundary residual on test points, off tips; of u when soft, (1/k) du/dn + i eta u otherwise,
        |u_inc| = 1.
    """

    wavenumber: float
    polar: FloatArray
    rings: FloatArray
    strengths: ComplexArray
    residual: FloatArray

    @property
    def directions(self) -> FloatArray:
        """Unit vectors (d, 3), where the waves go."""
        return wave_directions(self.polar)

    def total(self, points: ArrayLike) -> ComplexArray:
        """Incident and scattered field on and outside the body: (n, 3), L, to (n, d)."""
        x = np.asarray(points, dtype=float)
        return np.asarray(np.exp(1j * self.wavenumber * (x @ self.directions.T)) + self._sum(x, None, (1.0, 0.0)))

    def normal_derivative(self, points: ArrayLike, normals: ArrayLike) -> ComplexArray:
        """n.grad of the total field, 1/L: (n, 3), L, and (n, 3) to (n, d)."""
        x, n, k = np.asarray(points, dtype=float), np.asarray(normals, dtype=float), self.wavenumber
        incident = 1j * k * (n @ self.directions.T) * np.exp(1j * k * (x @ self.directions.T))
        return np.asarray(incident + k * self._sum(x, n, (0.0, 1.0)))

    def far_field(self, r: ArrayLike) -> ComplexArray:
        """Far field f, L, u_s ~ f e^{ikR}/R, in unit directions: (n, 3) to (n, d)."""
        r = np.asarray(r, dtype=float)
        phi, sine = np.arctan2(r[:, 1], r[:, 0]), np.hypot(r[:, 0], r[:, 1])
        k, out = self.wavenumber, np.zeros((len(r), len(self.polar)), dtype=complex)
        wave = np.exp(-1j * k * np.multiply.outer(r[:, 2], self.rings[:, 1]))
        for m, q in enumerate(self.strengths):
            part = wave * jv(m, k * np.multiply.outer(sine, self.rings[:, 0]))
            out += (-1j) ** m * np.cos(m * phi)[:, None] * (part @ q)
        return out

    def _sum(self, x: FloatArray, n: FloatArray | None, form: tuple[complex, complex]) -> ComplexArray:
        """alpha u_s + (beta/k) n.grad u_s at points."""
        phi = np.arctan2(x[:, 1], x[:, 0])
        place = np.stack([np.hypot(x[:, 0], x[:, 1]), x[:, 2]], axis=-1)
        radial = np.stack([np.cos(phi), np.sin(phi)], axis=-1)
        normal = np.zeros_like(place) if n is None else np.stack([np.sum(n[:, :2] * radial, axis=1), n[:, 2]], axis=-1)
        orders = len(self.strengths)
        out = np.zeros((len(x), len(self.polar)), dtype=complex)
        step = max(1, BLOCK // (orders * len(self.rings)))
        for i in range(0, len(x), step):
            some = slice(i, i + step)
            kernel = _kernels(place[some], normal[some], self.rings, self.wavenumber, form, orders)
            out[some] = np.einsum(
                "nm,mns,msd->nd", np.cos(np.outer(phi[some], np.arange(orders))), kernel, self.strengths, optimize=True
            )
        return out


def scatter_by_rings(
    profile: Profile,
    wavenumber: float,
    polar: ArrayLike,
    boundary: Boundary,
    *,
    per_wavelength: float = 6.0,
    crowded: float = CROWDED,
    least: float = 1e-3,
) -> RingSolution:
    """Solve for a body of revolution.

    Parameters
    ----------
    profile : Profile
    wavenumber : float, 1/L
    polar : (d,)
        theta, radians, of the waves.
    boundary : "soft", "hard" or complex
        Complex is the impedance number eta.
    per_wavelength : float
        Rings a wavelength far from joints and tips.
    crowded : float
        Spacing of the rings over the distance from the nearest of those.
    least : float
        Spacing next to them, in wavelengths.
    """
    positive(wavenumber=wavenumber, per_wavelength=per_wavelength, crowded=crowded, least=least)
    k, theta = wavenumber, np.atleast_1d(np.asarray(polar, dtype=float))
    form = condition(boundary)
    wide = min(2 * np.pi / k / per_wavelength, profile.radius / (2.5 * DEPTH))
    shortest = 2 * np.pi / k * least
    s, gap = _graded(profile, wide, crowded, shortest)
    x, n = profile.at(s)
    depth = DEPTH * gap
    if profile.tips:
        depth = np.minimum(depth, AXIS * x[:, 0])
    rings = x - depth[:, None] * n
    rings = rings[rings[:, 0] > 1e-9 * profile.length]
    largest = np.max(profile.at(np.linspace(0, profile.length, 400))[0][:, 0])
    orders = int(np.ceil(k * largest * np.max(np.sin(theta)) + 10 * (k * largest) ** (1 / 3))) + 4
    at, at_gap = _graded(profile, wide / DENSER, crowded / DENSER, shortest / DENSER)
    place, normal = profile.at(at)
    share = np.sqrt(at_gap * place[:, 0])
    kernel = np.empty((orders, len(at), len(rings)), dtype=complex)
    step = max(1, BLOCK // (orders * len(rings)))
    for i in range(0, len(at), step):
        kernel[:, i : i + step] = _kernels(place[i : i + step], normal[i : i + step], rings, k, form, orders)
    right = -_waves(place, normal, k, theta, form, orders)
    strengths = np.stack([_fitted(matrix, wave, share) for matrix, wave in zip(kernel, right, strict=True)])
    solution = RingSolution(k, theta, rings, strengths, np.zeros(len(theta)))
    checks, _ = _graded(profile, wide / 1.37, crowded / 1.37, shortest)
    for tip in profile.tips:
        checks = checks[np.abs(checks - tip) > TIP * 2 * np.pi / k]
    place, normal = profile.at(checks)
    residual = np.zeros(len(theta))
    for phi in np.linspace(0.1, np.pi, 5):
        turn = np.array([np.cos(phi), np.sin(phi)])
        points = np.concatenate([place[:, :1] * turn, place[:, 1:]], axis=1)
        normals = np.concatenate([normal[:, :1] * turn, normal[:, 1:]], axis=1)
        d = solution.directions
        wave = np.exp(1j * k * (points @ d.T)) * (form[0] + 1j * form[1] * (normals @ d.T))
        residual = np.maximum(residual, np.max(np.abs(wave + solution._sum(points, normals, form)), axis=0))
    return RingSolution(k, theta, rings, strengths, residual)


def _fitted(matrix: ComplexArray, right: ComplexArray, share: FloatArray) -> ComplexArray:
    """Strengths (s, d) of least weighted misfit; orders that are nowhere have none."""
    size = np.linalg.norm(share[:, None] * matrix, axis=0)
    if not np.any(np.abs(right) > 1e-14):
        return np.zeros((matrix.shape[1], right.shape[1]), dtype=complex)
    scale = 1 / np.maximum(size, 1e-300)
    # what rounding would fill is held down
    ridge = 1e-13 * np.sqrt(len(share)) * np.eye(matrix.shape[1])
    whole = np.concatenate([share[:, None] * matrix * scale, ridge])
    wave = np.concatenate([share[:, None] * right, np.zeros((len(ridge), right.shape[1]))])
    return np.asarray(scale[:, None] * least_squares(whole, wave))


def _graded(profile: Profile, wide: float, crowded: float, least: float) -> tuple[FloatArray, FloatArray]:
    """Arc lengths in the middle of cells whose sizes, also given, fall towards joints and tips: (n,) each."""
    places = np.array([*profile.joints, *profile.tips])

    def spacing(s: FloatArray) -> FloatArray:
        gap: FloatArray = np.full(np.shape(s), wide)
        if len(places):
            gap = np.minimum(gap, least + crowded * np.min(np.abs(np.subtract.outer(s, places)), axis=-1))
        for tip in profile.tips:
            # a narrow cone has room for rings near each other only
            away = np.abs(s - tip)
            rho = profile.at(s)[0][..., 0]
            gap = np.where(away < 3 * profile.radius, np.minimum(gap, 0.05 * least + crowded * rho), gap)
        return gap

    fine = np.unique(np.concatenate([_towards(place, profile.length, least) for place in (*places, -1.0)]))
    number = np.concatenate([[0], np.cumsum(np.diff(fine) / spacing(0.5 * (fine[1:] + fine[:-1])))])
    count = int(np.ceil(number[-1]))
    edges = np.interp(np.linspace(0, number[-1], count + 1), number, fine)
    return 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)


def _towards(place: float, length: float, least: float) -> FloatArray:
    """A fine lattice of a profile, finer towards a place on it."""
    even = np.linspace(0, length, 4001)
    if place < 0:
        return even
    step = np.geomspace(1e-3 * least, length, 2000)
    return np.asarray(np.clip(np.concatenate([[place], place + step, place - step]), 0.0, length))


def _waves(
    x: FloatArray, n: FloatArray, k: float, theta: FloatArray, form: tuple[complex, complex], orders: int
) -> ComplexArray:
    """alpha u + (beta/k) n.grad u of each order of the plane waves (orders, n, d)."""
    alpha, beta = form
    sine, cosine = np.sin(theta), np.cos(theta)
    at, along = k * np.outer(x[:, 0], sine), np.exp(1j * k * np.outer(x[:, 1], cosine))
    out = np.empty((orders, len(x), len(theta)), dtype=complex)
    for m in range(orders):
        J = jv(m, at)
        slope = 0.5 * (jv(m - 1, at) - jv(m + 1, at)) * sine
        normal = n[:, :1] * slope + 1j * n[:, 1:] * cosine * J
        out[m] = (1 if m == 0 else 2) * 1j**m * along * (alpha * J + beta * normal)
    return out


def _kernels(
    x: FloatArray, n: FloatArray, rings: FloatArray, k: float, form: tuple[complex, complex], orders: int
) -> ComplexArray:
    """alpha G_m + (beta/k) n.grad G_m at points (n, 2) of rings (s, 2): (orders, n, s)."""
    apart = np.hypot(x[:, None, 0] - rings[:, 0], x[:, None, 1] - rings[:, 1])
    both = np.sqrt(np.maximum(x[:, None, 0] * rings[:, 0], 1e-300))
    # the integrand is analytic in a strip about the real azimuths
    strip = 2 * np.arcsinh(apart / (2 * both))
    wanted = 2 * orders + 2 * k * both + DIGITS / np.maximum(strip, 1e-6)
    level = np.maximum(np.ceil(np.log2(wanted)).astype(int), 5)
    out = np.empty((orders, *level.shape), dtype=complex)
    for some in np.unique(level):
        point, ring = np.nonzero(level == some)
        count = 2**some // 2
        cos = np.cos(np.pi * np.arange(count + 1) / count)
        step = max(1, BLOCK // count)
        for i in range(0, len(point), step):
            p, r = point[i : i + step], ring[i : i + step]
            out[:, p, r] = _rings(x[p], n[p], rings[r], cos, k, form)[:, :orders].T
    return out


def _rings(
    x: FloatArray, n: FloatArray, y: FloatArray, cos: FloatArray, k: float, form: tuple[complex, complex]
) -> ComplexArray:
    """Orders (n, count + 1) of pairs of points and rings, by the trapezoid rule over the azimuth."""
    alpha, beta = form
    rho = y[:, :1] * cos
    height = x[:, 1:] - y[:, 1:]
    both = (2 * x[:, 0] * y[:, 0])[:, None]
    R = np.sqrt((x[:, :1] - y[:, :1]) ** 2 + height**2 + both * (1 - cos))
    wave = np.exp(1j * k * R) / R
    along = n[:, :1] * (x[:, :1] - rho) + n[:, 1:] * height
    g = np.asarray(wave * (alpha + beta / k * (1j * k - 1 / R) * along / R))
    # half the circle: the integrand is even in the azimuth
    return np.asarray((dct(g.real, type=1) + 1j * dct(g.imag, type=1)) / (2 * (len(cos) - 1)))
