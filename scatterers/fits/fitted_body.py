"""Bodies fitted to points: two fits, their difference, and the checks before anything is traced."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import Crease, Piece
from scatterers.charts.samples import Samples
from scatterers.charts.star import LevelBody, star_map
from scatterers.fits import cache as _fit_cache
from scatterers.fits.cloud import FitReport, PieceCloud, PointCloud
from scatterers.fits.pieces import fitted_pieces
from scatterers.fits.smooth import good_fit, require_one_body
from scatterers.fits.spline_pieces import SplinePieces, packed, unpacked
from scatterers.triangles.quality import MeshQuality

if TYPE_CHECKING:
    from scatterers.charts.monge import MongeAtlas
    from scatterers.charts.star import CubeSphereAtlas


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
            # of the largest side
            slack = 0.02 * np.ptp(corners, axis=0).max()
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
        """Whether charts are available at once. If not, they take long to compute; only phase maps ask for them."""
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
        if surface not in ("smooth", "facets", "auto"):
            raise ValueError(f"surface = {surface!r} is none of smooth, facets, auto")
        if surface == "smooth":
            return super().__new__(cls)
        from scatterers.facets import Facets

        # a body on its facets has these as well
        of_facets = ("part", "cap", "union", "progress")
        shared = {name: options[name] for name in of_facets if name in options}
        only = [name for name, value in options.items() if value and name not in (*of_facets, "cache")]
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
        folder = _fit_cache.cache_folder() if cache is True else Path(cache) if cache else None
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
        self._charts = {k.removeprefix("charts-"): array for k, array in arrays.items() if k.startswith("charts-")}
        super().__init__(parts, key, speed)
        self._no_charts = str(text.get("no_charts", ""))
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
            self._keep({"charts-" + name: array for name, array in cast("MongeAtlas", found).arrays().items()})
        return found

    def _keep(self, charts: dict[str, FloatArray]) -> None:
        if self._kept is not None:
            folder, key, arrays, text = self._kept
            _fit_cache.store(folder, key, arrays | charts, text | {"no_charts": self._no_charts})

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
    found = fitted_pieces(cloud, progress) if isinstance(cloud, PieceCloud) else good_fit(cloud, progress)
    arrays = packed(found.parts.space.splines, "fine") | packed(found.coarse.space.splines, "coarse")
    arrays |= found.parts.arrays() | {"badness": cloud.quality.badness}
    return arrays, {"fit": found.report.to_json(), "quality": cloud.quality.to_json()} | cloud.notes
