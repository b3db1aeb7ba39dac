"""Rays traced one by one, each with its incidence, start and end."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray
from creeping.rays.quantities import RayPoints


@dataclass(frozen=True, eq=False)
class SingleRays:
    """Rays (n,), each with its incidence.

    Attributes
    ----------
    directions : (n, 3)
    starts : (n, 3), L
        Launch points.
    tangents : (n, 3)
        Of the shadow line there.
    rays : RayPoints
        (n,) Where each ends.
    risen : (n,) of bool
        Whether n.r > 0 somewhere before, of rays traced for observers r.
    """

    directions: FloatArray
    starts: FloatArray
    tangents: FloatArray
    rays: RayPoints
    risen: BoolArray

    def __getitem__(self, index: Any) -> "SingleRays":
        """Part of the rays."""
        return SingleRays(
            self.directions[index], self.starts[index], self.tangents[index], self.rays[index], self.risen[index]
        )

    @classmethod
    def joined(cls, parts: Sequence["SingleRays"]) -> "SingleRays":
        """All parts as one."""
        names = ("directions", "starts", "tangents", "risen")
        directions, starts, tangents, risen = (np.concatenate([getattr(p, name) for p in parts]) for name in names)
        return cls(directions, starts, tangents, RayPoints.joined([part.rays for part in parts]), risen)
