"""What a phase map is to be: the parameters of one build, checked."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import Any
from creeping.errors import InvalidInputError
from creeping.geodesics.equations import natural_horizon
from creeping.geometry.arguments import flag, number_between, positive_number, shown, whole_number
from creeping.geometry.surface import Surface, size
from creeping.phaseflow.coordinates import AmbientModel, Model, model_of
from creeping.phaseflow.splines import MARGIN, least_cells
from creeping.storage.memory import within_budget

RAYS = 1_000_000
"""Rays for which a map is tuned unless their number is known: what a build may cost follows from it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class MapSpec:
    """Checked parameters of one build.

    Attributes
    ----------
    body, tolerance, length, n_steps, n_rays, horizon, grid, degree, precision, carry_jacobi, method, time_step, stages
        As for `build_phase_map`.
    seconds : float
        Of direct integration, nominal, if that is the other choice: what tuning and rays may take.
    """

    body: Surface
    tolerance: float | None = None
    length: float | None = None
    n_steps: int = 1
    n_rays: int = RAYS
    horizon: float | None = None
    grid: tuple[int, ...] | None = None
    degree: int | None = None
    precision: str | None = None
    carry_jacobi: bool = True
    method: str = "direct"
    time_step: float | None = None
    stages: int | None = None
    seconds: float = float("inf")

    def __post_init__(self) -> None:
        self._plain_numbers()
        tolerance, precision = self.tolerance, self.precision
        for name, value, most in (("horizon", self.horizon, 256.0), ("length", self.length, 1e5)):
            # a length of some sizes need not wait for what the curvature of the body says
            if value is not None and value > 8 * size(self.body) and value > most * natural_horizon(self.body):
                raise InvalidInputError(
                    f"{name} = {value:g} is more than {most:g} times the {natural_horizon(self.body):.3g} over which "
                    "a ray turns; give a shorter one"
                )
        if self.length is not None and tolerance is None:
            raise InvalidInputError("length belongs to a tolerance: give both, or horizon and grid alone")
        if self.n_steps > 1 and self.length is None:
            raise InvalidInputError(f"n_steps = {self.n_steps!r}: give the length they divide as well")
        for name in ("degree", "precision", "method"):
            if not isinstance(getattr(self, name), (str, int, type(None))):
                raise InvalidInputError(f"{name} = {shown(getattr(self, name))} is neither a text nor a number")
        if self.degree not in (None, 3, 5):
            raise InvalidInputError(f"degree = {self.degree!r}: splines of degree 3 and 5 are built")
        if precision not in (None, "single", "double"):
            raise InvalidInputError(f"precision = {precision!r} is neither 'single' nor 'double'")
        if self.method not in ("direct", "tower"):
            raise InvalidInputError(f"method = {self.method!r} is neither 'direct' nor 'tower'")
        # what is wrong with the grid or the tower is found here
        if self.nodes is not None:
            cells = float(np.prod(self.nodes, dtype=float))
            # what nodes take while a map is built
            within_budget(1000.0 * cells, f"a grid of {self.nodes}", "give a coarser one")
        if self.method == "tower":
            if None in (self.horizon, self.grid, self.time_step, self.stages):
                raise InvalidInputError("method='tower' needs horizon, grid, time_step and stages")
            if precision == "single" or not self.carry_jacobi:
                raise InvalidInputError("method='tower' stores double precision with the Jacobi matrix")
            _ = self.tower
        elif self.time_step is not None or self.stages is not None:
            raise InvalidInputError("time_step and stages belong to method='tower'")

    def _plain_numbers(self) -> None:
        """Make numbers those of Python, which can be stored."""
        found: dict[str, Any] = {name: whole_number(getattr(self, name), name) for name in ("n_steps", "n_rays")}
        if self.tolerance is not None:
            found["tolerance"] = number_between(self.tolerance, "tolerance", 1e-9, 1e-1)
        for name in ("horizon", "length"):
            if getattr(self, name) is not None:
                found[name] = positive_number(getattr(self, name), name)
        found["carry_jacobi"] = flag(self.carry_jacobi, "carry_jacobi")
        within_budget(64.0 * found["n_steps"], f"{found['n_steps']} steps", "ask for fewer")
        for name, value in found.items():
            object.__setattr__(self, name, value)

    @cached_property
    def model(self) -> Model:
        """Coordinates of the map."""
        return AmbientModel(self.body) if self.method == "tower" else model_of(self.body)

    @cached_property
    def nodes(self) -> tuple[int, int, int] | None:
        """Nodes of the grid along u, v and the angle, if it is given."""
        return None if self.grid is None else _nodes(self.grid, self.degree or 5, self.model)

    @cached_property
    def tower(self) -> tuple[float, int, int] | None:
        """Burn-in tau, B and S, for method "tower": B = (T0/tau)^(1/S) is a whole number >= 2."""
        if self.method != "tower":
            return None
        horizon: Any = self.horizon
        time_step, stages = positive_number(self.time_step, "time_step"), whole_number(self.stages, "stages")
        if time_step >= horizon:
            raise InvalidInputError(
                f"time_step = {time_step!r} and stages = {stages!r} do not make a tower below {horizon:g}"
            )
        base = (horizon / time_step) ** (1 / stages)
        if abs(base - round(base)) > 1e-9 * base or round(base) < 2:
            raise InvalidInputError(f"(horizon/time_step)^(1/stages) = {base:.6g} is not a whole number >= 2")
        return horizon / round(base) ** stages, round(base), stages

    @property
    def magnitude(self) -> float:
        """Rays for which a map is tuned: their number to a power of ten, or hardly a map would be found again."""
        return float(10.0 ** round(float(np.log10(self.n_rays))))

    def key(self) -> dict[str, Any]:
        """Parameters that decide the result, for the cache; the names are those of the maps that are stored."""
        burn_in, _, stages = self.tower or (None, 0, 0)
        return {
            "tolerance": self.tolerance,
            "length": self.length,
            "outputs": self.n_steps,
            "rays": round(float(np.log10(self.n_rays))),
            "horizon": self.horizon,
            "nodes": self.nodes and list(self.nodes),
            "degree": self.degree,
            "precision": self.precision,
            "ride_along": self.carry_jacobi,
            "method": self.method,
            "time_step": burn_in,
            "stages": stages,
        }


def _nodes(grid: tuple[int, ...], degree: int, model: Model) -> tuple[int, int, int]:
    try:
        if not isinstance(grid, (tuple, list, np.ndarray)) or len(grid) > 3:
            raise TypeError
        nodes = tuple(int(n) for n in grid)
        whole = all(n == g for n, g in zip(nodes, grid, strict=True))
    except (TypeError, ValueError):
        nodes, whole = (), False
    if len(nodes) == 2:
        nodes = (nodes[0], *nodes)
    if model.is_flat and len(nodes) == 3:
        nodes = (1, *nodes[1:])
    cells = least_cells(model.body)
    least = [degree + 1 if wraps else max(degree + 5, cells + 1 + 2 * MARGIN) for wraps in model.periodic]
    least = [*([1] if model.is_flat else least[:1]), least[1], degree + 1]
    if len(nodes) != 3 or not whole or any(n < m for n, m in zip(nodes, least, strict=True)):
        raise InvalidInputError(
            f"grid = {shown(grid)}: give two or three whole numbers of at least {least} for degree {degree}"
        )
    return nodes
