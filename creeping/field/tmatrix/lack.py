"""What a T-matrix lacks: of reciprocity, of unitarity, and what far fields err by for it.

    T_lm,l'm' = (-1)^(m+m') T_l'-m',l-m      f(d, r) = f(-r, -d), of a conductor transposed
    S = 1 + 2T,  S*S = 1                     where nothing is absorbed

X, what is not reciprocal, errs as T does: |X(d, r)| tells of pairs, its rms over all r of d, and over all d of r, of
their neighbours. What is reciprocal is about as large. Backscatter is reciprocal whatever it is.

Sources: [MTL02, sec. 5.2]; Derivations, F36.
"""

from functools import cached_property

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.tmatrix.patterns import degrees_of, received
from creeping.geometry.directions import fibonacci_directions

LEVEL, BACKWARD = 2.3, 4.0
"""Error of f over what is known of it, with which 95 of 100 pairs of directions hold, and of backscatter. Set by
matrices of coarser and finer tiles of a cylinder and an ellipsoid, k = 8 to 15; of cones, a torus and an ogive as well
it is 2 to 8 times the error in the median."""
SHARE, ALONE = 0.15, 1.0
"""Part of the mean error that every pair has, and where its own reciprocity tells nothing."""
LEAST = 2e-5
"""Error of f over its rms at least: integrals over tiles are no better."""
TABLE, SPREAD = 4000, 4
"""Directions beyond which what T lacks there is read off a table, and places of it for each wave."""


def uncoupled(T: ComplexArray) -> list[IntArray]:
    """Waves in sets that a T-matrix does not couple, as of a body with planes of symmetry; all in one else.

    Examples
    --------
    >>> [at.tolist() for at in uncoupled(np.array([[1j, 0, 2], [0, 1, 0], [2, 0, 0]]))]
    [[0, 2], [1]]
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    number, which = connected_components(csr_array(T != 0), directed=False)
    return [np.flatnonzero(which == one) for one in range(number)]


class Lack:
    """What a T-matrix of a wavenumber, 1/L, and order lacks.

    Attributes
    ----------
    of : (waves, waves)
        What is not reciprocal.
    reciprocity, unitarity : float
        Norms over that of T; NaN of a body that absorbs.
    mean : float, L
        Rms of f over all pairs of directions and components.
    """

    def __init__(self, T: ComplexArray, wavenumber: float, order: int, *, vector: bool, absorbing: bool) -> None:
        self._T, self._k, self._order, self._vector = T, wavenumber, order, vector
        self._absorbing = absorbing
        self._size = float(np.linalg.norm(T))
        self.mean = self._size / (wavenumber * (2 if vector else 1))

    @cached_property
    def of(self) -> ComplexArray:
        """T less that of the reversed field."""
        deg, m = degrees_of(self._order, vector=self._vector)
        across = np.lexsort([np.arange(len(deg)) % 2, -m, deg]) if self._vector else np.lexsort([-m, deg])
        sign = (-1.0) ** m
        return np.asarray(self._T - sign[:, None] * self._T.T[np.ix_(across, across)] * sign)

    @cached_property
    def reciprocity(self) -> float:
        """Norm of X over that of T."""
        return float(np.linalg.norm(self.of)) / self._size if self._size else 0.0

    @cached_property
    def unitarity(self) -> float:
        """Norm of S*S - 1 over that of S - 1."""
        if self._absorbing:
            return float("nan")
        found = 0.0
        for at in uncoupled(self._T):
            T = self._T[np.ix_(at, at)]
            found = np.hypot(found, np.linalg.norm(T + T.conj().T + 2 * T.conj().T @ T))
        return float(found) / self._size if self._size else 0.0

    @property
    def known(self) -> float:
        """What f lacks, rms, as a share of it."""
        return float(np.hypot(self.reciprocity, self.reciprocity if self._absorbing else self.unitarity))

    @property
    def error(self) -> float:
        """Error of f, L, in the mean."""
        return float(LEVEL * np.hypot(self.known, LEAST) * self.mean)

    @property
    def backward(self) -> float:
        """Error of backscatter, L, in the mean over incidences."""
        return float(BACKWARD * np.hypot(self.reciprocity * self.mean, self._least(ALONE)))

    def error_of(self, own: FloatArray, d: FloatArray, r: FloatArray, *, pairs: bool) -> FloatArray:
        """Error of f, L, of |X(d, r)| (..., c, c), for incidences d and directions r (m, 3)."""
        one, other = self.along(d), self.along(-r)
        around = self._together(one if pairs else one[:, None], other)[..., None, None]
        return np.asarray(LEVEL * np.sqrt(own**2 + around**2 + self._least(SHARE) ** 2))

    def backward_error(self, d: FloatArray) -> FloatArray:
        """Error of backscatter, L, of incidences d (m, 3)."""
        own = self.along(d)
        return np.asarray(BACKWARD * np.hypot(self._together(own, own), self._least(ALONE)))

    def _least(self, share: float) -> float:
        return float(np.hypot(share * self.known, LEAST) * self.mean)

    def _together(self, one: FloatArray, other: FloatArray) -> FloatArray:
        """What incidences and directions that lack so much lack together, L."""
        mean = self.reciprocity * self.mean
        return np.asarray(one * other / mean if mean else 0.0 * one * other)

    def along(self, d: FloatArray) -> FloatArray:
        """Rms of X over all r, L, of incidences d (m, 3); that over all d of r is that of the incidence -r."""
        if len(d) <= TABLE:
            return self._along(d)
        from scipy.spatial import cKDTree

        table = fibonacci_directions(max(TABLE // SPREAD, SPREAD * (self._order + 1) ** 2))
        return np.asarray(self._along(table)[cKDTree(table).query(d)[1]])

    def _along(self, d: FloatArray) -> FloatArray:
        a = received(d, self._order, vector=self._vector)
        c = a.shape[1]
        found = np.sum(np.abs(a.reshape(-1, len(self.of)) @ self.of.T) ** 2, axis=1).reshape(-1, c)
        return np.asarray(np.sqrt(found.mean(axis=1) / (4 * np.pi * c)) / self._k)
