"""Attachment points: where creeping rays are launched from the shadow line.

A position is (arc, arclength) with the arclength unwrapped, so that it grows along an arc that crosses the start of its
closed curve; the point is that of the arclength modulo the curve's length.

Also here: whether the body stands before a point: F along the backward ray x - t d, t > 0.

F starts there with F = 0, F' = 0, F'' = d.Hd at a point of the shadow line, so behind a convex point it first rises;
the ray enters the body where F is negative at a sample, or at a minimum between samples.

Sources: [K84]; Derivations, R10.
"""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geometry.incident import REMEDY, headings, openings, optical_paths, spherical
from creeping.geometry.patches import Rows
from creeping.geometry.piecewise import is_convex, is_piecewise
from creeping.geometry.surface import Surface, is_faceted, size, why_no_rays
from creeping.kernels.threads import in_slices
from creeping.shadow.status import NO_RAY

SAMPLES = 192
"""Samples of F from a point to where its backward ray leaves the box."""


class Arc(NamedTuple):
    """Part of one curve of the shadow line whose rays are neighbours; ``closed`` if it is the whole curve."""

    curve: int
    start: float
    end: float
    closed: bool


@dataclass(frozen=True, eq=False)
class LaunchPoints(Rows):
    """Launch points of rays on the shadow lines of n incidences.

    Attributes
    ----------
    waves : (n, 3 or 4)
        Unit vectors d of plane waves, or rows (d, w) of `creeping.geometry.incident`.
    points : (n, rays, 3), L
        NaN where there is no ray, as below.
    arclength : (n, rays), L
        Along the curve.
    curve_index : (n, rays)
        The longest curve is 0; NO_RAY where there is no ray.
    arc_index, spacing, closed : (n, rays)
        Number of the arc, distance of neighbours on it, L, and 1 if it is a whole curve.
    state : (n, rays)
        Codes of `creeping.shadow.status.STATUSES`.
    """

    waves: FloatArray
    points: FloatArray
    arclength: FloatArray
    curve_index: IntArray
    arc_index: FloatArray
    spacing: FloatArray
    closed: FloatArray
    state: FloatArray

    @classmethod
    def blank(cls, waves: FloatArray, n_rays: int) -> "LaunchPoints":
        """So many places of each incidence, none with a ray."""
        shape = len(waves), n_rays
        nothing = [np.full(shape, np.nan) for _ in range(5)]
        return cls(waves, np.full((*shape, 3), np.nan), nothing[0], np.full(shape, NO_RAY, np.int16), *nothing[1:])

    def put(self, rows: IntArray, those: "LaunchPoints") -> None:
        """Take the rays of some incidences, in place."""
        for one in fields(self)[1:]:
            getattr(self, one.name)[rows] = getattr(those, one.name)

    @property
    def directions(self) -> FloatArray:
        """Unit vectors d (n, 3) of plane waves; see `headings` for others."""
        if spherical(self.waves):
            raise InvalidInputError(f"these launch points have no one direction: they are of {REMEDY}")
        return np.asarray(self.waves[:, :3])

    @property
    def headings(self) -> FloatArray:
        """Unit vectors p (n, rays, 3) along which rays start."""
        return headings(self.waves[:, None], self.points)

    @property
    def openings(self) -> FloatArray:
        """1/R (n, rays), 1/L: how fast rays part where they start."""
        return openings(self.waves[:, None], self.points)

    @property
    def phase(self) -> FloatArray:
        """d.x0, or the distance from the source (n, rays), L."""
        return optical_paths(self.waves[:, None], self.points)

    @property
    def there(self) -> BoolArray:
        """Whether a place holds a ray (n, rays)."""
        return np.asarray(self.curve_index != NO_RAY)


def evenly_chosen(there: BoolArray, most: int) -> BoolArray:
    """At most ``most`` of the True places of each row, evenly spread over them: (n, rays) -> (n, rays).

    Examples
    --------
    >>> evenly_chosen(np.array([[True, False, True, True, True]]), 2).astype(int)
    array([[1, 0, 0, 1, 0]])
    """
    every = np.maximum(there.sum(axis=1, keepdims=True) / most, 1.0)
    number = np.cumsum(there, axis=1) - 1
    return np.asarray(there & ((np.floor(number / every) > np.floor((number - 1) / every)) | (number == 0)))


