"""What a sweep computes for each incidence, and the layout of its results.

Every quantity gives the shadow line of each incidence; "rays" adds its fan, "monostatic" the field in the direction
the wave came from, "bistatic" that in given directions. Results are arrays whose first axis is the incidence.
"""

import sys
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, get_args

import numpy as np

from creeping._typing import Any, ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked, checked_across
from creeping.field.boundary import BoundaryLike, boundary_name, parse_boundary
from creeping.field.routes import by_equation_alone
from creeping.geometry.arguments import real_array
from creeping.geometry.directions import unit_directions
from creeping.geometry.evaluators import speed_of
from creeping.geometry.surface import Surface, why_no_rays
from creeping.rays.reach import AUTO, asked_length, body_length
from creeping.shadow.status import INCIDENCE_STATUSES, LineStatus
from creeping.sweeping.lattice import Lattice, lattice_of

Quantity = Literal["rays", "monostatic", "bistatic"]
QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)
METHODS = ("rays", "auto", "currents", "equation", "t-matrix")
MOST_RAYS, MOST_STEPS, MOST_WAVENUMBERS = 65_536, 4096, 100_000
SHARES = ("attached", "occluded", "concave")
AMPLITUDES = {
    "total": "far-field amplitude f",
    "creeping": "far-field amplitude of the creeping rays, where rays serve",
    "reflected": "far-field amplitude of the reflected rays, where rays serve",
    "forward": "far-field amplitude of the forward lobe, where rays serve",
}


class Variable(NamedTuple):
    """One array of results: its dimensions after the incidence, type, what it is, whether it may be unknown."""

    dims: tuple[str, ...]
    dtype: str
    units: str
    description: str
    unknown: bool = True

    @property
    def fill(self) -> Any:
        """Value where nothing is given."""
        kind = np.dtype(self.dtype).kind
        return {"f": np.nan if self.unknown else 0.0, "c": complex(np.nan, np.nan), "b": self.unknown}.get(kind, -1)


LINE = {
    "incidence_status": Variable((), "int8", "1", "; ".join(f"{k} {v}" for k, v in INCIDENCE_STATUSES.items())),
    "curves": Variable((), "int16", "1", "closed curves of the shadow line"),
    "line_length": Variable((), "float64", "L", "length of the shadow line"),
    "line_error": Variable((), "float64", "1", "estimated relative error of the length"),
    "attached": Variable((), "float64", "1", "share of the length that launches rays"),
    "occluded": Variable((), "float64", "1", "share of the length that the wave does not reach"),
    "concave": Variable((), "float64", "1", "share of the length in concave regions"),
    "singular_distance": Variable((), "float64", "1", "least |n.d| at a critical point of n.d, n = +-d apart"),
}
RAYS = {
    "ray_status": Variable(("ray",), "int8", "1", "codes of RayStatus; -1 where there is no ray"),
    "curve_index": Variable(("ray",), "int16", "1", "curve of the shadow line, the longest first"),
    "arclength": Variable(("ray",), "float64", "L", "of the launch point along its curve"),
    "launch_phase": Variable(("ray",), "float64", "L", "d.x0; the eikonal is this plus the travel time"),
    "detachment": Variable(("ray",), "float64", "L", "travel time at which the creeping ray ends, inf if it does not"),
    "points": Variable(("ray", "step", "axis"), "float64", "L", "points of the rays"),
    "directions": Variable(("ray", "step", "axis"), "float64", "1", "their tangents"),
    "spreading": Variable(("ray", "step"), "float64", "1", "J"),
    "spreading_rate": Variable(("ray", "step"), "float64", "1/L", "J'"),
    "attenuation": Variable(("ray", "step"), "float64", "L^(1/3)", "integral of kappa_n^(2/3) along the ray"),
}
CURVED = {
    "least_radius": Variable((), "float64", "L", "least radius of curvature along the direction at the launch points"),
    "transverse": Variable(
        (), "float64", "L^(-2/3)", "largest kappa_t rho/m^2 at the launch points times k^(2/3), whatever k"
    ),
}
VALID = {
    "least_k_rho": Variable(("wavenumber",), "float64", "1", "least k rho on the rays, as creeping.validity"),
    "largest_transverse": Variable(("wavenumber",), "float64", "1", "largest kappa_t rho/m^2, as creeping.validity"),
}


