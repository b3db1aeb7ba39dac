"""The T-matrix of a body: its far fields of every incidence and direction, cross sections and averages.

    p = T a,   u_inc = sum a psi^(1),  u_s = sum p psi^(3)          vector waves of E for a conductor
    S = 1 + 2T,  S*S = 1 where nothing is absorbed;  T_lm,l'm' = (-1)^(m+m') T_l'-m',l-m by reciprocity
    scattering |p|^2/k^2, extinction (4 pi/k) Im f(d, d), their means over all d, and over both polarisations:
    (s/k^2) sum |T|^2 and -(s/k^2) Re tr T,  s = 4 pi, or 2 pi of a conductor

Sources: [W71]; [MTL02, sec. 5.2 to 5.4]; Derivations, F36.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import Drawn
from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import UNRESOLVED, observers_of
from creeping.field.results.far_result import FarField
from creeping.field.tmatrix.lack import Lack
from creeping.field.tmatrix.patterns import (
    Averages,
    Backward,
    Pattern,
    Sections,
    backward_series,
    received,
    recentred,
    sent,
    turned,
)
from creeping.geometry.arguments import flag, real_array, whole_number
from creeping.geometry.directions import angles_of, unit_directions
from creeping.storage.memory import blocks, within_budget

if TYPE_CHECKING:
    import xarray

METHOD = "t-matrix"
ORTHOGONAL = 1e-9
"""What a rotation may lack of being one."""
PAIRS = 4096
"""Pairs of directions that are summed together."""
VALUE = 80.0
"""Bytes that a far field with its error takes while it is made."""


@dataclass(frozen=True, eq=False, repr=False)
class TMatrix(Drawn):
    """T-matrix of a body: scattered spherical waves for each incident spherical wave about a centre.

    Definition and order of the waves are those of `creeping.field.tmatrix.spherical_waves`, treams and acoustotreams.

    Attributes
    ----------
    matrix : (N, N) complex, N = (l + 1)^2 or, for a conductor, 2 l (l + 2)
        Maps regular incident waves to outgoing waves; l is the `order`. For a conductor electric
        and magnetic multipoles of E alternate.
    wavenumber : float, 1/L
    center : (3,), L
        Centre of the spherical waves.
    boundary : str
    vector : bool
        True for the electric field E (a conductor), False for a scalar field.
    body : str
        Description of the body.
    extinction : float
        Extinction error: rms residual field of plane waves inside the body, relative to them; NaN if not known.
    absorbing : bool
        Whether the body absorbs; if so, S = 1 + 2 T need not be unitary.
    unit : str
        Unit of length: "m" if the body states it, else "L".

    Raises
    ------
    InvalidInputError
        If the size of the matrix fits no order, or values are not finite.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> T = cr.t_matrix(sc.Sphere(), wavenumber=1.0, boundary="hard")
    >>> T.backscatter([(0, 0, 1), (1, 0, 0)]).total.shape, bool(T.reciprocity < 1e-3)
    ((2,), True)
    >>> sections = T.cross_sections((0, 0, 1))
    >>> bool(abs(sections.absorption[0] / sections.scattering[0]) < 1e-3)
    True
    """

    matrix: ComplexArray
    wavenumber: float
    center: FloatArray
    boundary: str
    vector: bool = False
    body: str = ""
    extinction: float = float("nan")
    absorbing: bool = False
    unit: str = "L"

    def __post_init__(self) -> None:
        T, L = np.asarray(self.matrix), 0
        if T.ndim == 2 and T.shape[0] == T.shape[1]:
            L = self.order
        if T.shape != (self._waves(L),) * 2 or L < (1 if self.vector else 0):
            raise InvalidInputError(
                f"a T-matrix has shape {T.shape}; "
                + ("2 L (L + 2) vector waves" if self.vector else "(L + 1)^2 waves")
                + " of an order L are needed on each axis"
            )
        if not np.all(np.isfinite(T)):
            raise InvalidInputError(f"{int(np.sum(~np.isfinite(T)))} values of a T-matrix are not finite")

    def _waves(self, order: int) -> int:
        return 2 * order * (order + 2) if self.vector else (order + 1) ** 2

    @property
    def order(self) -> int:
        """Highest degree of the waves."""
        n = len(self.matrix)
        return int(np.sqrt(n / 2 + 1) - 0.5) if self.vector else int(np.sqrt(n) - 0.5)

    def __repr__(self) -> str:
        error = "" if self.absorbing else f", unitarity {self.unitarity:.1g}"
        return (
            f"TMatrix(order {self.order}, {len(self.matrix)} waves, k = {self.wavenumber:g}, {self.boundary})\n"
            f"  {self.body or 'a body'}; reciprocity {self.reciprocity:.1g}{error}; error of f {self.error:.1g} "
            f"{self.unit}"
        )

    # --- errors

    @cached_property
    def _lack(self) -> Lack:
        return Lack(self.matrix, self.wavenumber, self.order, vector=self.vector, absorbing=self.absorbing)

    @property
    def reciprocity(self) -> float:
        """Rms of f(d, r) - f(-r, -d) over all pairs of directions, divided by the rms of f."""
        return self._lack.reciprocity

    @property
    def unitarity(self) -> float:
        """Norm of S*S - 1 divided by the norm of S - 1, S = 1 + 2 T; NaN for a body that absorbs."""
        return self._lack.unitarity

    @property
    def error(self) -> float:
        """Error of f, L, meant to cover 95 % of all pairs of directions; `bistatic` gives the error of each pair."""
        return self._lack.error

    # --- far fields

    def bistatic(self, directions: ArrayLike, observation: ArrayLike, *, pairs: bool = False) -> Pattern:
        """Far fields f(d, r) for all incidences and all directions of observation, or for pairs of them.

        Parameters
        ----------
        directions : (3,) or (m, 3)
            Of incidence; need not be unit.
        observation : (3,) or (n, 3)
            From the body to the observers.
        pairs : bool
            Pair each incidence with one direction of observation, m = n.

        Returns
        -------
        Pattern
            (m, n), or (m,) for pairs; for a conductor (m, n, 2, 2): scattered (theta, phi) by incident (theta, phi).

        Raises
        ------
        InvalidInputError
            On bad directions, if pairs do not match in number, and if the result exceeds the memory limit.
        """
        flag(pairs, "pairs")
        d = unit_directions(directions, "directions of incidence").reshape(-1, 3)
        r = observers_of(observation)
        c = 2 if self.vector else 1
        if pairs and len(d) != len(r):
            raise InvalidInputError(f"{len(d)} incidences and {len(r)} directions are no pairs")
        if not pairs:
            within_budget(VALUE * c * c * len(d) * len(r), f"{len(d)} x {len(r)} far fields", "ask for fewer at a time")
        shape = (len(d), c, c) if pairs else (len(d), len(r), c, c)
        found, lack = np.empty(shape, dtype=complex), np.empty(shape)
        for first in range(0, len(d), PAIRS):
            at = slice(first, first + PAIRS)
            a = self._received(d[at]).reshape(-1, len(self.matrix)).T
            came, lacks = self.matrix @ a, self._lack.of @ a
            if pairs:
                out = self._sent(r[at])
                lanes = (lane.reshape(len(lane), -1, c) for lane in (came, lacks))
                own = [
                    np.stack([np.sum(out * one.T[:, None], axis=2) for one in np.moveaxis(lane, 2, 0)], axis=2)
                    for lane in lanes
                ]
                found[at], lack[at] = own[0], np.abs(own[1])
                continue
            for start in range(0, len(r), PAIRS):
                part = slice(start, start + PAIRS)
                out = self._sent(r[part])
                rows = out.reshape(-1, len(self.matrix))
                each = [np.moveaxis((rows @ lane).reshape(len(out), c, -1, c), 2, 0) for lane in (came, lacks)]
                found[at, part], lack[at, part] = each[0], np.abs(each[1])
        error = self._lack.error_of(lack, d, r, pairs=pairs)
        return Pattern(*((found, error) if self.vector else (found[..., 0, 0], error[..., 0, 0])))

    def far_field(self, direction: ArrayLike, observation: ArrayLike) -> FarField:
        """Far field of one incidence (3,) in directions (..., 3), with errors, as `creeping.far_field` returns it.

        Raises
        ------
        InvalidInputError
            On bad directions, or if more than one incidence is given.
        """
        d = unit_directions(direction, "direction of incidence").reshape(-1, 3)
        if len(d) != 1:
            raise InvalidInputError(f"far_field takes one incidence, not {len(d)}; far_fields takes several")
        return next(self.far_fields(d, observation))

    def far_fields(self, directions: ArrayLike, observation: ArrayLike) -> Iterator[FarField]:
        """Iterate over the incidences (m, 3): the far field of each in the directions (..., 3).

        Incidences are computed in blocks as large as the memory allows.

        Raises
        ------
        InvalidInputError
            On bad directions.
        """
        d = unit_directions(directions, "directions of incidence").reshape(-1, 3)
        r = observers_of(observation)
        for part in blocks(len(d), VALUE * (4 if self.vector else 1) * max(len(r), 1)):
            found = self.bistatic(d[part], r)
            yield from (self._far(r, *each) for each in zip(found.values, found.error, strict=True))

    def backscatter(self, directions: ArrayLike) -> FarField:
        """Backscatter of each incidence d (m, 3): the far field in direction -d.

        For many incidences a Fourier series in both angles is computed once and then evaluated for each.
        """
        d = unit_directions(directions, "directions of incidence").reshape(-1, 3)
        error = self._lack.backward_error(d)
        # the series takes as many products with the matrix
        if len(d) <= 2 * self.order:
            values = self.bistatic(d, -d, pairs=True).values
            return self._far(-d, values, np.broadcast_to(error.reshape(-1, *[1] * (values.ndim - 1)), values.shape))
        theta, phi = angles_of(d)
        found = self._backward.at(theta, phi)
        if self.vector:
            # at the poles phi is 0 both of d and of -d, by convention: theta and phi of -d turn about
            found[np.hypot(d[:, 0], d[:, 1]) < 1e-12] *= -1
        found = found * np.exp(2j * self.wavenumber * (d @ self.center))[:, None, None]
        error = np.broadcast_to(error[:, None, None], found.shape).copy()
        return self._far(-d, *((found, error) if self.vector else (found[:, 0, 0], error[:, 0, 0])))

    @cached_property
    def _backward(self) -> Backward:
        return Backward(self.matrix, self.wavenumber, self.order, vector=self.vector)

    def _far(self, r: FloatArray, total: ComplexArray, error: FloatArray) -> FarField:
        off = ~(error < UNRESOLVED * np.max(np.abs(total), initial=self._lack.mean))
        return FarField(
            directions=np.array(r),
            total=total,
            parts={},
            method=np.full(len(r), METHOD),
            unresolved=off.any(axis=tuple(range(1, off.ndim))),
            error=error,
            error_by="reciprocity and unitarity",
            wavenumber=self.wavenumber,
            boundary=self.boundary,
            order=2,
            unit=self.unit,
        )

    def _received(self, d: FloatArray) -> ComplexArray:
        """Regular waves in plane ones along d (m, 3): (m, c, waves)."""
        phase = np.exp(1j * self.wavenumber * (d @ self.center))[:, None, None]
        return np.asarray(phase * received(d, self.order, vector=self.vector))

    def _sent(self, r: FloatArray) -> ComplexArray:
        """Far fields of outgoing waves along r (n, 3): (n, c, waves)."""
        phase = np.exp(-1j * self.wavenumber * (r @ self.center))[:, None, None]
        return np.asarray(phase * sent(r, self.order, self.wavenumber, vector=self.vector))

    # --- cross sections

    def cross_sections(self, directions: ArrayLike) -> Sections:
        """Scattering, extinction and absorption cross sections, L^2, for incidences (m, 3), which need not be unit."""
        d = unit_directions(directions, "directions of incidence").reshape(-1, 3)
        scattering, extinction = [], []
        for first in range(0, len(d), PAIRS):
            some = d[first : first + PAIRS]
            a = self._received(some)
            p = (a.reshape(-1, len(self.matrix)) @ self.matrix.T).reshape(a.shape)
            scattering.append(np.sum(np.abs(p) ** 2, axis=2) / self.wavenumber**2)
            forward = np.einsum("ncw,ncw->nc", self._sent(some), p)
            extinction.append(4 * np.pi / self.wavenumber * forward.imag)
        both = [np.concatenate(part) if part else np.zeros((0, 1)) for part in (scattering, extinction)]
        return Sections(*(part if self.vector else part[:, 0] for part in both))

    def orientation_average(self) -> Averages:
        """Backscattering, scattering and extinction cross sections, L^2, averaged over all orientations of the body."""
        T, k, L = self.matrix, self.wavenumber, self.order
        share = (2 if self.vector else 4) * np.pi / k**2
        # |f|^2 is of degree 4L: Gauss's rule over cos theta, Parseval's sum over phi
        u, w = np.polynomial.legendre.leggauss(2 * L + 1)
        series = backward_series(T, k, np.arccos(u), L, vector=self.vector)
        c = len(series[0])
        mean = 0.5 * float(np.sum(w * np.sum(np.abs(series) ** 2, axis=(1, 2, 3)))) / c
        return Averages(
            backscattering=4 * np.pi * mean,
            scattering=share * float(np.linalg.norm(T)) ** 2,
            extinction=-share * float(np.trace(T).real),
            # of components that err in phase with the field
            error=4 * np.pi * float((np.sqrt(mean) + np.sqrt(c) * self._lack.backward) ** 2 - mean),
        )

    # --- other places

    def rotate(self, rotation: ArrayLike) -> TMatrix:
        """T-matrix of the body rotated about the origin: R (3, 3) takes each point x, L, to R x.

        Raises
        ------
        InvalidInputError
            If the matrix is not a rotation.
        """
        R = real_array(rotation, "rotation")
        if R.shape != (3, 3) or np.max(np.abs(R @ R.T - np.eye(3))) > ORTHOGONAL or np.linalg.det(R) < 0:
            raise InvalidInputError("rotation is no rotation: give a matrix (3, 3) with R R^T = 1 and determinant 1")
        T = turned(self.matrix, R, self.order, vector=self.vector)
        return replace(self, matrix=T, center=R @ self.center, body=self._moved("turned"))

    def translate(self, shift: ArrayLike) -> TMatrix:
        """T-matrix of the body shifted by a vector (3,), L; the centre of the waves moves with the body.

        Raises
        ------
        InvalidInputError
            If the vector is not three numbers.
        """
        v = real_array(shift, "shift")
        if v.shape != (3,):
            raise InvalidInputError(f"shift has shape {v.shape}; give three numbers")
        return replace(self, center=self.center + v, body=self._moved("moved"))

    def about(self, center: ArrayLike, order: int | None = None) -> TMatrix:
        """T-matrix of the same body in spherical waves about another centre (3,), L.

        By default the order grows by k times the distance of the two centres.

        Raises
        ------
        InvalidInputError
            If the centre is not three numbers, the order is not a whole number, or the matrix is too large.
        """
        c = real_array(center, "center")
        if c.shape != (3,):
            raise InvalidInputError(f"center has shape {c.shape}; give three numbers")
        shift = c - self.center
        larger = self.order + int(np.ceil(self.wavenumber * np.linalg.norm(shift)))
        larger = larger if order is None else whole_number(order, "order")
        within_budget(48.0 * self._waves(larger) ** 2, f"waves of order {larger}", "give a lower order=")
        T = recentred(self.matrix, self.wavenumber, shift, self.order, larger, vector=self.vector)
        return replace(self, matrix=T, center=c)

    def _moved(self, how: str) -> str:
        return self.body if not self.body or self.body.endswith(how) else f"{self.body}, {how}"

    # --- other shapes

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of the matrix by degree and order of the waves and, for a conductor, polarisation."""
        from creeping.field.tmatrix.stored import as_dataset

        return as_dataset(self)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write an HDF5 file that treams reads; `creeping.field.tmatrix.stored` describes the format."""
        from creeping.field.tmatrix.stored import write_t_matrix

        write_t_matrix(self, path)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> TMatrix:
        """Read an HDF5 file written by `save` or by treams."""
        from creeping.field.tmatrix.stored import read_t_matrix

        return cls(**read_t_matrix(path))
