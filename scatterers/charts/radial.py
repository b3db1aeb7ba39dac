"""Sphere map of a body that is star-shaped once its spine is upright: x = psi(s) = T(c + r(s) A s).

A = diag(half axes), r > 0 the root of F(T(c + r A s)) = 0, and T a shear along the spine, in cyclic axes whose third is
the body's longest,

    T(w) = w + (X(w_3), Y(w_3), 0),   T^-1(x) = x - (X(x_3), Y(x_3), 0);

an upright body has T = 1. With y = A s and g = DT^T grad F(x): d psi/ds = r DT (A - y (A g)^T/(g.y)), and
psi^-1(x) = A^-1 (w - c)/|A^-1 (w - c)|, w = T^-1(x). Every ray meets the body once where g.(w - c) > 0 on all of it.
The root is found by Newton steps from r = 1, halved into the bracket when they leave it; beyond the grid counts as
outside the body. `scatterers.kernels.sphere_maps` has the compiled functions.

Sources: Derivations, B4.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.polynomial import polynomial

from creeping._typing import BoolArray, FloatArray
from scatterers.body import SphereMapped
from scatterers.cached import cached
from scatterers.kernels.compiled import Compiled, evaluated
from scatterers.kernels.tensor import DEGREE, REACH

# centroids this near to a parallel of the axis, in half widths, make no spine
UPRIGHT = 0.01


class SpaceLevel(Protocol):
    """F in a box of space, as a sphere map needs it."""

    @property
    def box(self) -> FloatArray:
        """Box (2, 3) in which F is known, L."""
        ...

    def flat(self, of_map: FloatArray) -> FloatArray:
        """Parameters of the compiled functions, those of a map among them."""
        ...

    @property
    def sources(self) -> Mapping[str, Callable[..., None]]:
        """Plain Python of its "level" and of the "forward" sphere map over it; see `kernels.compiled`."""
        ...


@dataclass(frozen=True, eq=False)
class Spine:
    """Shift across one axis as polynomials of the place along it, constant from `REACH` times their range on.

    Attributes
    ----------
    axis : int
        The axis along which the spine runs.
    middle, half : float
        The range middle +- half of that coordinate, L.
    shifts : (DEGREE + 1, 3)
        Coefficients of the powers of (x_axis - middle)/half for the shifts along x, y and z, L; zero along the axis.
    """

    axis: int
    middle: float
    half: float
    shifts: FloatArray

    @property
    def upright(self) -> bool:
        """Whether there is no shift."""
        return not np.any(self.shifts)

    def shift(self, points: FloatArray) -> FloatArray:
        """T(w) - w = x - T^-1(x), L: (..., 3) -> (..., 3)."""
        t: FloatArray = (np.asarray(points, dtype=float)[..., self.axis] - self.middle) / self.half
        return np.moveaxis(np.asarray(polynomial.polyval(t.clip(-REACH, REACH), self.shifts)), 0, -1)

    def slope(self, points: FloatArray) -> FloatArray:
        """Derivative of the shift along the axis, without unit: (..., 3) -> (..., 3)."""
        t: FloatArray = (np.asarray(points, dtype=float)[..., self.axis] - self.middle) / self.half
        found = polynomial.polyval(t.clip(-REACH, REACH), polynomial.polyder(self.shifts)) / self.half
        return np.moveaxis(np.where(np.abs(t) > REACH, 0.0, found), 0, -1)

    def pulled(self, points: FloatArray, gradient: FloatArray) -> FloatArray:
        """DT^T grad F at points w or x: (..., 3) -> (..., 3)."""
        out = gradient.copy()
        out[..., self.axis] += np.sum(self.slope(points) * gradient, axis=-1)
        return out

    @classmethod
    def through(cls, inside: BoolArray, origin: FloatArray, spacing: FloatArray) -> "Spine":
        """Least-squares spine of the slices of the nodes inside a body, weighted by their areas.

        A shift within `UPRIGHT` of a constant, by the weighted mean square, is left out.
        """
        where = np.argwhere(inside)
        low, high = where.min(0), where.max(0)
        axis = int(np.argmax((high - low + 1) * spacing))
        middle, half = 0.5 * (low + high) * spacing + origin, 0.5 * (high - low + 1) * spacing
        area = np.bincount(where[:, axis], minlength=inside.shape[axis])
        slices = np.flatnonzero(area)
        area = area[slices]
        t = (origin[axis] + slices * spacing[axis] - middle[axis]) / half[axis]
        root, shifts = np.sqrt(area), np.zeros((DEGREE + 1, 3))
        # few slices determine few coefficients
        degree = min(DEGREE, len(slices) // 2)
        for across in (axis - 1, axis - 2):
            centroid = np.bincount(where[:, axis], where[:, across])[slices] / area * spacing[across] + origin[across]
            off = centroid - np.average(centroid, weights=area)
            if np.sqrt(np.average(off**2, weights=area)) > UPRIGHT * half[across]:
                shifts[: degree + 1, across] = polynomial.polyfit(t, centroid, degree, w=root)
        return cls(axis, float(middle[axis]), float(half[axis]), shifts)

    @classmethod
    def none(cls) -> "Spine":
        """No shift."""
        return cls(2, 0.0, 1.0, np.zeros((DEGREE + 1, 3)))


@dataclass(frozen=True, eq=False)
class RadialMap(SphereMapped):
    """The map over an F known in a box.

    Attributes
    ----------
    space : SpaceLevel
    centre, half_axes : (3,), L
        Of the body with upright spine.
    spine : Spine
    iterative : bool
        That psi is a search for a root: users who evaluate it often had better tabulate it.
    """

    space: SpaceLevel
    centre: FloatArray
    half_axes: FloatArray
    spine: Spine
    iterative = True

    @cached
    def box(self) -> FloatArray:
        """Box (2, 3) about the centre that contains the sheared grid, L."""
        ends = np.repeat(np.linspace(-REACH, REACH, 129)[:, None], 3, axis=1) * self.spine.half + self.spine.middle
        shift = self.spine.shift(ends)
        return np.asarray(self.space.box - self.centre - np.stack([shift.max(0), shift.min(0)]))

    def facing(self, points: FloatArray) -> FloatArray:
        """g.(w - c) at points of the body, positive where rays leave it: (..., 3) -> (...)."""
        _, gradient, _ = evaluated(self.compiled_level, points)
        y = points - self.spine.shift(points) - self.centre
        return np.asarray(np.sum(self.spine.pulled(points, gradient) * y, axis=-1))

    @cached_property
    def parameters(self) -> FloatArray:
        """Parameters that all compiled functions share."""
        return self.space.flat(self.header)

    @cached_property
    def header(self) -> FloatArray:
        """Parameters of the map, as `scatterers.kernels.tensor` orders them."""
        spine = self.spine
        along = [spine.axis, spine.middle, 0.0 if spine.upright else 1 / spine.half]
        parts = [self.centre, self.half_axes, np.array(along, dtype=float), spine.shifts.T.ravel(), self.box.ravel()]
        return np.concatenate(parts)

    @cached_property
    def compiled_level(self) -> Compiled:
        """Compiled F, grad F and Hessian."""
        return Compiled(self.space.sources["level"], "level", self.parameters)

    @cached_property
    def compiled_forward(self) -> Compiled:
        """Compiled psi and its derivative."""
        return Compiled(self.space.sources["forward"], "forward", self.parameters)

    @cached_property
    def compiled_inverse(self) -> Compiled:
        """Compiled psi^-1."""
        from scatterers.kernels.sphere_maps import inverse

        return Compiled(inverse, "inverse", self.parameters)

    @cached_property
    def compiled_locator(self) -> Compiled:
        """Compiled locator of the six charts over psi."""
        from scatterers.kernels.sphere_maps import locate

        return Compiled(locate, "locator", self.parameters)