@dataclass(frozen=True)
class SweepRequest:
    """What is computed for each incidence.

    Attributes
    ----------
    quantity : {"rays", "monostatic", "bistatic"}
    length : float, L (travel time for a weighted body)
        Of the rays.
    n_rays : int
        Rays of an incidence, shared among the attached arcs by length.
    n_steps : int
        Outputs of "rays", at equal steps of travel time; the last at ``length``.
    wavenumbers : tuple of float, 1/L
        Of the fields.
    boundaries : tuple of str
        "soft", "hard", "pec" or "impedance:ETA".
    observation : tuple of (x, y, z)
        Unit directions of "bistatic".
    order : 2 or 1
        Of the creeping waves.
    method : {"rays", "auto", "currents", "equation", "t-matrix"}
        Of the fields: isolated rays, currents of the whole body where rays do not resolve an incidence, or for all,
        the body's integral equation for all, or its T-matrix.
    accuracy : float, optional
        Of fields: error allowed to interpolation between incidences; without it each is computed.
    lattice : Lattice, optional
        Nodes of the interpolation; without it there are too few incidences for one.
    """

    quantity: Quantity
    length: float
    n_rays: int = 256
    n_steps: int = 1
    wavenumbers: tuple[float, ...] = ()
    boundaries: tuple[str, ...] = ()
    observation: tuple[tuple[float, float, float], ...] = ()
    order: int = 2
    method: str = "rays"
    accuracy: float | None = None
    lattice: Lattice | None = None

    def __post_init__(self) -> None:
        mistakes = list(self._mistakes())
        if mistakes:
            raise InvalidInputError("; ".join(mistakes), mistakes=mistakes)

    def _mistakes(self) -> Any:
        """All that is wrong, not the first only."""
        if not isinstance(self.quantity, str) or self.quantity not in QUANTITIES:
            yield f"quantity = {self.quantity!r} is none of {', '.join(QUANTITIES)}"
            return
        if not _is_length(self.length):
            yield f"length = {self.length!r} is not a positive finite number"
        for name, most in (("n_rays", MOST_RAYS), ("n_steps", MOST_STEPS)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= most:
                yield f"{name} = {value!r} is not a whole number from 1 to {most}"
        if self.accuracy is not None:
            if not (isinstance(self.accuracy, float) and 0 < self.accuracy < 1):
                yield f"accuracy = {self.accuracy!r} is not a number between 0 and 1"
            elif self.method in ("currents", "equation", "t-matrix"):
                yield f'accuracy goes with rays; method "{self.method}" computes every incidence'
        if self.quantity == "rays":
            if self.accuracy is not None:
                yield "accuracy is of interpolated fields; rays of every incidence are traced: leave it out"
            for name in ("wavenumbers", "boundaries", "observation"):
                if getattr(self, name):
                    yield f"{name} belong to a field; quantity 'rays' has none"
            if self.method != "rays":
                yield f"method = {self.method!r} is of a field; quantity 'rays' has none"
            return
        for name in ("wavenumbers", "boundaries"):
            if not getattr(self, name):
                yield f"quantity {self.quantity!r} needs {name}"
        checks = [(parse_boundary, (name,)) for name in self.boundaries]
        for check, asked in [*checks, *((checked, (k, self.order)) for k in self.wavenumbers)]:
            try:
                check(*asked)  # type: ignore[operator]
            except InvalidInputError as error:
                yield str(error)
        if len(set(self.boundaries)) < len(self.boundaries):
            yield f"boundaries {list(self.boundaries)} repeat themselves"
        if not isinstance(self.method, str) or self.method not in METHODS:
            yield f"method = {self.method!r} is none of {', '.join(METHODS)}"
        elif self.method != "rays" and self.order != 2:
            yield f"method = {self.method!r} has no order {self.order}; give method 'rays'"
        if (self.quantity == "bistatic") != bool(self.observation):
            remedy = (
                "needs observation directions: give observation=, unit vectors (m, 3) from the body to the observers"
                if self.quantity == "bistatic"
                else "has none; observation directions belong to quantity 'bistatic'"
            )
            yield f"quantity {self.quantity!r} {remedy}"

    @property
    def scalar_boundaries(self) -> tuple[str, ...]:
        """Boundaries of scalar problems, all but "pec"."""
        return tuple(b for b in self.boundaries if b != "pec")

    @property
    def problems(self) -> list[tuple[str, tuple[int, ...], str]]:
        """Each boundary with its place among the scalar ones, none for "pec", and the suffix of its arrays."""
        return [(b, (), "_pec") if b == "pec" else (b, (self.scalar_boundaries.index(b),), "") for b in self.boundaries]

    @property
    def travel_times(self) -> FloatArray:
        """Times of the outputs of "rays": (n_steps,)."""
        return np.asarray(self.length * np.arange(1, self.n_steps + 1) / self.n_steps)

    @property
    def sizes(self) -> dict[str, int]:
        """Lengths of the dimensions, the incidence apart."""
        if self.quantity == "rays":
            return {"ray": self.n_rays, "step": self.n_steps, "axis": 3}
        sizes = {"boundary": len(self.scalar_boundaries), "wavenumber": len(self.wavenumbers), "observer": 1}
        return sizes | {"observer": len(self.observation), "scattered": 2, "incident": 2}

    @property
    def variables(self) -> dict[str, Variable]:
        """The arrays of results by name."""
        return self._own | (self._between if self.accuracy is not None else {})

    @property
    def _between(self) -> dict[str, Variable]:
        """What is said of interpolation."""
        found = {"interpolated": Variable((), "bool", "1", "whether its results are interpolated", False)}
        for name, of in self._own.items():
            if name.startswith("error"):
                text = "change of the amplitude with fewer nodes; 0 of what is computed"
                found[f"interpolation_{name}"] = Variable(of.dims, of.dtype, of.units, text, False)
        return found

    @property
    def _own(self) -> dict[str, Variable]:
        if self.quantity == "rays":
            return LINE | CURVED | RAYS
        observer = ("observer",) if self.quantity == "bistatic" else ()
        waves = {name: text for name, text in AMPLITUDES.items() if name != "forward" or self.quantity == "bistatic"}
        found = dict(LINE)
        if self.scalar_boundaries:
            dims = ("boundary", "wavenumber", *observer)
            found |= {name: Variable(dims, "complex128", "L", text) for name, text in waves.items()}
            found |= {name: Variable(dims, *of) for name, of in self._judged.items()}
        if "pec" in self.boundaries:
            dims = ("wavenumber", *observer)
            matrix = (*dims, "scattered", "incident")
            words = ", theta and phi scattered by theta and phi incident"
            found |= {f"{name}_pec": Variable(matrix, "complex128", "L", text + words) for name, text in waves.items()}
            sizes = {name: matrix if name == "error" else dims for name in self._judged}
            found |= {f"{name}_pec": Variable(sizes[name], *of) for name, of in self._judged.items()}
        return found | VALID

    @property
    def _judged(self) -> dict[str, tuple[Any, ...]]:
        """Type, unit and meaning of what is said of a field."""
        found: dict[str, tuple[Any, ...]] = {
            "error": ("float64", "L", "error of the amplitude's magnitude, as creeping.FarField.error"),
            "unresolved": ("bool", "1", "whether an expansion fails there, or the error is large"),
        }
        if self.method != "rays":
            found["by_currents"] = ("bool", "1", "whether currents of the whole body served, else isolated rays", False)
        return found

    def empty(self, count: int, *, filled: bool = True) -> dict[str, np.ndarray[Any, Any]]:
        """Arrays of results for ``count`` incidences, if ``filled`` with no-data values and status FAILED."""
        shapes = {name: (count, *(self.sizes[d] for d in v.dims)) for name, v in self.variables.items()}
        if not filled:
            return {name: np.empty(shapes[name], dtype=v.dtype) for name, v in self.variables.items()}
        out = {name: np.full(shapes[name], v.fill, dtype=v.dtype) for name, v in self.variables.items()}
        out["incidence_status"][:] = LineStatus.FAILED
        return out


def sweep_request(
    quantity: str,
    *,
    length: float,
    n_rays: int = 256,
    n_steps: int = 1,
    wavenumbers: ArrayLike = (),
    boundary: BoundaryLike | list[BoundaryLike] | tuple[BoundaryLike, ...] = (),
    observation: ArrayLike | None = None,
    order: int = 2,
    method: str = "rays",
    accuracy: float | None = None,
) -> SweepRequest:
    """Make a request of what users write: one boundary or a list, numbers or arrays.

    Raises
    ------
    InvalidInputError
        With all mistakes at once, as ``mistakes`` too.
    """
    several = boundary if isinstance(boundary, (list, tuple)) else (boundary,)
    if isinstance(wavenumbers, str):
        checked(wavenumbers, 2)  # type: ignore[arg-type]
    given = np.atleast_1d(real_array(wavenumbers, "wavenumbers"))
    if given.ndim > 1 or given.size > MOST_WAVENUMBERS:
        raise InvalidInputError(f"wavenumbers have shape {given.shape}; give a number or at most {MOST_WAVENUMBERS}")
    numbers = tuple(map(float, given))
    seen = np.zeros((0, 3)) if observation is None else real_array(observation, "observation directions")
    if seen.size or observation is not None:
        seen = unit_directions(seen, "observation directions").reshape(-1, 3)
    return SweepRequest(
        quantity=quantity,  # type: ignore[arg-type]
        length=_plain(length),
        n_rays=_plain(n_rays),
        n_steps=_plain(n_steps),
        wavenumbers=numbers,
        boundaries=tuple(boundary_name(b) for b in several),
        observation=tuple((float(x), float(y), float(z)) for x, y, z in seen),
        order=_plain(order),
        method=method,
        accuracy=None if accuracy is None else _plain(accuracy),
    )


def with_lattice(request: SweepRequest, incidences: FloatArray) -> SweepRequest:
    """The request with the lattice of unit directions (n, 3), where an accuracy is asked for and a lattice pays."""
    return request if request.accuracy is None else replace(request, lattice=lattice_of(incidences))


def solved_alone(body: Surface, request: SweepRequest, incidences: int) -> bool:
    """Whether the fields that are asked for need no rays: the integral equation gives them all."""
    if request.quantity == "rays" or request.accuracy is not None:
        return False
    checked_across(body, min(request.wavenumbers), max(request.wavenumbers))
    kinds = [parse_boundary(name) for name in request.boundaries]
    k = np.array(request.wavenumbers)
    return by_equation_alone(body, k, kinds, incidences, method=request.method, order=request.order)


def sweep_length(body: Surface, length: float | Literal["auto"], wavenumbers: ArrayLike, *, leap: float = 0.0) -> float:
    """Length of the rays of a sweep asked for as a number or as "auto": then for its lowest wavenumber, if it has any.

    An automatic length is one of whole leaps of a map, each of ``leap``, for what is left of one would be traced. What
    is no number is returned, no wavenumber left out, for `sweep_request` to name it with all other mistakes. A body
    without rays has none of any length; one that is absurdly small or large in wavelengths is refused.
    """
    try:
        known = np.atleast_1d(real_array(wavenumbers, "wavenumbers"))
    except InvalidInputError:
        known = np.zeros(0)
    known = known[np.isfinite(known) & (known > 0)]
    if known.size:
        checked_across(body, float(known.min()), float(known.max()))
    if why_no_rays(body):
        return 1.0
    if not (isinstance(length, str) and length == AUTO):
        return asked_length(body, float(length)) if _is_length(length) else length
    found = body_length(body, None if speed_of(body) is not None or not known.size else float(known.min()))
    # not of leaps that would lengthen it by 15 % or more
    return leap * float(np.ceil(found / leap - 1e-9)) if 0 < leap < 0.15 * found else found


def _is_length(value: Any) -> bool:
    # of a whole number that is no float numpy knows nothing
    return isinstance(value, (int, float)) and not isinstance(value, bool) and 0 < value <= sys.float_info.max


def _plain(value: Any) -> Any:
    """Number of Python for one of numpy: what is stored is that."""
    return value.item() if isinstance(value, np.generic) else value