def line_tangents(body: Surface, points: FloatArray, direction: FloatArray) -> FloatArray:
    """Unit tangents grad F x Hp/|.| of the line at its points; p is (3,) or one for each: (n, 3) -> (n, 3).

    NaN where the ground is flat along d, as beside a joint that is the line itself.
    """
    direction = np.broadcast_to(direction, points.shape)
    tangent = np.cross(body.gradient(points), np.einsum("nij,nj->ni", body.hessian(points), direction))
    with np.errstate(invalid="ignore"):
        return np.asarray(tangent / np.linalg.norm(tangent, axis=-1, keepdims=True))


def occluded(body: Surface, points: FloatArray, direction: FloatArray, reach: FloatArray | float = np.inf) -> BoolArray:
    """Whether the backward ray x - t d, 0 < t < reach, enters the body: points (n, 3), d (3,) or (n, 3) -> (n,).

    Points lie on the body, where it is lit or touched from outside, or above it.
    """
    # so many rays at a time
    together = 256
    hidden = np.zeros(len(points), dtype=bool)
    d, limit = np.broadcast_to(direction, points.shape), np.broadcast_to(reach, len(points))
    low, high = np.asarray(body.bounds, dtype=float)
    with np.errstate(divide="ignore", invalid="ignore"):
        out = np.where(d == 0, np.inf, (points - np.where(d > 0, low, high)) / d).min(axis=1, initial=np.inf)
    # a point on the face of the box, or just beyond it by rounding, has nothing behind
    step = np.minimum(np.maximum(out, 0.5e-3 * np.linalg.norm(high - low)), limit) / SAMPLES

    def run(slice_: slice) -> None:
        for start in range(slice_.start, slice_.stop, together):
            some(slice(start, min(start + together, slice_.stop)))

    def some(part: slice) -> None:
        x, back, h = points[part], d[part], step[part, None]
        t = h * np.arange(1, SAMPLES + 2)
        F = np.asarray(body.level((x[:, None] - t[..., None] * back[:, None]).reshape(-1, 3))).reshape(t.shape)
        hidden[part] = np.any(F < 0, axis=1)
        least = (F[:, 1:-1] < F[:, :-2]) & (F[:, 1:-1] <= F[:, 2:]) & ~hidden[part, None]
        row, sample = np.nonzero(least)
        if len(row):
            under = _dips(body, x[row], back[row], t[row, sample + 1], h[row, 0])
            hidden[part.start + row[under]] = True

    in_slices(run, len(points), multiple=together)
    return hidden


def _dips(body: Surface, points: FloatArray, d: FloatArray, t: FloatArray, h: FloatArray) -> BoolArray:
    """Whether F < 0 at its minimum on x - t d within h of t: (m, 3), (m, 3), (m,), (m,) -> (m,)."""
    start = t
    for _ in range(6):
        x = points - t[:, None] * d
        slope = -np.sum(body.gradient(x) * d, axis=1)
        bend = np.einsum("mi,mij,mj->m", d, body.hessian(x), d)
        with np.errstate(divide="ignore", invalid="ignore"):
            move = np.where(bend > 0, -slope / bend, -np.copysign(0.25 * h, slope))
        t = np.clip(t + move, start - h, start + h)
    return np.asarray(body.level(points - t[:, None] * d) < 0)


def is_lit(body: Any, points: FloatArray, normals: FloatArray, direction: FloatArray) -> BoolArray:
    """Whether the wave comes straight to points of the body with normals (m, 3): (m,)."""
    lit = np.asarray(normals @ direction < 0)
    if not (is_piecewise(body) and is_convex(body)):
        # just above nodes of tiles, in body sizes: the polynomials of tiles may pass under the body
        above = points[lit] + 1e-5 * size(body) * normals[lit]
        lit[lit] = ~_hidden(body, above, direction)
    return lit


def _hidden(body: Any, points: FloatArray, direction: FloatArray) -> BoolArray:
    """Whether a body of any kind stands before points (m, 3) of the wave (m,)."""
    if not why_no_rays(body):
        return occluded(body, points, direction)
    if is_faceted(body):
        return np.asarray(body.hidden(points, direction))
    found = np.zeros(len(points), dtype=bool)
    for number, part in enumerate(body.parts):
        found |= _hidden(part, body.own(number, points), direction @ body.turns[number])
    return found
