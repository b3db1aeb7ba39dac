"""Numerical verification of a body: derivatives, closedness, orientation, cover and overlap of its charts.

Also here: the unit of a body's lengths: bodies made from files know theirs, the metre; of others it is the user's, L.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import SurfaceError
from creeping.geometry.arguments import checked_body
from creeping.geometry.piecewise import KINDS, SAMPLE, is_piecewise, pieces_of, tiles_of
from creeping.geometry.surface import Surface, normal, size
from creeping.geometry.triangulation import triangulate

WRONG_SIGNS = 1e-2
"""Share of the area of a body of pieces beside which F may have the wrong sign."""

METRE, UNKNOWN = "m", "L"


@dataclass(frozen=True)
class Check:
    """One property of a body: the worst value found, its limit, and what to do about a failure."""

    name: str
    worst: float
    limit: float
    remedy: str

    @property
    def ok(self) -> bool:
        """Whether the worst value is within the limit (NaN is not)."""
        return self.worst <= self.limit


@dataclass(frozen=True, repr=False)
class SurfaceReport:
    """What `check_surface` found.

    Attributes
    ----------
    checks : tuple of Check
    genus : int or None
        Handles of the body; None of a body with creases, whose triangles need not fit.
    area : float
        In squares of the unit, of a triangulation: a few digits.
    pieces : int
        Smooth pieces that bound it.
    creases : tuple
        Edges, joints, seams and tips at which these meet, as the body's ``creases``.
    unit : str
        Of lengths: "m" where the body knows it, else "L".
    """

    checks: tuple[Check, ...]
    genus: int | None
    area: float
    pieces: int = 1
    creases: tuple[Any, ...] = ()
    unit: str = UNKNOWN

    @property
    def ok(self) -> bool:
        """Whether every check passed."""
        return all(check.ok for check in self.checks)

    def require(self) -> None:
        """Raise SurfaceError naming every failed check."""
        failed = [f"{c.name}: {c.worst:.3g} > {c.limit:.3g} ({c.remedy})" for c in self.checks if not c.ok]
        if failed:
            raise SurfaceError(f"{len(failed)} of {len(self.checks)} checks of the body failed: " + "; ".join(failed))

    def __repr__(self) -> str:
        rows = [f"  BAD {c.name}: {c.worst:.2g} (limit {c.limit:.2g}); {c.remedy}" for c in self.checks if not c.ok]
        if held := len(self.checks) - len(rows):
            closest = max((c for c in self.checks if c.ok), key=lambda c: c.worst / c.limit if c.limit else 0.0)
            nearest = f"{closest.name}: {closest.worst:.2g} (limit {closest.limit:.2g})"
            rows.append(f"  ok  {held} of {len(self.checks)} checks; nearest to its limit is {nearest}")
        counts = Counter(crease.kind for crease in self.creases)
        meeting = [f"{counts[kind]} {kind}{'s' * (counts[kind] > 1)}" for kind in KINDS if counts[kind]]
        made = ", ".join([f"{self.pieces} smooth pieces", *meeting]) if self.genus is None else f"genus {self.genus}"
        return "\n".join([f"SurfaceReport({made}, area {self.area:.4g} {self.unit}^2)", *rows])


def check_surface(body: Surface) -> SurfaceReport:
    """Verify a body numerically: derivatives, closedness, orientation, cover and overlap of its charts.

    Parameters
    ----------
    body : Surface

    Returns
    -------
    SurfaceReport

    Raises
    ------
    SurfaceError
        If F = 0 cannot be triangulated at all: empty, open, not finite, or not smooth.

    Examples
    --------
    >>> import scatterers as sc
    >>> report = check_surface(sc.Torus())
    >>> report.ok, report.genus
    (True, 1)
    """
    if is_piecewise(body):
        return _piecewise_report(body)
    checked_body(body)
    mesh = triangulate(body)
    points = mesh.vertices
    components = mesh.components
    return SurfaceReport(
        checks=(
            Check("components beyond one", float(components - 1), 0, "give one body at a time"),
            *_derivative_checks(body, points),
            *_atlas_checks(body, points),
        ),
        genus=components - mesh.euler_characteristic // 2,
        area=mesh.area,
        unit=unit_of(body),
    )


def _piecewise_report(body: Any) -> SurfaceReport:
    """Checks of a body with creases: each piece where it bounds the body, and its triangles all together."""
    checked_body(body, charts=False)
    tiles, pieces = tiles_of(body, 0.05), pieces_of(body)
    middles, n = tiles.corners.mean(axis=1), tiles.normals.mean(axis=1)
    a, b, c = np.moveaxis(tiles.corners, 1, 0)
    areas = 0.5 * np.cross(b - a, c - a)
    area = float(np.sum(np.linalg.norm(areas, axis=1)))
    checks = [
        Check("sum of area times normal, as a share of the area", float(np.linalg.norm(areas.sum(axis=0))) / area, 1e-2,
              "close the tiles"),
        Check("share of tiles turned inside out", float(np.mean(np.sum(areas * n, axis=1) < 0)), 0, "turn the tiles"),
    ]  # fmt: skip
    for number, piece in enumerate(pieces):
        x = piece.samples
        if not len(x):
            continue
        mine = tiles.pieces == number
        off = float(np.max(np.abs(np.sum((middles[mine, None] - tiles.corners[mine]) * n[mine, None], axis=-1))))
        checks.append(Check(f"piece {number}: tiles off their normals' planes, in body sizes", off / size(body), 0.05,
                            "mend tiles()"))  # fmt: skip
        checks += [Check(f"piece {number}: {c.name}", c.worst, c.limit, c.remedy) for c in _derivative_checks(piece, x)]
    share, worst, number = wrong_signs(body)
    of = f" (of that of piece {number}: {worst:.2g})" if worst > WRONG_SIGNS else ""
    what = f"share of the area where F has the wrong sign outside or inside{of}"
    checks.append(Check(what, share, WRONG_SIGNS, "mend level()"))
    return SurfaceReport(
        checks=tuple(checks),
        genus=None,
        area=area,
        pieces=len(pieces),
        creases=tuple(body.creases),
        unit=unit_of(body),
    )


def wrong_signs(body: Any) -> tuple[float, float, int]:
    """Share of the area of a body of pieces beside which F has the wrong sign; that of the worst piece, and its number.

    Examples
    --------
    >>> import scatterers as sc
    >>> wrong_signs(sc.Cylinder(1.0, 4.0))[0]
    0.0
    """
    tiles, step = tiles_of(body, SAMPLE), 1e-4 * size(body)
    wrong = np.zeros(len(tiles.pieces), dtype=bool)
    for number, piece in enumerate(pieces_of(body)):
        x = piece.samples
        if len(x):
            m = normal(piece, x)
            wrong[tiles.pieces == number] = (body.level(x + step * m) < 0) | (body.level(x - step * m) > 0)
    whole = np.bincount(tiles.pieces, tiles.areas)
    bad = np.bincount(tiles.pieces, tiles.areas * wrong)
    each = bad / np.maximum(whole, 1e-300)
    return float(bad.sum() / whole.sum()), float(each.max()), int(each.argmax())


def _derivative_checks(body: Surface, points: FloatArray) -> list[Check]:
    """Analytic against differences, relative to the largest value; of planes to slope over size."""
    step, gradient, hessian = 6e-6 * size(body), body.gradient(points), body.hessian(points)
    slight = float(np.max(np.abs(gradient))) / size(body)
    bent = _relative(hessian, _differences(body.gradient, points, step), slight)
    level = _relative(gradient, _differences(body.level, points, step))
    checks = [
        Check("gradient against differences of F", level, 1e-6, "mend gradient()"),
        Check("Hessian against differences of the gradient", bent, 1e-6, "mend hessian()"),
    ]
    speed = getattr(body, "speed", None)
    if speed is not None:
        slope = _relative(speed.gradient(points), _differences(speed.value, points, step))
        checks += [
            Check("negative speed", float(np.max(-speed.value(points))), 0, "give c(x) > 0 on the body"),
            Check("speed gradient against differences", slope, 1e-6, "mend the speed's gradient()"),
        ]
    return checks


def _atlas_checks(body: Surface, points: FloatArray) -> list[Check]:
    """Cover (every point in the unit square of its chart), inverse, tangents and orientation."""
    index, uv = body.atlas.locate(points)
    charts = body.atlas.charts
    outside, gap, tangent, turned, off = 0.0, 0.0, 0.0, 0.0, 0.0
    for k, chart in enumerate(charts):
        mine = uv[index == k]
        if not len(mine):
            continue
        free = [axis for axis in (0, 1) if not chart.periodic[axis]]
        if free:
            outside = max(outside, float(np.max(np.maximum(-mine[:, free], mine[:, free] - 1))))
        back = chart.point(mine)
        gap = max(gap, float(np.max(np.linalg.norm(back - points[index == k], axis=-1))) / size(body))
        off = max(
            off, float(np.max(np.abs(body.level(back)) / np.linalg.norm(body.gradient(back), axis=-1))) / size(body)
        )
        columns = chart.tangents(mine)
        tangent = max(tangent, _relative(columns, _differences(chart.point, mine, 1e-5)))
        facing = np.sum(np.cross(columns[..., 0], columns[..., 1]) * body.gradient(back), axis=-1)
        turned = max(turned, float(np.mean(~(facing > 0))))
    return [
        Check("share of points in no chart", float(np.mean((index < 0) | (index >= len(charts)))), 0, "mend locate()"),
        Check("points outside the unit square of their chart", outside, 1e-9, "widen the charts or mend locate()"),
        Check("chart inverse, in body sizes", gap, 1e-9, "make locate() the inverse of point()"),
        Check("chart points off the body, in body sizes", off, 1e-9, "make point() satisfy F = 0"),
        Check("tangents against differences", tangent, 1e-6, "mend tangents()"),
        Check("share of chart points turned inside out", turned, 0, "swap u and v, or the sign of F"),
    ]


def _differences(function: Callable[[FloatArray], FloatArray], at: FloatArray, step: float) -> FloatArray:
    """Derivatives (n, ..., c) of a function of (n, c): central ones of order 4, as fits of noise have ripples."""
    found = []
    for shift in step * np.eye(at.shape[1]):
        near, far = (function(at + many * shift) - function(at - many * shift) for many in (1, 2))
        found.append((8 * near - far) / (12 * step))
    return np.stack(found, axis=-1)


def _relative(given: FloatArray, expected: FloatArray, least: float = 1e-300) -> float:
    if given.shape != expected.shape:
        return float("nan")
    return float(np.max(np.abs(given - expected)) / max(float(np.max(np.abs(expected))), least))


def unit_of(body: Any) -> str:
    """Unit of a body's lengths: "m" if the body says so, else "L".

    Examples
    --------
    >>> import scatterers as sc
    >>> unit_of(sc.Sphere())
    'L'
    """
    return METRE if getattr(body, "unit", None) == METRE else UNKNOWN
