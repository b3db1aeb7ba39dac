"""Body F(x, y, z) = 0 from an expression: differentiated by sympy, compiled, and examined before use.

The body is looked for on grids (`scatterers.expression.search`): F < 0 in one connected region inside the box, F > 0 in
one around it. Then places are looked for where it is not smooth (`scatterers.expression.singularities`).
"""

import hashlib
import reprlib
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scatterers.base.body import numbers
from scatterers.base.level_body import LevelBody
from scatterers.expression.search import FINE, SIZES, examine, found_box, samples_of, tightened
from scatterers.expression.singularities import refuse_edges, refuse_kinks, singular_points
from scatterers.expression.space import ExpressionSpace
from scatterers.sphere_map.star import star_map
from scatterers.spline.samples import Samples

FloatArray = NDArray[np.float64]
MOST_TIPS = 8
BUMP = 2.4
"""Reach of a non-smooth place in widths of the bump, exp(-r^4), that rounds a tip off: beyond, below rounding."""
TIP = 0.025
"""Distance from a singular point within which the body counts as non-smooth, in diagonals of its box."""


class Implicit(LevelBody):
    """Body F < 0 given by an expression in x, y, z, such as ``"x**2/1.44 + y**2 + z**2 - 1"``.

    Parameters
    ----------
    expression : str
        Numbers, x, y, z, pi, + - * / **, parentheses, sqrt, exp, log, sin, cos, tan, sinh, cosh, tanh, and
        where(x < 0, a, b) of pieces that join smoothly; negative inside the body, positive outside.
    bounds : (2, 3) array_like, optional
        Box that contains the body and nothing else, L; found if not given, for bodies that a cube about the origin with
        half width 2^-8 to 2^12 resolves.
    centre : (3,) array_like, optional
        Point that sees the whole body from within, L; only star-shaped bodies have one.
    allow_rough : bool
        Take a body with tips, points where grad F = 0. They are rounded off within a fortieth of the box's diagonal;
        `non_smooth` says where, and rays that come there end.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If the expression contains anything else, or F = 0 is empty, open, unbounded, not finite, not connected, has a
        cavity, a point where grad F = 0, an edge, or unbounded curvature.

    Examples
    --------
    >>> import scatterers as sc
    >>> body = sc.Implicit("x**2/4 + y**2 + z**2 - 1", bounds=[[-2.2, -1.1, -1.1], [2.2, 1.1, 1.1]])
    >>> body.gradient([2.0, 0.0, 0.0])
    array([1., 0., 0.])
    >>> body.star_shaped
    True
    """

    def __init__(
        self,
        expression: str,
        bounds: ArrayLike | None = None,
        *,
        centre: ArrayLike | None = None,
        allow_rough: bool = False,
        speed: Any = None,
    ) -> None:
        if not isinstance(allow_rough, bool):
            raise ValueError(f"allow_rough = {allow_rough!r} is neither True nor False")
        everywhere = ExpressionSpace(expression, np.array([[-SIZES[-1]] * 3, [SIZES[-1]] * 3]))
        self.expression = expression
        self.speed = speed
        self._set_speed()
        box = found_box(everywhere) if bounds is None else _box(bounds)
        samples = samples_of(everywhere, box, FINE)
        examine(expression, samples, bounds is not None)
        if np.all(np.ptp(samples.inside, axis=0) < 0.5 * np.ptp(box, axis=0)):
            # a wide box shows little of the body
            box = np.clip(tightened(everywhere, samples), box[0], box[1])
            samples = samples_of(everywhere, box, FINE)
            examine(expression, samples, True)
        given = None if centre is None else _point(centre)
        self._shape(expression, samples, given)
        found = self._singular(samples)
        if len(found) and not allow_rough:
            raise ValueError(
                f"F = 0 is not smooth: grad F = 0 at {len(found)} of its points, first {tuple(found[0].tolist())}; "
                "a tip, an edge or a crossing there has no creeping rays: "
                "round it off, or allow non-smooth places, where rays end"
            )
        if len(found):
            self._round(found, samples, given)
        refuse_edges(self.compiled, samples.crossings(), float(samples.spacing.max()))
        refuse_kinks(self.compiled, samples.crossings(), float(samples.spacing.max()), self._diagonal)

    def _shape(self, expression: str, samples: Samples, centre: FloatArray | None) -> None:
        space = ExpressionSpace(expression, np.stack([samples.origin, samples.far_corner]))
        sphere_map, failure = star_map(space, samples, centre)
        if sphere_map is None and centre is not None:
            raise ValueError(failure)
        self._place(space, samples, sphere_map)

    def _round(self, tips: FloatArray, samples: Samples, centre: FloatArray | None) -> None:
        """Add a bump to F at each tip, so that a smooth cap, within the non-smooth place, stands for it."""
        if len(tips) > MOST_TIPS:
            raise ValueError(
                f"F = 0 is not smooth: grad F = 0 at {len(tips)} of its points, more than the {MOST_TIPS} tips that "
                "are rounded off; an edge, or F that does not change sign linearly: write it otherwise"
            )
        self._non_smooth, self._reach = tips, TIP * self._diagonal
        width, expression = self._reach / BUMP, self.expression
        sphere = np.random.default_rng(0).normal(size=(2000, 3))
        sphere *= 0.5 * width / np.linalg.norm(sphere, axis=1, keepdims=True)
        for tip in tips:
            depth = -float(np.min(self.level(tip + sphere)))
            squares = "+".join(f"({name}-({value!r}))**2" for name, value in zip("xyz", tip.tolist(), strict=True))
            expression += f"+({depth!r})*exp(-(({squares})/{width**2!r})**2)"
        self._shape(expression, samples, centre)
        if len(left := self._singular(samples)):
            raise ValueError(
                f"F = 0 is not smooth at {len(tips)} points, and not with them rounded either (at "
                f"{tuple(left[0].tolist())}): an edge or a crossing of parts; round it off in F"
            )

    @property
    def _diagonal(self) -> float:
        return float(np.linalg.norm(self._bounds[1] - self._bounds[0]))

    def _singular(self, samples: Samples) -> FloatArray:
        return singular_points(self.compiled, samples.crossings(), self._diagonal)

    def __repr__(self) -> str:
        return f"Implicit({self.expression!r}, speed={self.speed!r})"

    @cached_property
    def _named(self) -> str:
        # what is stored depends on the box and by it on the sphere map, too
        header = np.zeros(0) if self._map is None else self._map.header
        numbers = np.concatenate([self._space.box.ravel(), header])
        return f"{self.expression!r}, {hashlib.blake2b(numbers.tobytes(), digest_size=8).hexdigest()}"

    def _identity(self) -> str:
        return self._named


def _box(bounds: ArrayLike) -> FloatArray:
    try:
        box = numbers(bounds)
    except (TypeError, ValueError):
        raise ValueError(f"bounds {reprlib.repr(bounds)} are not numbers; give ((x0, y0, z0), (x1, y1, z1))") from None
    if box.shape != (2, 3) or not np.all(np.isfinite(box)) or not np.all(box[1] > box[0]):
        raise ValueError(f"bounds {box.tolist()} are no box; give ((x0, y0, z0), (x1, y1, z1)) with x0 < x1 etc.")
    return box


def _point(centre: ArrayLike) -> FloatArray:
    try:
        point = numbers(centre)
    except (TypeError, ValueError):
        raise ValueError(f"centre {reprlib.repr(centre)} is not a point; give (x, y, z)") from None
    if point.shape != (3,) or not np.all(np.isfinite(point)):
        raise ValueError(f"centre {centre!r} is not a point; give (x, y, z)")
    return point
