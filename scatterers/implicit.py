"""Body F(x, y, z) = 0 from an expression: differentiated by sympy, compiled, and examined before use.

The body is looked for on grids (`scatterers.exact.singularities`): F < 0 in one connected region inside the box, F
> 0 in one around it. Then places are looked for where it is not smooth: tips (`scatterers.exact.singularities`),
and curves along which max, min and where change their choice and the normal or the curvature jumps.

Also here: body whose F is given by samples on a Cartesian grid: F = quintic tensor-product B-spline through them. F and
its derivatives are those of the spline, exactly.

Sources: [B78]; Derivations, B7.
"""

import hashlib
import re
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from creeping._typing import ArrayLike, FloatArray, IntArray
from creeping.storage.memory import within_budget
from scatterers.body import SHARP, Crease, Piece, box_of, cached, no_charts, numbers, numbers_of, positive
from scatterers.charts.samples import Samples
from scatterers.charts.star import LevelBody, star_map
from scatterers.exact.clipped import clip, creases, march, normals
from scatterers.exact.singularities import (
    FINE,
    SIZES,
    distinct,
    examine,
    found_box,
    is_tip,
    kinks,
    polished,
    refuse_edges,
    samples_of,
    singular_points,
    tightened,
)
from scatterers.exact.switches import ExpressionSpace, Switches
from scatterers.fits.tensor import TensorSpline, coefficients


