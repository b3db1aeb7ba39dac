"""Closed plane curves: sections of cylinders, by arc length, counterclockwise.

    x(t) = (x, y),   s = int |x'| dt,   n = (y', -x')/|x'|,   kappa = (x' y'' - y' x'')/|x'|^3

Smooth ones are given by x(t), t of 0..2 pi, and its derivatives; a capsule by arcs and lines, whose curvature jumps at
its joints.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline

from tests.reference.conditions import FloatArray

SAMPLES = 4096
"""Of arc length over the parameter; splines of degree 7 between them are good to rounding."""
GRADING = 6
"""Order to which the nodes' density vanishes at joints."""

Curve = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
Radius = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Places:
    """Places on a section.

    Attributes
    ----------
    points, tangents, normals : (n, 2), L, 1 and 1
    curvature : (n,), 1/L
    """

    points: FloatArray
    tangents: FloatArray
    normals: FloatArray
    curvature: FloatArray


@dataclass(frozen=True)
class Nodes:
    """Places, their arc length s and ds/dw, for w of 0..2 pi in equal steps."""

    places: Places
    s: FloatArray
    speed: FloatArray


class Section(Protocol):
    """What the solver and the marching ask of a section."""

    @property
    def length(self) -> float:
        """Circumference, L."""

    @property
    def joints(self) -> FloatArray:
        """Arc lengths at which the curvature jumps (j,), L."""

    def at(self, s: ArrayLike) -> Places:
        """Places at arc lengths (n,), L, of any turn."""

    def nodes(self, count: int) -> Nodes:
        """Nodes for quadrature."""


@dataclass(frozen=True)
class SmoothSection:
    """Analytic curve by its parameter: x, x' and x''."""

    curve: Curve
    first: Curve
    second: Curve

    @property
    def joints(self) -> FloatArray:
        """None."""
        return np.zeros(0)

    @cached_property
    def length(self) -> float:
        """Circumference, L."""
        t = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
        return float(2 * np.pi * np.mean(np.hypot(*self.first(t))))

    @cached_property
    def _lengths(self) -> tuple[FloatArray, FloatArray]:
        """Parameter and arc length over three turns."""
        t = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
        spectrum = np.fft.fft(np.hypot(*self.first(t)))
        waves = np.fft.fftfreq(SAMPLES, 1 / SAMPLES)
        waves[0] = 1
        spectrum = spectrum / (1j * waves)
        spectrum[0] = 0
        rest = np.fft.ifft(spectrum).real
        s = self.length / (2 * np.pi) * t + rest - rest[0]
        turns = (-1, 0, 1)
        return np.concatenate([t + 2 * np.pi * i for i in turns]), np.concatenate([s + self.length * i for i in turns])

    @cached_property
    def _parameter(self) -> Callable[[FloatArray], FloatArray]:
        t, s = self._lengths
        spline: Callable[[FloatArray], FloatArray] = make_interp_spline(s, t, k=7)
        return spline

    @cached_property
    def _arc_length(self) -> Callable[[FloatArray], FloatArray]:
        t, s = self._lengths
        spline: Callable[[FloatArray], FloatArray] = make_interp_spline(t, s, k=7)
        return spline

    def at(self, s: ArrayLike) -> Places:
        """Places at arc lengths (n,), L, of any turn."""
        return self._places(self._parameter(np.mod(np.asarray(s, dtype=float), self.length)))

    def _places(self, t: FloatArray) -> Places:
        x, d, b = (np.stack(f(t), axis=-1) for f in (self.curve, self.first, self.second))
        speed = np.hypot(d[:, 0], d[:, 1])
        tangents = d / speed[:, None]
        normals = np.stack([tangents[:, 1], -tangents[:, 0]], axis=-1)
        return Places(x, tangents, normals, (d[:, 0] * b[:, 1] - d[:, 1] * b[:, 0]) / speed**3)

    def nodes(self, count: int) -> Nodes:
        """Nodes at equal steps of the parameter."""
        t = 2 * np.pi * np.arange(count) / count
        return Nodes(self._places(t), np.asarray(self._arc_length(t)), np.hypot(*self.first(t)))


