"""Body F(x, y, z) = 0 from an expression: differentiated by sympy, compiled, and examined before use.

The body is looked for on grids: F < 0 in one connected region inside the box, F > 0 around it in one connected region.
Its smallest |grad F| is looked for from the points of the body where |grad F| is small, by Newton steps on grad F = 0.
"""

import hashlib
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scatterers._expression_space import ExpressionSpace
from scatterers._level_body import LevelBody
from scatterers._samples import Samples
from scatterers._star import star_map
from scatterers._tensor_spline import evaluated

FloatArray = NDArray[np.float64]
SIZES = 2.0 ** np.arange(-8, 13)
"""Half widths of the cubes about the origin in which a body is looked for."""
COARSE, FINE = 33, 65
"""Nodes along a side of those cubes, and along the longest side of the box that is examined."""
SLACK = 0.12
"""By which the box is wider than the body, in its own half widths."""
SINGULAR = 1e-6
"""|grad F| on the body, relative to its median there, below which a point is singular."""
SUSPECTS = 200
CLOSER = 60
"""Steps of the search for kinks, each 0.7 times as wide as the last: it ends 1e-10 cells from where it leads."""
SHARPEST = 1e8
"""Curvature, in 1/diagonals of the box, beyond which a place is a kink; a disc of thickness 1e-3 radii has 3e6."""
MOST_TIPS = 8
BUMP = 2.4
"""Reach of the rough place in widths of the bump, exp(-r^4), that rounds a tip off: beyond, it is below rounding."""
TIP = 0.025
"""Distance from a singular point within which the body counts as rough, in diagonals of its box."""