class Implicit(LevelBody):
    """Body F < 0 given by an expression in x, y, z, such as ``"x**2/1.44 + y**2 + z**2 - 1"``.

    Parameters
    ----------
    expression : str
        Numbers, x, y, z, pi, + - * / **, parentheses, sqrt, exp, log, sin, cos, tan, sinh, cosh, tanh, and
        max(a, b, ...), min(a, b, ...) and where(x < 0, a, b); negative inside the body, positive outside. An
        equation such as ``"x**2 + y**2 = 1 - z**2"`` stands for its left side minus its right side.
    bounds : (2, 3) array_like, optional
        Box that contains the body and nothing else, L; found if not given, for bodies that a cube about the origin with
        half width 2^-8 to 2^12 resolves.
    centre : (3,) array_like, optional
        Interior point from which the whole surface is visible, L; only star-shaped bodies have one.
    strict : bool
        Refuse bodies with edges and tips. Otherwise a body with edges, tips or joints is piecewise smooth: it has the
        members ``pieces``, ``creases``, ``piece`` and ``tiles``, and charts only if it has neither edges nor tips.
        Pieces smaller than 1/64 of the bounding box, a cell of the search grid, may be missed.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If the expression contains anything else, or F = 0 is empty, open, unbounded, not finite, not connected, has a
        cavity, crosses itself, or has unbounded curvature other than at tips; or if ``strict`` refuses the body.

    Examples
    --------
    >>> import scatterers as sc
    >>> body = sc.Implicit("x**2/4 + y**2 + z**2 - 1", bounds=[[-2.2, -1.1, -1.1], [2.2, 1.1, 1.1]])
    >>> body.gradient([2.0, 0.0, 0.0])
    array([1., 0., 0.])
    >>> body.star_shaped
    True
    >>> sc.Implicit("max(x**2 + y**2 + z**2 - 1, z - 0.6)").creases
    [Crease(edge between pieces 0 and 1, 53.1 degrees, length 5.03 L, closed)]
    """

    def __init__(
        self,
        expression: str,
        bounds: ArrayLike | None = None,
        *,
        centre: ArrayLike | None = None,
        strict: bool = False,
        speed: Any = None,
    ) -> None:
        # an equation as the expression that is 0 on it, left minus right; other texts as they are
        sides = re.split("(?<![<>=!])={1,2}(?!=)", expression) if isinstance(expression, str) else []
        expression = f"({sides[0].strip()}) - ({sides[1].strip()})" if len(sides) == 2 else expression
        everywhere = ExpressionSpace(expression, np.array([[-SIZES[-1]] * 3, [SIZES[-1]] * 3]))
        self.expression = expression
        self.speed = speed
        self._set_speed()
        box = found_box(everywhere) if bounds is None else box_of(bounds)
        samples = samples_of(everywhere, box, FINE)
        examine(expression, samples, bounds is not None)
        if np.all(np.ptp(samples.inside, axis=0) < 0.5 * np.ptp(box, axis=0)):
            # a wide box shows little of the body
            box = np.clip(tightened(everywhere, samples), box[0], box[1])
            samples = samples_of(everywhere, box, FINE)
            examine(expression, samples, True)
        given = None if centre is None else numbers_of("centre", centre, (3,))
        space = ExpressionSpace(expression, np.stack([samples.origin, samples.far_corner]))
        sphere_map, failure = star_map(space, samples, given)
        if sphere_map is None and given is not None:
            raise ValueError(failure)
        self._place(space, samples, sphere_map)
        tips = self._tips(samples, strict)
        along = self._found_creases(samples, strict)
        ends = [int(self._numbers(tip[None])[0]) for tip in tips]
        self._creases = [*(Crease("tip", (k, k), tip[None]) for tip, k in zip(tips, ends, strict=True)), *along]
        if any(crease.kind != "seam" for crease in self._creases):
            # only a body of pieces has the members of one: by them it is told from a smooth body
            self.__class__ = PiecewiseImplicit

    def _tips(self, samples: Samples, strict: bool) -> FloatArray:
        points, spacing = samples.crossings(), float(samples.spacing.max())
        size = float(np.linalg.norm(self._bounds[1] - self._bounds[0]))
        flat = singular_points(self.compiled, points, size)
        if len(flat) > 8:
            raise ValueError(
                f"F = 0 is not smooth: grad F = 0 at {len(flat)} of its points, first {tuple(flat[0].tolist())}, more "
                "than the 8 tips of a body; an edge, or F that does not change sign linearly: write it "
                "otherwise"
            )
        if crossed := [place for place in flat if not is_tip(self.compiled, place, size)]:
            raise ValueError(
                f"F = 0 is not smooth: grad F = 0 at {len(flat)} of its points, and at "
                f"{tuple(crossed[0].tolist())} there is a cusp or a crossing of parts, no tip: round it off in F"
            )
        sharp, bends = kinks(self.compiled, points, spacing, size)
        apart = distinct(sharp, bends, size)
        if len(apart) <= 8:
            apart = np.array([polished(self.compiled, place, size) for place in apart]).reshape(-1, 3)
        tips = len(apart) <= 8 and all(is_tip(self.compiled, place, size) for place in apart)
        if not tips and len(sharp):
            worst = tuple(sharp[np.argmax(bends)].round(6).tolist())
            raise ValueError(
                f"F = 0 is not smooth: its curvature has no bound near {worst} ({len(sharp)} searches); an edge or a "
                "pole of F there: round it off in F"
            )
        found = distinct(np.concatenate([flat, apart]), np.arange(len(flat) + len(apart), 0.0, -1.0), size)
        if strict and len(found):
            raise ValueError(
                f"F = 0 is not smooth: it has {len(found)} tips, first {tuple(found[0].round(9).tolist())}; leave "
                "strict out to take them, or round them off in F"
            )
        return found

    def _found_creases(self, samples: Samples, strict: bool) -> list[Crease]:
        spacing = float(samples.spacing.max())
        self._switches = Switches(self.expression)
        if not self._switches.any:
            refuse_edges(self.compiled, samples.crossings(), spacing)
            return []
        # points on the body: next to it, other choices may be made
        points, triangles = march(self.level, self._bounds, spacing)
        self._switches.met(points)
        if len(self._pieces) == 1:
            return []
        found = creases(self._pieces, clip(self, self._pieces, self._numbers, points, triangles), spacing)
        edges = [crease for crease in found if crease.kind == "edge"]
        if strict and edges:
            sharpest = max(edges, key=lambda crease: crease.angle)
            raise ValueError(
                f"F = 0 is not smooth: its normal jumps by up to {np.degrees(sharpest.angle):.2g} degrees near "
                f"{tuple(sharpest.points[0].round(6).tolist())}, along {len(edges)} edges; leave strict out to take "
                "them, or round them off in F"
            )
        return found

    @cached_property
    def _pieces(self) -> list[Piece]:
        count = len(self._switches.pieces)
        if count < 2:
            return [Piece(self.compiled, self._bounds)]
        return [Piece(self._switches.compiled(k), self._bounds) for k in range(count)]

    def _numbers(self, points: FloatArray) -> IntArray:
        flat = np.asarray(points, dtype=float).reshape(-1, 3)
        found = self._switches.numbers(flat) if len(self._pieces) > 1 else np.zeros(len(flat), dtype=np.int64)
        return found.reshape(np.shape(points)[:-1])

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


