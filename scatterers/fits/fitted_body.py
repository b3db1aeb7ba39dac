"""Bodies fitted to points: two fits, their difference, and the checks before anything is traced.

A body of one fit has a spline for each of its smooth pieces, what creeping asks of creases, and the arrays that it is
stored as; a smooth body is one piece without creases.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import Crease, Piece, teller
from scatterers.charts.level_body import LevelBody
from scatterers.charts.samples import Samples, towards
from scatterers.charts.star import star_map
from scatterers.fits import cache as _fit_cache
from scatterers.fits.cloud import FitReport, PieceCloud, PointCloud
from scatterers.fits.patch import curved, divided
from scatterers.fits.pieces import FittedPieces, fitted_pieces
from scatterers.fits.selection import PieceSpace
from scatterers.fits.smooth import good_fit, require_one_body
from scatterers.fits.tensor import TensorSpline
from scatterers.kernels.compiled import evaluated
from scatterers.triangles.quality import MeshQuality

if TYPE_CHECKING:
    from scatterers.charts.monge import MongeAtlas
    from scatterers.charts.star import CubeSphereAtlas


KINDS = ("edge", "joint", "tip", "seam")
TRUSTED = 1.0
"""Distance from an edge from which on a fitted piece is trusted, in distances of its points."""
LEAST = 6
"""Coefficients along an axis of a spline of degree 5."""
STEPS, MOVED = 3, 0.1
"""Newton steps that bring tiles onto their piece, and the longest, in their sides."""


@dataclass(frozen=True, eq=False)
class SplinePieces:
    """The pieces of a body of one fit; a smooth body is one piece without creases.

    Attributes
    ----------
    space : PieceSpace
    astray : (j, 3), L
        Points about which the level is not trusted,
    within : float
        to this distance, L.
    creases : tuple of Crease
    corners, normals : (m, 3, 3), L and 1
        Triangles of the mesh, outward normals of their pieces; none of a smooth body.
    number : (m,)
        Piece of each triangle.
    reach : (p,), L
        Distance from its edges within which a piece is not trusted, inf for one that is not trusted at all.
    """

    space: PieceSpace
    astray: FloatArray
    within: float
    creases: tuple[Crease, ...]
    corners: FloatArray
    normals: FloatArray
    number: IntArray
    reach: FloatArray

    @classmethod
    def whole(cls, spline: TensorSpline, astray: FloatArray, within: float) -> "SplinePieces":
        """A smooth body."""
        none = np.zeros((0, 3, 3))
        space = PieceSpace([spline], np.zeros(0))
        return cls(space, astray, within, (), none, none, np.zeros(0, np.int64), np.zeros(1))

    @classmethod
    def of(cls, fitted: FittedPieces, corners: FloatArray) -> "SplinePieces":
        """Those of a fit."""
        reach = np.array([TRUSTED * patch.spacing for patch in fitted.patches])
        reach = np.where(fitted.rough, np.inf, reach)
        within = 1 / fitted.space.table[3]
        return cls(fitted.space, fitted.astray, within, fitted.creases, corners, fitted.normals, fitted.piece, reach)

    def with_splines(self, splines: Sequence[TensorSpline]) -> "SplinePieces":
        """The same body by other splines, such as coarser fits."""
        return replace(self, space=PieceSpace(splines, self.space.table))

    @cached_property
    def surfaces(self) -> tuple[Piece, ...]:
        """The pieces."""
        box = np.stack([self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))])
        return tuple(Piece(spline.compiled, box) for spline in self.space.splines)

    def tiles(self, edge: float) -> tuple[FloatArray, FloatArray, IntArray]:
        """The body as triangles with sides of at most ``edge``, L: corners, normals (m, 3, 3) and pieces (m,)."""
        origin, place = divided(self.corners, edge)
        points, _ = curved(self.corners[origin, None], self.normals[origin, None], place)
        normals = np.empty_like(points)
        number = self.number[origin]
        for piece in np.unique(number):
            mine = number == piece
            x = towards(self.space.splines[piece].compiled, points[mine], STEPS, MOVED * edge)
            gradient = evaluated(self.space.splines[piece].compiled, x)[1]
            points[mine], normals[mine] = x, gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
        return points, normals, number

    def non_smooth(self, points: FloatArray) -> BoolArray:
        """Whether points (..., 3), L, lie where F is not trusted: (...)."""
        given = np.asarray(points, dtype=float)
        x = given.reshape(-1, 3)
        found = np.isinf(self.reach)[self.space.numbers(x)]
        tree, reach = self._edges
        if len(reach) and x.size:
            finite = np.all(np.isfinite(x), axis=-1)
            distance, nearest = tree.query(x[finite], distance_upper_bound=float(reach.max()))
            near = np.isfinite(distance)
            near[near] = distance[near] < reach[nearest[near]]
            found[finite] |= near
        return np.asarray(found.reshape(given.shape[:-1]))

    @cached_property
    def _edges(self) -> tuple[Any, FloatArray]:
        """Tree of points on edges of fitted pieces, and how far from each the pieces are not trusted."""
        from scipy.spatial import cKDTree

        points, reach = [self.astray], [np.full(len(self.astray), self.within)]
        for crease in self.creases:
            sides = self.reach[list(crease.pieces)]
            own = float(np.max(np.where(np.isfinite(sides), sides, 0.0)))
            if crease.kind in ("edge", "tip") and own > 0:
                dense = _dense(crease.points, 0.5 * own)
                points.append(dense)
                reach.append(np.full(len(dense), own))
        return cKDTree(np.concatenate(points)), np.concatenate(reach)

    def arrays(self) -> dict[str, FloatArray]:
        """All that `restored` needs, but for the splines."""
        lengths = [len(crease.points) for crease in self.creases]
        sides = [(KINDS.index(c.kind), *c.pieces, c.angle, n) for c, n in zip(self.creases, lengths, strict=True)]
        return {
            "table": self.space.table,
            "astray": self.astray,
            "within": np.array([self.within]),
            "corners": self.corners,
            "normals": self.normals,
            "number": self.number.astype(float),
            "reach": self.reach,
            "creases": np.array(sides, dtype=float).reshape(-1, 5),
            "crease-points": np.concatenate([np.zeros((0, 3)), *(crease.points for crease in self.creases)]),
        }

    @classmethod
    def restored(cls, arrays: Mapping[str, FloatArray], splines: Sequence[TensorSpline]) -> "SplinePieces":
        """The pieces whose `arrays` and splines these are.

        Raises
        ------
        ValueError, KeyError
            If arrays are missing or do not fit each other.
        """

        def get(key: str) -> FloatArray:
            return np.ascontiguousarray(arrays[key], dtype=float)

        reach, number = get("reach"), cast(IntArray, get("number").astype(np.int64))
        corners, normals, points, begin = get("corners"), get("normals"), get("crease-points"), 0
        creases = []
        for kind, first, second, angle, count in get("creases").tolist():
            curve = points[begin : begin + int(count)]
            begin += int(count)
            creases.append(Crease(KINDS[int(kind)], (int(first), int(second)), curve, angle))
        space = PieceSpace(tuple(splines), get("table"))
        if len(space.table) or len(splines) != 1:
            space.check()
        if len(reach) != len(splines) or corners.shape != (len(number), 3, 3) or normals.shape != corners.shape:
            raise ValueError("the triangles of the pieces are damaged")
        if not np.all((number >= 0) & (number < len(reach))) or not np.all(np.isfinite(corners)):
            raise ValueError("the triangles of the pieces are damaged")
        if begin != len(points) or not all(0 <= side < len(reach) for crease in creases for side in crease.pieces):
            raise ValueError("the creases of the pieces are damaged")
        astray, within = get("astray").reshape(-1, 3), float(get("within")[0])
        return cls(space, astray, within, tuple(creases), corners, normals, number, reach)


def packed(splines: Sequence[TensorSpline], name: str) -> dict[str, FloatArray]:
    """Splines as arrays, under names that begin with ``name``."""
    parts = [(spline.coefficients, np.stack([spline.origin, spline.spacing])) for spline in splines]
    found = {f"{name}-coefficients-{k}": coefficients for k, (coefficients, _) in enumerate(parts)}
    return found | {f"{name}-grid-{k}": grid for k, (_, grid) in enumerate(parts)}


def unpacked(arrays: Mapping[str, FloatArray], name: str) -> tuple[TensorSpline, ...]:
    """The splines again.

    Raises
    ------
    ValueError, KeyError
        If an array is missing, or is not of the form that kernels trust.
    """
    splines = []
    for k in range(len(arrays["reach"])):
        grid, coefficients = arrays[f"{name}-grid-{k}"], arrays[f"{name}-coefficients-{k}"]
        sound = grid.shape == (2, 3) and coefficients.ndim == 3 and min(coefficients.shape) >= LEAST
        sound = sound and grid.dtype == coefficients.dtype == float and bool(np.all(np.isfinite(grid)))
        if not sound or np.any(grid[1] <= 0) or not np.all(np.isfinite(coefficients)):
            raise ValueError(f"spline {k} of the {name} fit is damaged")
        splines.append(TensorSpline(np.ascontiguousarray(coefficients), *grid))
    return tuple(splines)


def _dense(points: FloatArray, apart: float) -> FloatArray:
    """Points (n, 3) of a polygon with others between them, so far apart at most."""
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    parts = [
        a + (b - a) * (np.arange(n) / n)[:, None]
        for a, b, n in zip(points[:-1], points[1:], np.ceil(length / apart).astype(int).clip(1, 1000), strict=True)
    ]
    return np.concatenate([*parts, points[-1:]])


CHARTS, NO_CHARTS = "charts-", "no_charts"
FEWEST = 0.1
"""Share of the points that has to be farther off, for a fit to mean anything."""
SLACK = 0.02
"""Of the box about a body of pieces, in its largest side."""
SURFACES = ("smooth", "facets", "auto")
OF_FACETS = ("part", "cap", "union", "progress")
"""Options that a body on its facets has as well,"""
OF_ALL = ("cache",)
"""and those that mean nothing there."""
Progress = Callable[[str], None]
Kept = tuple[Path, str, dict[str, FloatArray], dict[str, Any]]


class SplineBody(LevelBody):
    """Body F = 0 of the splines of a fit; the second fit is one.

    Attributes
    ----------
    creases : tuple of Crease
        Edges and seams of a body of pieces; empty if it is smooth.
    """

    _parts: SplinePieces

    def __init__(self, parts: SplinePieces, digest: str, speed: Any) -> None:
        self.speed = speed
        self._set_speed()
        self._digest, self._parts, self._map = digest, parts, None
        if self.pieces:
            self.__dict__["compiled"] = parts.space.compiled
            corners = parts.corners.reshape(-1, 3)
            slack = SLACK * np.ptp(corners, axis=0).max()
            self._bounds = np.stack([corners.min(axis=0) - slack, corners.max(axis=0) + slack])
            return
        (spline,) = parts.space.splines
        samples = Samples(spline.at_nodes(), spline.origin, spline.spacing)
        require_one_body(samples)
        self._place(spline, samples, star_map(spline, samples, None)[0])

    def _identity(self) -> str:
        return self._digest

    def _shape_texts(self) -> list[str]:
        # what has creases has no charts
        return [self._digest] if self.creases else super()._shape_texts()

    @property
    def creases(self) -> tuple[Crease, ...]:
        """Creases: edges, joints and tips at which smooth pieces meet or end."""
        return self._parts.creases

    @property
    def pieces(self) -> tuple[Piece, ...]:
        """The smooth pieces; empty if the whole body is smooth."""
        return self._parts.surfaces if len(self._parts.corners) else ()

    @property
    def corners(self) -> FloatArray | None:
        """Corners (m, 3, 3), L, of the triangles that the pieces were fitted to; None if the whole body is smooth."""
        return self._parts.corners if self.pieces else None

    def piece(self, points: FloatArray) -> IntArray:
        """Number of the piece nearest to points (..., 3), L, which lie near the body: (...)."""
        return self._parts.space.numbers(points)

    def tiles(self, edge: float) -> tuple[FloatArray, FloatArray, IntArray]:
        """Triangulate the pieces, with sides of at most ``edge``, L: corners, normals (m, 3, 3), piece numbers (m,)."""
        if not self.pieces:
            raise ValueError("a body that is smooth as a whole has no pieces; its charts cover it")
        return self._parts.tiles(edge)

    def non_smooth(self, points: FloatArray) -> BoolArray:
        """Whether the body near points (..., 3), L, is too rough, or too uncertain, for creeping rays: (...)."""
        return self._parts.non_smooth(points)

    @property
    def quick_charts(self) -> bool:
        """Whether charts are available without computation; otherwise only phase maps compute them."""
        return self._map is not None

    def _covered(self) -> "CubeSphereAtlas | MongeAtlas":
        if self.pieces:
            raise ValueError("a body with edges has no charts; its rays go by direct integration")
        return super()._covered()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._digest}, speed={self.speed!r})"


class FittedBody(SplineBody):
    """Base of Mesh and Cad.

    Attributes
    ----------
    fit : FitReport
    quality : MeshQuality
    coarse_fit : SplineBody
        The same body fitted on another grid, mostly a coarser one: what differs on it is uncertain.
    repairs : tuple of str
        What was changed in the source.
    unit : str
        "m": lengths are metres, whatever the unit in the file; "L" of a mesh in memory that states none.
    """

    def __new__(cls, source: Any = None, units: str | None = None, *, surface: str = "smooth", **options: Any) -> Self:
        """The fitted body, or one on its facets: where that is asked for, or with "auto" where no smooth one fits."""
        if surface not in SURFACES:
            raise ValueError(f"surface = {surface!r} is none of {', '.join(SURFACES)}")
        if surface == "smooth":
            return super().__new__(cls)
        from scatterers.facets import Facets

        shared = {name: options[name] for name in OF_FACETS if name in options}
        only = [name for name, value in options.items() if value and name not in (*OF_FACETS, *OF_ALL)]
        if surface == "facets":
            if only:
                raise ValueError(f"{only[0]} is of a smooth surface; leave it out of one on its facets")
            return Facets(source, units, **shared)  # type: ignore[return-value]
        try:
            return cls(source, units, **options)
        except ValueError as error:
            if only:
                raise
            try:
                body = Facets(source, units, **shared)
            except ValueError:
                # what is wrong with the source itself is told once
                raise error from None
            body.without_rays = f"no smooth surface fits it, and it is taken on its facets: {error}"
            if tell := options.get("progress"):
                tell(f"taken on its facets ({len(body.triangles)} triangles), without creeping rays: {error}")
            return body  # type: ignore[return-value]

    unit = "m"

    def _open(
        self,
        key: str,
        cache: bool | str | Path,
        speed: Any,
        make: Callable[[], PointCloud | PieceCloud],
        progress: Progress,
    ) -> None:
        """Take the fit from the cache, or make the points and fit them."""
        self.speed = speed
        # before the fit: it may take minutes
        self._set_speed()
        folder = _fit_cache.cache_folder() if cache is True else Path(str(cache)) if cache else None
        found = None if folder is None else _fit_cache.load(folder, key)
        if found is not None:
            try:
                parts, coarse = self._taken(*found)
            except (TypeError, ValueError, KeyError, AttributeError, IndexError):
                # signed, and yet none of ours
                progress("the stored fit is damaged: fitting again")
                found = None
        arrays, text = found or _fitted(make(), progress)
        if found is None:
            parts, coarse = self._taken(arrays, text)
        self._charts = {name[len(CHARTS) :]: array for name, array in arrays.items() if name.startswith(CHARTS)}
        super().__init__(parts, key, speed)
        self._no_charts = str(text.get(NO_CHARTS, ""))
        self.coarse_fit = SplineBody(coarse, f"{key}, second", speed)
        self._kept: Kept | None = None
        if folder is not None:
            self._kept = folder, key, arrays, text
            if found is None and (trouble := _fit_cache.store(folder, key, arrays, text)):
                progress(trouble)

    def _covered(self) -> "CubeSphereAtlas | MongeAtlas":
        """Make the atlas; the charts, or that there are none, are kept with the fit: to find out takes as long."""
        known = bool(self._charts or self._no_charts)
        try:
            found = super()._covered()
        except ValueError:
            if self._no_charts and not known:
                self._keep({})
            raise
        if not (self.star_shaped or known):
            self._keep({CHARTS + name: array for name, array in cast("MongeAtlas", found).arrays().items()})
        return found

    def _keep(self, charts: dict[str, FloatArray]) -> None:
        if self._kept is not None:
            folder, key, arrays, text = self._kept
            _fit_cache.store(folder, key, arrays | charts, text | {NO_CHARTS: self._no_charts})

    @property
    def coarse_factor(self) -> float:
        """Ratio of the error of the body to its difference from ``coarse_fit``."""
        return self.fit.factor

    def _taken(self, arrays: dict[str, FloatArray], text: dict[str, Any]) -> tuple[SplinePieces, SplinePieces]:
        """The body and its second fit; takes over what is known of it."""
        self.fit = FitReport.from_json(text["fit"])
        self.quality = MeshQuality.from_json(text["quality"], arrays["badness"])
        self.repairs = tuple(text["repairs"])
        self._text = text
        parts = SplinePieces.restored(arrays, unpacked(arrays, "fine"))
        return parts, parts.with_splines(unpacked(arrays, "coarse"))


def _fitted(cloud: PointCloud | PieceCloud, progress: Progress) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Arrays and text of both fits, checked."""
    if isinstance(cloud, PieceCloud):
        fitted = fitted_pieces(cloud.vertices, cloud.triangles, cloud.regions, progress, cloud.normals, cloud.noise)
        parts = SplinePieces.of(fitted, cloud.vertices[cloud.triangles])
        coarse, report = [patch.coarse for patch in fitted.patches], fitted.report()
    else:
        _require_smooth_points(cloud)
        found = good_fit(cloud, progress)
        parts = SplinePieces.whole(found.fine.spline, found.non_smooth, cloud.reach)
        coarse, report = [found.coarse.spline], found.report
    arrays = parts.arrays() | packed(parts.space.splines, "fine") | packed(coarse, "coarse")
    text = {"fit": report.to_json(), "quality": cloud.quality.to_json()}
    return arrays | {"badness": cloud.quality.badness}, text | cloud.notes


def checked_options(units: Any, strict: Any, cache: Any, progress: Any) -> Progress:
    """What to call with progress; ValueError or TypeError on options that are none."""
    if units is not None and not isinstance(units, str):
        raise ValueError(f'units = {units!r} is no text; give e.g. units="mm"')
    if not isinstance(strict, bool):
        raise ValueError(f"strict = {strict!r} is neither True nor False")
    if not isinstance(cache, (bool, str, Path)):
        raise ValueError(f"cache = {cache!r} is neither True, False nor a folder")
    return teller(progress)


def _require_smooth_points(cloud: PointCloud) -> None:
    """ValueError if hardly a point is left when those about non-smooth places are taken away."""
    if not len(cloud.non_smooth) or np.mean(cloud.smooth) >= FEWEST:
        return
    raise ValueError(
        f"{np.sum(~cloud.smooth)} of {len(cloud.points)} points lie within {cloud.reach:.3g} m of places where the "
        "body is not smooth, and nothing is known there; refine the mesh"
    )