@dataclass(frozen=True)
class CapsuleSection:
    """Half circles of a radius joined by lines of a length along x; s = 0 where the right one begins, at the bottom."""

    radius: float = 0.5
    straight: float = 1.5

    @property
    def length(self) -> float:
        """Circumference, L."""
        return 2 * (np.pi * self.radius + self.straight)

    @property
    def joints(self) -> FloatArray:
        """Ends of the lines."""
        return self._ends[:-1]

    @property
    def _ends(self) -> FloatArray:
        half = np.pi * self.radius + self.straight
        return np.array([0.0, np.pi * self.radius, half, half + np.pi * self.radius, 2 * half])

    def at(self, s: ArrayLike) -> Places:
        """Places at arc lengths (n,), L, of any turn."""
        wound = np.mod(np.asarray(s, dtype=float), self.length)
        piece = np.clip(np.searchsorted(self._ends, wound, side="right") - 1, 0, 3)
        run = wound - self._ends[piece]
        angle = np.pi * ((piece + 1) // 2 - 0.5) + np.where(piece % 2 == 0, run / self.radius, 0.0)
        normals = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        half = self.straight / 2
        centre = np.choose(piece, [half + 0 * run, half - run, 0 * run - half, run - half])
        points = np.stack([centre + self.radius * normals[:, 0], self.radius * normals[:, 1]], axis=-1)
        tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=-1)
        return Places(points, tangents, normals, np.where(piece % 2 == 0, 1 / self.radius, 0.0))

    def nodes(self, count: int) -> Nodes:
        """Nodes graded towards the joints by the sigmoid of [CK13, sec. 3.6], none of them on a joint."""
        pieces = np.diff(self._ends)
        share = pieces + 0.15 * pieces.mean()
        counts = np.round(count * share / share.sum()).astype(int)
        counts[-1] += count - counts.sum()
        s, speed = [], []
        for start, length, m in zip(self._ends[:-1], pieces, counts, strict=True):
            g, rate = _sigmoid((np.arange(m) + 0.5) / m)
            s.append(start + length * g)
            speed.append(length * rate * count / (2 * np.pi * m))
        joined = np.concatenate(s)
        return Nodes(self.at(joined), joined, np.concatenate(speed))


def _sigmoid(u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Map of 0..1 to itself whose derivatives vanish at both ends, and its derivative."""
    p = GRADING

    def cubic(u: FloatArray) -> FloatArray:
        return (1 / p - 0.5) * (1 - 2 * u) ** 3 + (2 * u - 1) / p + 0.5

    rate = 2 / p - 6 * (1 / p - 0.5) * (1 - 2 * u) ** 2
    a, b = cubic(u), cubic(1 - u)
    total = a**p + b**p
    return a**p / total, p * (a * b) ** (p - 1) * (a + b) * rate / total**2


def ellipse(a: float, b: float) -> SmoothSection:
    """Ellipse of half axes a along x and b along y."""
    return SmoothSection(
        lambda t: (a * np.cos(t), b * np.sin(t)),
        lambda t: (-a * np.sin(t), b * np.cos(t)),
        lambda t: (-a * np.cos(t), -b * np.sin(t)),
    )


def polar(r: Radius, first: Radius, second: Radius) -> SmoothSection:
    """Curve r(t) in polar coordinates, with r' and r''."""

    def curve(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        return r(t) * np.cos(t), r(t) * np.sin(t)

    def slope(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        return first(t) * np.cos(t) - r(t) * np.sin(t), first(t) * np.sin(t) + r(t) * np.cos(t)

    def bend(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        turning, radial = 2 * first(t), second(t) - r(t)
        return radial * np.cos(t) - turning * np.sin(t), radial * np.sin(t) + turning * np.cos(t)

    return SmoothSection(curve, slope, bend)


def peanut(e: float) -> SmoothSection:
    """Curve r = 1 + e cos 2t: concave about the y axis if e > 1/5."""
    return polar(lambda t: 1 + e * np.cos(2 * t), lambda t: -2 * e * np.sin(2 * t), lambda t: -4 * e * np.cos(2 * t))


def kite() -> SmoothSection:
    """The kite of [CK13, sec. 3.6]: two horns, a concave back towards -x."""
    return SmoothSection(
        lambda t: (np.cos(t) + 0.65 * np.cos(2 * t) - 0.65, 1.5 * np.sin(t)),
        lambda t: (-np.sin(t) - 1.3 * np.sin(2 * t), 1.5 * np.cos(t)),
        lambda t: (-np.cos(t) - 2.6 * np.cos(2 * t), -1.5 * np.sin(t)),
    )


def bump(height: float, width: float, at: float, a: float = 1.0, b: float = 0.8) -> SmoothSection:
    """Ellipse with a bump, a periodic Gaussian of a height, L, and a width, rad, at an angle."""

    def radius(t: FloatArray) -> FloatArray:
        return (np.cos(t) / a) ** 2 + (np.sin(t) / b) ** 2

    def rate(t: FloatArray) -> FloatArray:
        return np.sin(2 * t) * (1 / b**2 - 1 / a**2)

    def bend(t: FloatArray) -> FloatArray:
        return 2 * np.cos(2 * t) * (1 / b**2 - 1 / a**2)

    def gauss(t: FloatArray) -> FloatArray:
        return height * np.exp((np.cos(t - at) - 1) / width**2)

    def lean(t: FloatArray) -> FloatArray:
        return np.sin(t - at) / width**2

    return polar(
        lambda t: radius(t) ** -0.5 + gauss(t),
        lambda t: -0.5 * radius(t) ** -1.5 * rate(t) - gauss(t) * lean(t),
        lambda t: (
            0.75 * radius(t) ** -2.5 * rate(t) ** 2
            - 0.5 * radius(t) ** -1.5 * bend(t)
            + gauss(t) * (lean(t) ** 2 - np.cos(t - at) / width**2)
        ),
    )
