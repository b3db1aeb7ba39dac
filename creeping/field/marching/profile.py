"""What a ray is to the layer that is marched along it: curvatures, spreading and admittance along its length."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.errors import InvalidInputError

LEAST_NODES = 4
"""Of a piece between two jumps: curvatures are cubics between nodes."""


@dataclass(frozen=True, eq=False)
class RayProfiles:
    """Rays of a fan, or the two senses of a plane section, from lit ground on.

    Parameters
    ----------
    s : (rays, m), L
        Arc length on each ray's own nodes, ascending; 0, at the shadow line where p = d, is one of them. A node that
        stands twice parts two pieces: there curvatures and admittance may jump.
    curvature : (rays, m), 1/L
        kappa_n of the body along the ray, positive where convex.
    transverse : (rays, m), 1/L, optional
        kappa_t across the ray; 0 on a plane section.
    spreading : (rays, m), optional
        J, 1 at s = 0; 1 on a plane section.
    admittance : (rays, m) complex, optional
        eta along the ray, for an impedance; 0 if there is none.

    Raises
    ------
    InvalidInputError
        If shapes differ, values are not finite, or nodes do not ascend, lack 0, or are fewer than 4 on a piece.
    """

    s: FloatArray
    curvature: FloatArray
    transverse: FloatArray | None = None
    spreading: FloatArray | None = None
    admittance: ComplexArray | None = None

    def __post_init__(self) -> None:
        shape = np.shape(self.s)
        if len(shape) != 2 or shape[1] < LEAST_NODES:
            raise InvalidInputError(f"s has the shape {shape}; give (rays, m) with m >= {LEAST_NODES}")
        for name in ("s", "curvature", "transverse", "spreading", "admittance"):
            given: Any = getattr(self, name)
            if given is None:
                continue
            values = np.ascontiguousarray(given, dtype=complex if name == "admittance" else float)
            if values.shape != shape:
                raise InvalidInputError(f"{name} has the shape {values.shape}, s has {shape}")
            if not np.all(np.isfinite(values)):
                rays = np.sum(~np.all(np.isfinite(values), axis=1))
                raise InvalidInputError(f"{name} is not finite on {rays} of {shape[0]} rays")
            object.__setattr__(self, name, values)
        self._check_nodes()

    def _check_nodes(self) -> None:
        step = np.diff(self.s, axis=1)
        if np.any(step < 0):
            raise InvalidInputError(f"s descends on {np.sum(np.any(step < 0, axis=1))} of {len(step)} rays")
        if not np.all(np.any(self.s == 0, axis=1)):
            lacking = np.sum(~np.any(self.s == 0, axis=1))
            raise InvalidInputError(f"{lacking} of {len(step)} rays have no node at s = 0, on the shadow line")
        for ray in range(len(self)):
            ends = np.flatnonzero(np.concatenate([[True], step[ray] == 0, [True]]))
            if np.min(np.diff(ends)) < LEAST_NODES:
                raise InvalidInputError(f"ray {ray} has a piece of fewer than {LEAST_NODES} nodes")

    def __len__(self) -> int:
        return len(self.s)

    @cached_property
    def cubics(self) -> dict[str, Any]:
        """Coefficients (rays, m - 1, 4) of curvature, transverse, spreading and admittance, where given."""
        from creeping.field.kernels.ray_profile import cubics

        found = {}
        for name in ("curvature", "transverse", "spreading", "admittance"):
            values = getattr(self, name)
            if values is not None:
                out = np.empty((*values[:, 1:].shape, 4), values.dtype)
                for ray in range(len(self)):
                    cubics(self.s[ray], values[ray], out[ray])
                found[name] = out
        return found

    @cached_property
    def curves(self) -> FloatArray:
        """Angle psi and position x at the nodes of each ray's plane curve (rays, m, 3)."""
        from creeping.field.kernels.ray_profile import plane_curve

        out = np.empty((*self.s.shape, 3))
        origins = np.argmax(self.s == 0, axis=1)
        for ray in range(len(self)):
            plane_curve(self.s[ray], self.cubics["curvature"][ray], origins[ray], out[ray])
        return out

    def along(self, ray: int, at: FloatArray) -> FloatArray:
        """Kappa, psi and x (n, 4) of a ray at places (n,)."""
        from creeping.field.kernels.ray_profile import sample

        out = np.empty((len(at), 4))
        sample(self.s[ray], self.cubics["curvature"][ray], self.curves[ray], at, out)
        return out

    def cubics_of(self, name: str, ray: int) -> Any:
        """Cubics (m - 1, 4) of a quantity along a ray; of one that is not given, those of its constant."""
        if getattr(self, name) is not None:
            return self.cubics[name][ray]
        constant = np.zeros((self.s.shape[1] - 1, 4))
        constant[:, 0] = 1.0 if name == "spreading" else 0.0
        return constant

    def jumps(self, ray: int) -> FloatArray:
        """Places where the curvature may jump."""
        s = self.s[ray]
        return np.asarray(s[1:][np.diff(s) == 0])