class PiecewiseImplicit(Implicit):
    """Body of an expression with creases; `Implicit` makes it of its own accord."""

    @property
    def pieces(self) -> Sequence[Piece]:
        """Smooth surfaces that bound the body."""
        return self._pieces

    @property
    def creases(self) -> Sequence[Crease]:
        """Where pieces meet or end."""
        return self._creases

    def piece(self, points: FloatArray) -> IntArray:
        """Number of the piece that the expression chooses: points (..., 3), L, near the body, to (...).

        On the body it is the nearest; off it, near an edge, as near as the sizes of grad F on both sides are equal.
        """
        return self._numbers(points)

    def tiles(self, edge: float) -> tuple[FloatArray, FloatArray, IntArray]:
        """The body as triangles with sides of about ``edge``, L, at most.

        Returns
        -------
        corners, normals : (m, 3, 3), L and 1
            Counter-clockwise seen from outside; on the piece of the triangle, its normals there.
        pieces : (m,)
            No triangle lies on two. Slivers that fold back are left out.

        Raises
        ------
        ValueError
            If ``edge`` is not a positive finite number, or so small that the grid is too large.
        """
        positive(edge=edge)
        # 1.5 cells of the grid to an edge: sides are 1.15 edges at most
        points, triangles = march(self.level, self._bounds, edge / 1.5)
        clipped = clip(self, self._pieces, self._numbers, points, triangles)
        corners, directions = clipped.corners, normals(self._pieces, clipped.corners, clipped.pieces)
        outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        kept = np.all(np.sum(outward[:, None] * directions, axis=-1) > 0, axis=1)
        return corners[kept], directions[kept], clipped.pieces[kept]

    @cached
    def atlas(self) -> Any:
        """Charts of a body without edges and tips; asking others for charts raises an error."""
        sharp = [crease for crease in self._creases if crease.kind in SHARP]
        return no_charts(sharp) if sharp else super().atlas


FEWEST = 8