class Implicit(LevelBody):
    """Body F < 0 given by an expression in x, y, z, such as ``"x**2/1.44 + y**2 + z**2 - 1"``.

    Parameters
    ----------
    expression : str
        Numbers, x, y, z, pi, + - * / **, parentheses and sqrt, exp, log, sin, cos, tan, sinh, cosh, tanh; negative
        inside the body, positive outside.
    bounds : (2, 3) array_like, optional
        Box that contains the body and nothing else, L; found if not given, for bodies that a cube about the origin with
        half width 2^-8 to 2^12 resolves.
    centre : (3,) array_like, optional
        Point that sees the whole body from within, L; only star-shaped bodies have one.
    allow_rough : bool
        Take a body with tips, points where grad F = 0. They are rounded off within a fortieth of the box's diagonal;
        `rough` says where, and rays that come there end.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If the expression contains anything else, or F = 0 is empty, open, unbounded, not finite, not connected, has a
        cavity, a point where grad F = 0, or unbounded curvature.
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
        everywhere = ExpressionSpace(expression, np.array([[-SIZES[-1]] * 3, [SIZES[-1]] * 3]))
        self.expression = expression
        self.speed = speed
        self._set_speed()
        box = _found(everywhere) if bounds is None else _box(bounds)
        samples = _samples(everywhere, box, FINE)
        _examine(expression, samples, bounds is not None)
        if np.all(np.ptp(samples.inside, axis=0) < 0.5 * np.ptp(box, axis=0)):
            # a wide box shows little of the body
            box = np.clip(_tightened(everywhere, samples), box[0], box[1])
            samples = _samples(everywhere, box, FINE)
            _examine(expression, samples, True)
        given = None if centre is None else _point(centre)
        self._shape(expression, samples, given)
        found = self._singular_points(samples.crossings())
        if len(found) and not allow_rough:
            raise ValueError(
                f"F = 0 is not smooth: grad F = 0 at {len(found)} of its points, first {tuple(found[0].tolist())}; "
                "a tip, an edge or a crossing there has no creeping rays: "
                "round it off, or allow rough places, where rays end"
            )
        if len(found):
            self._round(found, samples, given)
        self._refuse_kinks(samples)

    def _shape(self, expression: str, samples: Samples, centre: FloatArray | None) -> None:
        space = ExpressionSpace(expression, np.stack([samples.origin, samples.far_corner]))
        sphere_map, failure = star_map(space, samples, centre)
        if sphere_map is None and centre is not None:
            raise ValueError(failure)
        self._place(space, samples, sphere_map)

    def _round(self, tips: FloatArray, samples: Samples, centre: FloatArray | None) -> None:
        """Add a bump to F at each tip, so that a smooth cap, within the rough place, stands for it."""
        if len(tips) > MOST_TIPS:
            raise ValueError(
                f"F = 0 is not smooth: grad F = 0 at {len(tips)} of its points, more than the {MOST_TIPS} tips that "
                "are rounded off; an edge, or F that does not change sign linearly: write it otherwise"
            )
        diagonal = float(np.linalg.norm(self._bounds[1] - self._bounds[0]))
        self._rough, self._reach = tips, TIP * diagonal
        width, expression = self._reach / BUMP, self.expression
        sphere = np.random.default_rng(0).normal(size=(2000, 3))
        sphere *= 0.5 * width / np.linalg.norm(sphere, axis=1, keepdims=True)
        for tip in tips:
            depth = -float(np.min(self.level(tip + sphere)))
            squares = "+".join(f"({name}-({value!r}))**2" for name, value in zip("xyz", tip.tolist(), strict=True))
            expression += f"+({depth!r})*exp(-(({squares})/{width**2!r})**2)"
        self._shape(expression, samples, centre)
        if len(left := self._singular_points(samples.crossings())):
            raise ValueError(
                f"F = 0 is not smooth at {len(tips)} points, and not with them rounded either (at "
                f"{tuple(left[0].tolist())}): an edge or a crossing of parts; round it off in F"
            )

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

    def _singular_points(self, points: FloatArray) -> FloatArray:
        """Points (m, 3) of the body to which Newton steps on grad F = 0 lead, from where |grad F| is smallest."""
        for _ in range(4):
            value, gradient, _ = evaluated(self.compiled, points)
            with np.errstate(all="ignore"):
                points = points - (value / np.sum(gradient**2, axis=1))[:, None] * gradient
        points = points[np.all(np.isfinite(points), axis=1)]
        slope = np.linalg.norm(self.gradient(points), axis=1)
        typical, size = float(np.median(slope)), float(np.linalg.norm(self._bounds[1] - self._bounds[0]))
        if not len(points) or not np.isfinite(typical) or typical == 0:
            raise ValueError(
                "grad F vanishes or is not finite all over F = 0; write F so that it changes sign linearly"
            )
        at = points[np.argsort(slope)[:SUSPECTS]]
        start = at
        for _ in range(30):
            _, gradient, _ = evaluated(self.compiled, at)
            hessian = self.hessian(at)
            # F may overflow or have poles away from the body
            finite = np.all(np.isfinite(hessian), axis=(1, 2)) & np.all(np.isfinite(gradient), axis=1)
            at, start = at[finite], start[finite]
            with np.errstate(all="ignore"):
                step = -np.einsum("nij,nj->ni", np.linalg.pinv(hessian[finite]), gradient[finite])
            length = np.linalg.norm(step, axis=1, keepdims=True)
            at = at + step * np.minimum(1.0, 0.05 * size / np.maximum(length, 1e-300))
        value, gradient, _ = evaluated(self.compiled, at)
        near = np.linalg.norm(at - start, axis=1) < 0.2 * size
        flat = np.linalg.norm(gradient, axis=1) < SINGULAR * typical
        found = at[near & flat & (np.abs(value) < SINGULAR * typical * size)]
        _, first = np.unique((found / (1e-6 * size)).round(), axis=0, return_index=True)
        return np.asarray(found[first])

    def _refuse_kinks(self, samples: Samples) -> None:
        """ValueError if the curvature grows without bound towards a place where grad F itself need not vanish.

        From where it is largest, points go to the most curved of some places about them, ever closer by.
        """
        size = float(np.linalg.norm(self._bounds[1] - self._bounds[0]))
        reach, rng = float(samples.spacing.max()), np.random.default_rng(0)
        points = samples.crossings()
        most, _ = self._bend(points, np.inf)
        chosen = np.argsort(-most)[:SUSPECTS]
        at, most = points[chosen], most[chosen]
        for _ in range(CLOSER):
            tried = at[:, None] + reach * rng.normal(size=(len(at), 8, 3))
            bend, tried = self._bend(tried, reach)
            best = np.argmax(bend, axis=1)
            rows = np.arange(len(at))
            up = bend[rows, best] > most
            at = np.where(up[:, None], tried[rows, best], at)
            most = np.where(up, bend[rows, best], most)
            reach *= 0.7
        if bad := int(np.sum(most * size > SHARPEST)):
            raise ValueError(
                f"F = 0 is not smooth: its curvature has no bound near {tuple(at[np.argmax(most)].round(6).tolist())} "
                f"({bad} of {len(at)} searches); a tip, an edge or a pole of F there: round it off in F"
            )

    def _bend(self, points: FloatArray, reach: float) -> tuple[FloatArray, FloatArray]:
        """|Hessian|/|grad F| (...), 0 where it is not known, at points brought onto the body by steps <= ``reach``."""
        with np.errstate(all="ignore"):
            for _ in range(2 if np.isfinite(reach) else 0):
                value, gradient, _ = evaluated(self.compiled, points)
                slope = np.linalg.norm(gradient, axis=-1)
                step = (np.clip(value / slope, -reach, reach) / slope)[..., None] * gradient
                points = points - np.where(np.isfinite(step), step, 0.0)
            value, gradient, hessian = evaluated(self.compiled, points)
            slope = np.linalg.norm(gradient, axis=-1)
            bend = np.linalg.norm(hessian, axis=-1) / slope
            known = np.isfinite(bend) & (np.abs(value) < 0.1 * reach * slope)
        return np.where(known, bend, 0.0), points


def _box(bounds: ArrayLike) -> FloatArray:
    try:
        box = np.asarray(bounds, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"bounds {bounds!r} are not numbers; give ((x0, y0, z0), (x1, y1, z1))") from None
    if box.shape != (2, 3) or not np.all(np.isfinite(box)) or not np.all(box[1] > box[0]):
        raise ValueError(f"bounds {box.tolist()} are no box; give ((x0, y0, z0), (x1, y1, z1)) with x0 < x1 etc.")
    return box


def _point(centre: ArrayLike) -> FloatArray:
    try:
        point = np.asarray(centre, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"centre {centre!r} is not a point; give (x, y, z)") from None
    if point.shape != (3,) or not np.all(np.isfinite(point)):
        raise ValueError(f"centre {centre!r} is not a point; give (x, y, z)")
    return point


def _samples(space: ExpressionSpace, box: FloatArray, nodes: int) -> Samples:
    """F on a grid of nearly cubic cells with so many nodes along the longest side."""
    side = box[1] - box[0]
    counts = np.clip(np.ceil(side / side.max() * (nodes - 1)).astype(int) + 1, 17, nodes)
    axes = [np.linspace(box[0, k], box[1, k], counts[k]) for k in range(3)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    with np.errstate(all="ignore"):
        values = np.asarray(space.functions.value(x, y, z)[0], dtype=float)
    return Samples(np.broadcast_to(values, x.shape).copy(), box[0], side / (counts - 1))


def _found(space: ExpressionSpace) -> FloatArray:
    """Box around the one body, from the smallest cube about the origin that holds it."""
    open_cubes = 0
    for k, half in enumerate(SIZES):
        samples = _samples(space, np.array([[-half] * 3, [half] * 3]), COARSE)
        if not np.any(samples.values < 0):
            continue
        if np.any(samples.on_faces() < 0):
            open_cubes += 1
            continue
        for larger in SIZES[k + 1 : k + 6]:
            around = _samples(space, np.array([[-larger] * 3, [larger] * 3]), COARSE)
            away = np.any(around.values < 0, axis=(1, 2)).sum()
            if np.any(around.on_faces() < 0) or (away > 0 and _beyond(around, half)):
                raise ValueError(
                    f"F < 0 inside the cube of half width {half:g} about the origin, and again beyond it: "
                    "several bodies or an unbounded one; give bounds around the one you mean"
                )
        return _tightened(space, samples)
    if open_cubes:
        raise ValueError(
            f"F < 0 reaches the faces of every cube about the origin up to half width {SIZES[-1]:g}: F = 0 is open, "
            "unbounded or has the sign turned; F must be positive outside the body, or give bounds"
        )
    raise ValueError(
        f"F is nowhere negative on grids of {COARSE} nodes a side about the origin, half widths {SIZES[0]:g} to "
        f"{SIZES[-1]:g}: no body, the sign turned, or a body too small or too far off; give bounds"
    )


def _beyond(samples: Samples, half: float) -> bool:
    """Whether F < 0 at a node outside the cube of this half width."""
    where = samples.origin + np.argwhere(samples.values < 0) * samples.spacing
    return bool(np.any(np.abs(where) > half))


def _tightened(space: ExpressionSpace, samples: Samples) -> FloatArray:
    """Box around the nodes inside, sampled anew until it fits."""
    for _ in range(4):
        low, high = samples.inside
        reach = SLACK * 0.5 * (high - low) + 1.5 * samples.spacing
        box = np.stack([low - reach, high + reach])
        samples = _samples(space, box, COARSE)
    return box


def _examine(expression: str, samples: Samples, given: bool) -> None:
    """ValueError unless F is finite in the box, positive on its faces, and F < 0 and F > 0 are connected."""
    values = samples.values
    if bad := int(np.sum(~np.isfinite(values))):
        raise ValueError(
            f"F = {expression} is not finite at {bad} of {values.size} points of its box; "
            "write it without poles and roots of negative numbers around the body, or give bounds"
        )
    if not np.any(values < 0):
        raise ValueError(f"F is nowhere negative at {values.size} points of the bounds: no body, or the sign turned")
    if bad := int(np.sum(samples.on_faces() < 0)):
        remedy = "give wider bounds, or turn the sign" if given else "give bounds"
        raise ValueError(f"F < 0 at {bad} points on the faces of the bounds: F = 0 is open or cut there; {remedy}")
    if len(bodies := samples.middles()) > 1:
        places = "; ".join(f"{count} grid points about {tuple(m.round(4).tolist())}" for count, m in bodies[:4])
        raise ValueError(f"F = 0 has {len(bodies)} bodies ({places}); give bounds around one of them")
    if samples.has_cavity():
        raise ValueError("F > 0 in a cavity inside the body; its wall is a body of its own: give F of the outer wall")
