"""What of G = e^{ikR}/R is smooth everywhere, as a Fourier series, and the rest, which is real and ends within a reach.

    G = S + D,   D = E/R,   E = Re[e^{ikR} erfc(aR + ib)],   b = k/2a
    E' = -k Im[e^{ikR} erfc(aR + ib)] - (2a/sqrt(pi)) e^{b^2 - (aR)^2}
    E'' = -k^2 E + (4a^3 R/sqrt(pi)) e^{b^2 - (aR)^2}
    S = (cos kR - E)/R + i sin(kR)/R -> 2a e^{b^2}/sqrt(pi) - k erfi(b) + ik at R = 0
    S(x) = sum_s c_s e^{is.x},   |x_i| <= W_i,   s_i = 2 pi m/P_i,   |s_i| < (k^2 + 4a^2 L)^(1/2),   L = -log TOLERANCE

Beyond W_i, up to P_i/2 and back, distances are those of folded coordinates: what is folded is smooth and even, so that
its series ends where that of S does. The fold's second derivative is a Kaiser window.

Sources: [E21]; Derivations, F35.
"""

from functools import cached_property

import numpy as np

from creeping._typing import FloatArray, IntArray

TOLERANCE = 1e-5
"""What S and its series leave out, of 1/R."""
WIDE = 1.3
"""Width of the fold over the least that its window asks for."""
ROWS = 1024
"""Intervals of the table of E, over each of which cubics err by less than 1e-10."""
FOLD = 20_001
"""Places between which a fold is interpolated."""
ASKED = 1.01
"""What the series is made for, over the widths asked for."""


class SmoothKernel:
    """S of a wavenumber for places as far apart as the widths (3,), L, along the axes; ``split`` is a/k.

    Attributes
    ----------
    reach : float, L
        Distance beyond which D is nothing.
    modes : (3,) of int
        Waves of the series along each axis, even.
    period : (3,), L
    """

    def __init__(self, wavenumber: float, widths: FloatArray, split: float) -> None:
        self.k, self.split, self.a = wavenumber, split, split * wavenumber
        self._widths = ASKED * np.asarray(widths, dtype=float)
        self._b, enough = 0.5 / split, -np.log(TOLERANCE)
        self.reach = float(np.sqrt(enough + self._b**2) / self.a)
        highest = np.sqrt(self.k**2 + 4 * self.a**2 * enough)
        self._window = enough + 1
        self.period = 2 * self._widths + WIDE * 2 * self._window / (highest - self.k)
        self.modes: IntArray = np.array([_composite(p * highest / np.pi) for p in self.period])

    def __repr__(self) -> str:
        return f"SmoothKernel(k = {self.k:g}, {' x '.join(map(str, self.modes))} waves, reach {self.reach:.3g} L)"

    def near(self, distances: FloatArray) -> FloatArray:
        """E, E' and E'' (3, ...), 1, 1/L and 1/L^2, at distances (...), L."""
        from scipy.special import wofz

        R, root = np.asarray(distances, dtype=float), np.sqrt(np.pi)
        bell = np.exp(self._b**2 - (self.a * R) ** 2)
        wave = bell * wofz(1j * self.a * R - self._b)
        slope = -self.k * wave.imag - 2 * self.a / root * bell
        return np.stack([wave.real, slope, -(self.k**2) * wave.real + 4 * self.a**3 / root * R * bell])

    @cached_property
    def table(self) -> FloatArray:
        """`near` at equal steps from 0 to the reach (ROWS + 1, 3)."""
        return np.ascontiguousarray(self.near(np.linspace(0, self.reach, ROWS + 1)).T)

    @cached_property
    def at_zero(self) -> float:
        """Real part of S at R = 0, 1/L."""
        from scipy.special import erfi

        return float(2 * self.a / np.sqrt(np.pi) * np.exp(self._b**2) - self.k * erfi(self._b))

    @cached_property
    def waves(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """S of the series along each axis, 1/L, from the lowest up."""
        x, y, z = (2 * np.pi / p * np.arange(-(n // 2), n // 2) for n, p in zip(self.modes, self.period, strict=True))
        return x, y, z

    @cached_property
    def series(self) -> np.ndarray:
        """Coefficients c of the series, for 1/L, single precision: as many as modes."""
        from scipy.fft import dctn

        lengths = zip(self.modes, self.period, self._widths, strict=True)
        x, y, z = (self._folded(np.arange(n // 2 + 1) * (p / n), width, p) for n, p, width in lengths)
        R = np.sqrt(x[:, None, None] ** 2 + y[:, None] ** 2 + z**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            values = np.exp(1j * self.k * R) / R
            inside = R < self.reach
            values[inside] -= self.near(R[inside])[0] / R[inside]
        values[0, 0, 0] = self.at_zero + 1j * self.k
        octant = (dctn(values.real, type=1) + 1j * dctn(values.imag, type=1)) / np.prod(self.modes)
        whole = np.ix_(*(np.abs(np.arange(-(n // 2), n // 2)) for n in self.modes))
        return np.asarray(octant[whole], dtype=np.complex64)

    def _folded(self, places: FloatArray, width: float, period: float) -> FloatArray:
        """Places in half a period along an axis, folded beyond a width."""
        u, step = np.linspace(-1, 1, FOLD, retstep=True)
        window = np.i0(self._window * np.sqrt(np.maximum(1 - u**2, 0.0)))
        half = 0.5 * period - width
        # once to slopes from 1 to -1, and again to places
        slope = _integral(window)
        slope = 1 - 2 * slope / slope[-1]
        fold = width + half * float(step) * _integral(slope)
        return np.where(places <= width, places, np.interp((places - width) / half - 1, u, fold))


def _integral(values: FloatArray) -> FloatArray:
    """Integral of values at equal steps of 1 by trapezia, from 0."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]))])


def _composite(least: float) -> int:
    """The least even number from one on that is a product of 2, 3 and 5."""
    from scipy.fft import next_fast_len

    n = int(np.ceil(least))
    while True:
        n = int(next_fast_len(n, real=True))
        if n % 2 == 0:
            return n
        n += 1