class Gridded(LevelBody):
    """Body F < 0 from samples of F on a regular grid, interpolated by splines.

    Parameters
    ----------
    samples : (n0, n1, n2) array_like
        F at the nodes, positive outside the body; at least 8 nodes along each axis.
    bounds : (2, 3) array_like
        Box spanned by the grid, L; the outermost nodes lie on its faces.
    centre : (3,) array_like, optional
        Interior point from which the whole surface is visible, L; by default the centre of the bounding box. A bent
        body is first sheared straight if that makes it star-shaped. Bodies that are not star-shaped take none.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If the samples are too few or not finite, no node lies inside the body, a node on the faces of the grid does not
        lie outside, or the body is not star-shaped about the given centre.

    Examples
    --------
    >>> import numpy as np
    >>> import scatterers as sc
    >>> axis = np.linspace(-1.25, 1.25, 21)
    >>> x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    >>> ball = sc.Gridded(x**2 + y**2 + z**2 - 1, [[-1.25] * 3, [1.25] * 3])
    >>> float(abs(ball.level([0.6, 0.0, 0.8])).round(12))       # quintics are reproduced
    0.0
    """

    def __init__(
        self, samples: ArrayLike, bounds: ArrayLike, *, centre: ArrayLike | None = None, speed: Any = None
    ) -> None:
        box = box_of(bounds)
        nodes = _checked(samples)
        spacing = (box[1] - box[0]) / (np.array(nodes.shape) - 1)
        given = None if centre is None else numbers_of("centre", centre, (3,))
        self.speed = speed
        self._set_speed()
        spline = TensorSpline(coefficients(nodes), box[0], spacing)
        sampled = Samples(nodes, box[0], spacing)
        sphere_map, failure = star_map(spline, sampled, given)
        if sphere_map is None and given is not None:
            raise ValueError(failure)
        self._place(spline, sampled, sphere_map)
        self._spline = spline
        digest = hashlib.blake2b(nodes.tobytes(), digest_size=8)
        # what is stored by the sphere map depends on it, too
        header = np.zeros(0) if sphere_map is None else sphere_map.header
        digest.update(np.concatenate([box.ravel(), header, np.array(nodes.shape, dtype=float)]).tobytes())
        self._digest = digest.hexdigest()

    @classmethod
    def sampled(
        cls,
        body: Any,
        nodes: int | Sequence[int] = 64,
        margin: float = 0.15,
        *,
        centre: ArrayLike | None = None,
    ) -> "Gridded":
        """Sample F of another body on a grid; the speed of that body is copied.

        Parameters
        ----------
        body : object with ``level`` and ``bounds``
        nodes : int or three ints
            Nodes along each axis.
        margin : float
            Margin added on every side of the bounding box, as a fraction of its half width.
        centre : (3,) array_like, optional
            Interior point, L, as for `Gridded`.

        Raises
        ------
        ValueError
            On the conditions of `Gridded`, or if the nodes or the margin are not usable.

        Examples
        --------
        >>> import scatterers as sc
        >>> body = sc.Gridded.sampled(sc.Ellipsoid(1.0, 0.8, 0.6), nodes=24)
        >>> float(abs(body.level([0.0, 0.8, 0.0])).round(9))
        0.0
        """
        most = 1000
        counts = np.broadcast_to(nodes, 3).tolist()
        if not all(FEWEST <= n <= most for n in counts):
            raise ValueError(f"nodes = {nodes!r}; give one or three whole numbers from {FEWEST} to {most}")
        positive(margin=margin)
        box = numbers_of("bounds", body.bounds, (2, 3))
        widened = margin * 0.5 * (box[1] - box[0])
        box = np.stack([box[0] - widened, box[1] + widened])
        x, y, z = (np.linspace(box[0, k], box[1, k], counts[k]) for k in range(3))
        # plane by plane, so that large grids do not fill the memory
        planes = [body.level(np.stack(np.broadcast_arrays(v, y[:, None], z), axis=-1)) for v in x]
        return cls(np.stack(planes), box, centre=centre, speed=getattr(body, "speed", None))

    def __repr__(self) -> str:
        nodes = " x ".join(str(n - 4) for n in self._spline.coefficients.shape)
        return f"Gridded({nodes} nodes, {self._digest}, speed={self.speed!r})"

    def _identity(self) -> str:
        return self._digest


def _checked(samples: ArrayLike) -> FloatArray:
    """Samples as an array, or ValueError."""
    # as numbers, their coefficients, and those half made
    count = int(np.prod(np.shape(samples), dtype=float)) if hasattr(samples, "shape") else 0
    within_budget(24.0 * count, f"a spline through {count} samples", "give fewer")
    try:
        nodes = np.ascontiguousarray(numbers(samples))
    except (TypeError, ValueError):
        raise ValueError("the samples are not numbers; give F at the nodes, an array (n0, n1, n2)") from None
    if nodes.ndim != 3 or min(nodes.shape) < FEWEST:
        raise ValueError(f"samples have shape {nodes.shape}; give (n0, n1, n2), each at least {FEWEST}")
    if bad := int(np.sum(~np.isfinite(nodes))):
        raise ValueError(f"{bad} of {nodes.size} samples are not finite; give F at every node, also far away")
    if not np.any(nodes < 0):
        raise ValueError(f"none of {nodes.size} samples is negative: no body; give F < 0 inside, or more nodes")
    faces = Samples(nodes, np.zeros(3), np.ones(3)).on_faces()
    if bad := int(np.sum(~(faces > 0))):
        raise ValueError(
            f"F <= 0 at {bad} of {len(faces)} nodes on the grid's faces: the body leaves the grid or F is negative "
            "outside; widen the box or change the sign"
        )
    return nodes
