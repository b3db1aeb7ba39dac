"""What pictures and files read of a shadow line, a fan, an iso-phase curve and a far field, and nothing more."""

from collections.abc import Sequence
from typing import Protocol

from numpy.typing import NDArray

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.geometry.surface import Surface

LINE_STATUSES = ("attached", "occluded", "concave")


class ShadowCurveLike(Protocol):
    """One closed curve of the shadow line; its last point does not repeat the first."""

    @property
    def points(self) -> FloatArray:
        """Points (n, 3), L."""
        ...

    @property
    def arclength(self) -> FloatArray:
        """Arclength (n,), L."""
        ...

    @property
    def status(self) -> NDArray[Any]:
        """One of ``LINE_STATUSES`` per point (n,)."""
        ...


class ShadowLineLike(Protocol):
    """The shadow line n.d = 0 of a body."""

    @property
    def body(self) -> Surface: ...
    @property
    def direction(self) -> FloatArray:
        """Unit vector (3,), where the wave travels."""
        ...

    @property
    def curves(self) -> Sequence[ShadowCurveLike]: ...


class RayFanLike(Protocol):
    """The creeping rays and what they carry along."""

    @property
    def body(self) -> Surface: ...
    @property
    def points(self) -> FloatArray:
        """Points (rays, steps, 3), L."""
        ...

    @property
    def directions(self) -> FloatArray:
        """Unit tangents (rays, steps, 3)."""
        ...

    @property
    def travel_time(self) -> FloatArray:
        """Travel time (steps,)."""
        ...

    @property
    def eikonal(self) -> FloatArray:
        """Eikonal (rays, steps)."""
        ...

    @property
    def spreading(self) -> FloatArray:
        """Spreading J (rays, steps)."""
        ...

    @property
    def spreading_rate(self) -> FloatArray:
        """Its rate J' (rays, steps)."""
        ...

    @property
    def curvature(self) -> FloatArray:
        """Normal curvature kappa_n along the ray (rays, steps), 1/L."""
        ...

    @property
    def attenuation(self) -> FloatArray:
        """Integral of c max(kappa_n, 0)^(2/3) over travel time (rays, steps), L^(1/3)."""
        ...

    @property
    def caustic_index(self) -> IntArray:
        """Zeros of J passed (rays, steps)."""
        ...

    @property
    def status(self) -> IntArray:
        """Status code (rays,)."""
        ...

    @property
    def curve_index(self) -> IntArray:
        """Curve of the shadow line that the ray left (rays,)."""
        ...

    @property
    def detachment(self) -> FloatArray:
        """Travel time (rays,) at which kappa_n is first <= 0, inf if never."""
        ...


class IsoPhaseCurveLike(Protocol):
    """One curve of constant travel time or eikonal."""

    @property
    def level(self) -> float: ...
    @property
    def of(self) -> str:
        """Either "travel_time" or "eikonal"."""
        ...

    @property
    def points(self) -> FloatArray:
        """Points (m, 3), L."""
        ...

    @property
    def closed(self) -> bool: ...
    @property
    def parameter_pieces(self) -> Sequence[FloatArray]:
        """Parameters (k, 2), radians, split at the periodic seam."""
        ...


class FarFieldLike(Protocol):
    """A far field in m directions, with its parts."""

    @property
    def directions(self) -> FloatArray:
        """Unit vectors (m, 3) towards the observers."""
        ...

    @property
    def creeping(self) -> ComplexArray:
        """Part (m,) or (m, 2, 2), L."""
        ...

    @property
    def reflected(self) -> ComplexArray:
        """Part (m,) or (m, 2, 2), L."""
        ...

    @property
    def forward(self) -> ComplexArray:
        """Part (m,) or (m, 2, 2), L."""
        ...

    @property
    def total(self) -> ComplexArray:
        """Sum of the parts."""
        ...

    @property
    def method(self) -> NDArray[Any]:
        """What served each direction (m,)."""
        ...

    @property
    def unresolved(self) -> BoolArray:
        """Directions (m,) where a part was not found or its expansion fails."""
        ...

    @property
    def wavenumber(self) -> float: ...
    @property
    def boundary(self) -> str: ...
    @property
    def order(self) -> int: ...
