"""What a ray is to the layer that is marched along it: its curvatures, twist, spreading and admittance.

The layer sees the ground under a ray by kappa_n and kappa_t, by its torsion tau = b.dn/ds, b = n x p, and the wave by
how it varies along and across the ray:

    D y = Lambda y_s,   D = (1/J) [d/dsigma_perp - (d.x0)' d/ds]   along b on a wavefront
    V = K/2 + (J'/2J)^2

Where the ray leaves the line Lambda = tau/kappa_n; on a cylinder that the wave meets at an angle it stays so, and
cos^2 = 1/(1 + Lambda^2) is that of the ray's angle to the circle. Waves are traced on the plane curve with that
circle's curvature, kappa_n sqrt(1 + Lambda^2) by the ray's length.

Source: Derivations, F22.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.errors import InvalidInputError

GIVEN = ("curvature", "transverse", "spreading", "admittance", "torsion", "lean", "potential", "phase", "climb")
LEAST_NODES = 4
"""Nodes of a piece between two jumps: curvatures are cubics between nodes."""


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
        kappa_t across the ray; 0 on a plane section, as all that follow but J, which is 1.
    spreading : (rays, m), optional
        J, 1 at s = 0.
    admittance : (rays, m) complex, optional
        eta along the ray, for an impedance; 0 if there is none.
    torsion : (rays, m), 1/L, optional
        tau.
    lean : (rays, m), optional
        Lambda.
    potential : (rays, m), 1/L^2, optional
        V.
    phase : (rays, m), L, optional
        d.(x - x0) - s; that of the plane curve if not given.
    climb : (rays, m), optional
        d.n, likewise.

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
    torsion: FloatArray | None = None
    lean: FloatArray | None = None
    potential: FloatArray | None = None
    phase: FloatArray | None = None
    climb: FloatArray | None = None

    def __post_init__(self) -> None:
        shape = np.shape(self.s)
        if len(shape) != 2 or shape[1] < LEAST_NODES:
            raise InvalidInputError(f"s has the shape {shape}; give (rays, m) with m >= {LEAST_NODES}")
        for name in ("s", *GIVEN):
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
    def _known(self) -> dict[str, Any]:
        """What is given, and what follows from it: the bend of the plane curve and kappa_t - tau Lambda across it."""
        found = {name: getattr(self, name) for name in GIVEN if getattr(self, name) is not None}
        found["bend"], found["across"] = self.curvature, found.get("transverse", np.zeros_like(self.s))
        if self.lean is not None:
            found["bend"] = self.curvature * np.sqrt(1 + self.lean**2)
            if self.torsion is not None:
                found["across"] = found["across"] - self.torsion * self.lean
        return found

    @cached_property
    def _cubics(self) -> dict[str, Any]:
        """Cubics (rays, m - 1, 4) of what has been asked for."""
        return {}

    def cubics_of(self, name: str, ray: int) -> Any:
        """Cubics (m - 1, 4) of a quantity along a ray; of one that is not given, those of its constant."""
        if name not in self._cubics:
            self._cubics[name] = self._make_cubics(name)
        return self._cubics[name][ray]

    def _make_cubics(self, name: str) -> Any:
        from creeping.field.kernels.ray_profile import cubics

        if name in self._known:
            values = self._known[name]
        elif name == "phase":
            values = self.curves[..., 1] - self.s
        elif name == "climb":
            values = np.sin(self.curves[..., 0])
        else:
            values = np.full(self.s.shape, 1.0 if name == "spreading" else 0.0)
        out = np.empty((*values[:, 1:].shape, 4), values.dtype)
        for ray in range(len(self)):
            cubics(self.s[ray], values[ray], out[ray])
        return out

    @cached_property
    def curves(self) -> FloatArray:
        """Angle psi and position x at the nodes of each ray's plane curve (rays, m, 3)."""
        from creeping.field.kernels.ray_profile import plane_curve

        out = np.empty((*self.s.shape, 3))
        origins = np.argmax(self.s == 0, axis=1)
        for ray in range(len(self)):
            plane_curve(self.s[ray], self.cubics_of("bend", ray), origins[ray], out[ray])
        return out

    def along(self, ray: int, at: FloatArray) -> FloatArray:
        """Curvature, psi and x (n, 4) of a ray's plane curve at places (n,)."""
        from creeping.field.kernels.ray_profile import sample

        out = np.empty((len(at), 4))
        sample(self.s[ray], self.cubics_of("bend", ray), self.curves[ray], at, out)
        return out

    def value_of(self, name: str, ray: int, at: FloatArray) -> Any:
        """A quantity of a ray at places (n,)."""
        s, cubics = self.s[ray], self.cubics_of(name, ray)
        # the second of two nodes at a joint is the first of its piece
        i = np.clip(np.searchsorted(s, at, side="right") - 1, 0, len(s) - 2)
        i = np.where((i > 0) & (s[i + 1] <= s[i]), i - 1, i)
        t, c = at - s[i], cubics[i].T
        return c[0] + t * (c[1] + t * (c[2] + t * c[3]))

    def obliqueness(self, ray: int, at: FloatArray) -> FloatArray:
        """cos^2 = 1/(1 + Lambda^2) of a ray at places (n,)."""
        return np.asarray(1 / (1 + self.value_of("lean", ray, at) ** 2))

    def jumps(self, ray: int) -> FloatArray:
        """Places where the curvature may jump."""
        s = self.s[ray]
        return np.asarray(s[1:][np.diff(s) == 0])
