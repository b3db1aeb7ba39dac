"""Sums over T-matrices: far fields by pairs, backscatter as a Fourier series.

    f(d, r) = (4 pi/k) sum (-i)^(l+1) V(r) T i^l' conj V'(d),   V = Y_lm, or X_lm and i r cross X_lm

V is a trigonometric polynomial of degree l in theta, carried on beyond the poles, times e^{im phi}. So f(d, -d) is one
of degree 2L in both angles: its coefficients are sums over waves of one m and one m' at a time, and values at any
number of directions a nonuniform Fourier transform.

Sources: [MTL02, sec. 5.3]; [BMK19].
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.tmatrix.spherical_waves import (
    degrees,
    far_profiles,
    far_vectors,
    harmonics,
    vector_degrees,
)

TOLERANCE = 1e-9
"""Of the Fourier transform, as a share of its largest value."""


class Pattern(NamedTuple):
    """Far fields and their errors, L, by incidence and direction; for a conductor (..., scattered, incident)."""

    values: ComplexArray
    error: FloatArray


class Sections(NamedTuple):
    """Cross sections, L^2, by incidence (m,); for a conductor (m, 2), with E0 along theta and phi."""

    scattering: FloatArray
    extinction: FloatArray

    @property
    def absorption(self) -> FloatArray:
        """Extinction minus scattering."""
        return np.asarray(self.extinction - self.scattering)


class Averages(NamedTuple):
    """Cross sections, L^2, averaged over all orientations of the body and, for a conductor, over both polarisations.

    Attributes
    ----------
    backscattering, scattering, extinction : float
        Backscattering is 4 pi |f(d, -d)|^2, summed over both scattered polarisations for a conductor.
    error : float
        Error of the backscattering.
    """

    backscattering: float
    scattering: float
    extinction: float
    error: float

    @property
    def target_strength(self) -> float:
        """10 log10(backscattering/4 pi), dB relative to L."""
        return float(10 * np.log10(self.backscattering / (4 * np.pi)))

    @property
    def target_strength_error(self) -> float:
        """Error of the target strength, dB."""
        return float(10 * np.log10(1 + self.error / self.backscattering))


def far_table(directions: FloatArray, order: int, *, vector: bool) -> ComplexArray:
    """V in unit directions (n, 3): (n, c, waves), c = 1 or theta and phi."""
    return far_vectors(directions, order) if vector else harmonics(directions, order)[:, None]


def degrees_of(order: int, *, vector: bool) -> tuple[IntArray, IntArray]:
    """Degrees and orders of the waves (waves,) each."""
    deg, m = vector_degrees(order)[:2] if vector else degrees(order)
    return deg, m


def received(directions: FloatArray, order: int, *, vector: bool) -> ComplexArray:
    """Regular waves in plane ones along unit directions (n, 3), by component: (n, c, waves)."""
    deg, _ = degrees_of(order, vector=vector)
    return np.asarray(4 * np.pi * 1j**deg * far_table(directions, order, vector=vector).conj())


def sent(directions: FloatArray, order: int, wavenumber: float, *, vector: bool) -> ComplexArray:
    """Far fields of outgoing waves in unit directions (n, 3), L: (n, c, waves)."""
    deg, _ = degrees_of(order, vector=vector)
    return np.asarray((-1j) ** (deg + 1) / wavenumber * far_table(directions, order, vector=vector))


def backward_series(T: ComplexArray, wavenumber: float, theta: FloatArray, order: int, *, vector: bool) -> ComplexArray:
    """f(d, -d) as a Fourier series in phi at polar angles (t,) of d: (t, c, c, 4 order + 1), from -2 order on.

    Components are those of -d, with theta and phi there, and of d.
    """
    deg, m = degrees_of(order, vector=vector)
    # -d is at pi - theta and phi + pi
    out = far_profiles(np.pi - theta, order, vector=vector) * ((-1j) ** (deg + 1) / wavenumber * (-1.0) ** m)
    into = far_profiles(theta, order, vector=vector).conj() * (4 * np.pi * 1j**deg)
    t, c, waves = out.shape
    of = [np.flatnonzero(m == one) for one in range(-order, order + 1)]
    # T by m' of what comes in: (m', waves, t, c)
    half = np.empty((2 * order + 1, waves, t * c), dtype=complex)
    for number, at in enumerate(of):
        half[number] = T[:, at] @ into[:, :, at].reshape(t * c, -1).T
    found = np.zeros((t, c, c, 4 * order + 1), dtype=complex)
    for number, at in enumerate(of):
        part = half[:, at].reshape(2 * order + 1, len(at), t, c)
        # e^{i(m - m') phi}
        both = np.einsum("tow,nwti->toin", out[:, :, at], part)
        found[..., number : number + 2 * order + 1] += both[..., ::-1]
    return found


class Backward:
    """f(d, -d) of a T-matrix about its centre as a double Fourier series in theta and phi."""

    def __init__(self, T: ComplexArray, wavenumber: float, order: int, *, vector: bool) -> None:
        n = 4 * order + 1
        theta = 2 * np.pi * np.arange(n) / n
        half = 2 * order + 1
        along = backward_series(T, wavenumber, theta[:half], order, vector=vector)
        # f at 2 pi - theta is f at theta and phi + pi; theta and phi both turn about, in what comes and what goes
        flip = (-1.0) ** np.arange(-2 * order, 2 * order + 1)
        whole = np.concatenate([along, (along * flip)[:0:-1]])
        series = np.fft.fftshift(np.fft.fft(whole, axis=0) / n, axes=0)
        self._series = np.ascontiguousarray(np.moveaxis(series, (1, 2), (0, 1)))

    def at(self, theta: FloatArray, phi: FloatArray) -> ComplexArray:
        """f at angles (n,) of d, radians: (n, c, c), L."""
        import finufft

        c = len(self._series)
        found = finufft.nufft2d2(
            np.ascontiguousarray(theta),
            np.ascontiguousarray(phi),
            self._series.reshape(c * c, *self._series.shape[2:]),
            eps=TOLERANCE,
            isign=1,
        )
        return np.asarray(found.reshape(c * c, -1).T.reshape(-1, c, c))
