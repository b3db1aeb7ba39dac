"""Sums over T-matrices: far fields by pairs, backscatter as a Fourier series, turned bodies, other centres.

    f(d, r) = (4 pi/k) sum (-i)^(l+1) V(r) T i^l' conj V'(d),   V = Y_lm, or X_lm and i r cross X_lm

V is a trigonometric polynomial of degree l in theta, carried on beyond the poles, times e^{im phi}. So f(d, -d) is one
of degree 2L in both angles: its coefficients are sums over waves of one m and one m' at a time, and values at any
number of directions a nonuniform Fourier transform. Turned by R, waves of a degree change among themselves,

    psi_lm(R^T x) = sum D^l_m'm psi_lm'(x),   D^l = int conj Y_lm'(r) Y_lm(R^T r) dr

and about another centre c' incoming and outgoing amplitudes have phases e^{+-ik d.(c' - c)}: Gauss's rule over
directions gives both exactly.

Sources: [MTL02, sec. 5.3]; [BMK19].
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.tmatrix.spherical_waves import (
    count,
    degrees,
    far_profiles,
    far_vectors,
    harmonics,
    vector_degrees,
)

TOLERANCE = 1e-9
"""Of the Fourier transform, as a share of its largest value."""
ALIAS = 12
"""Degrees beyond k|shift| that a phase e^{ikr.shift} has, about."""


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


def gauss_sphere(degree: int) -> tuple[FloatArray, FloatArray]:
    """Unit directions (n, 3) and weights (n,) of a rule that is exact for harmonics up to ``degree``."""
    u, w = np.polynomial.legendre.leggauss(degree // 2 + 1)
    phi = 2 * np.pi * np.arange(degree + 1) / (degree + 1)
    s = np.sqrt(1 - u**2)[:, None]
    x = np.stack([s * np.cos(phi), s * np.sin(phi), np.broadcast_to(u[:, None], (len(u), len(phi)))], axis=-1)
    return x.reshape(-1, 3), np.repeat(w, len(phi)) * 2 * np.pi / len(phi)


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


def turn_blocks(rotation: FloatArray, order: int) -> list[ComplexArray]:
    """D^l of a rotation (3, 3) for l = 0 to order: (2l + 1, 2l + 1) each."""
    x, w = gauss_sphere(2 * order)
    here, there = harmonics(x, order), harmonics(x @ rotation, order)
    blocks = []
    for deg in range(order + 1):
        at = slice(deg**2, (deg + 1) ** 2)
        blocks.append((here[:, at].conj() * w[:, None]).T @ there[:, at])
    return blocks


def turned(T: ComplexArray, rotation: FloatArray, order: int, *, vector: bool) -> ComplexArray:
    """The T-matrix of the body rotated by ``rotation`` (3, 3) about the centre."""
    n = count(order) - 1 if vector else count(order)
    D = np.zeros((n, n), dtype=complex)
    for deg, block in enumerate(turn_blocks(rotation, order)):
        at = slice(deg**2 - vector, (deg + 1) ** 2 - vector)
        if deg or not vector:
            D[at, at] = block
    if not vector:
        return np.asarray(D @ T @ D.conj().T)
    out = np.empty_like(T)
    for a in (0, 1):
        for b in (0, 1):
            out[a::2, b::2] = D @ T[a::2, b::2] @ D.conj().T
    return out


def recentred(
    T: ComplexArray, wavenumber: float, shift: FloatArray, order: int, larger: int, *, vector: bool
) -> ComplexArray:
    """The T-matrix about a centre that is ``shift`` (3,), L, from its own, of waves up to the order ``larger``.

    f = sent T received: with the phases of the new centre both are sums over waves about it.
    """
    x, w = gauss_sphere(order + larger + int(np.ceil(wavenumber * np.linalg.norm(shift))) + ALIAS)
    phase = np.exp(-1j * wavenumber * (x @ shift))
    # V(r) e^{-ikr.(c - c')} about c', by V' there; i's powers of both
    deg, _ = degrees_of(order, vector=vector)
    m, _ = degrees_of(larger, vector=vector)
    small, large = (far_table(x, n, vector=vector).reshape(-1, len(d)) for n, d in ((order, deg), (larger, m)))
    lanes = np.repeat(w * phase.conj(), 2 if vector else 1)[:, None]
    E = (large.conj() * lanes).T @ small
    left = E * np.multiply.outer(1j ** (m + 1), (-1j) ** (deg + 1))
    return np.asarray(left @ T @ (1j ** deg[:, None] * E.conj().T * (-1j) ** m))
