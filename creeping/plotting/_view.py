"""The camera of the 3-D pictures: parallel projection, from the shadow side, and what it can see.

toward = (cos e cos a, cos e sin a, sin e) points from the body to the camera (azimuth a, elevation e), and
(right, up, toward) is a right-handed frame, up the picture of z.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import ArrayLike, BoolArray, FloatArray
from creeping.geometry.directions import unit_direction
from creeping.geometry.surface import Surface, normal, size


@dataclass(frozen=True)
class View:
    """A parallel projection.

    Attributes
    ----------
    azimuth, elevation : float
        Where the camera stands, radians; |elevation| < pi/2.
    """

    azimuth: float
    elevation: float

    @cached_property
    def toward(self) -> FloatArray:
        """Unit vector (3,) from the body to the camera."""
        a, e = self.azimuth, self.elevation
        return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])

    @cached_property
    def right(self) -> FloatArray:
        """Unit vector (3,) to the right of the picture."""
        return np.array([-np.sin(self.azimuth), np.cos(self.azimuth), 0.0])

    @cached_property
    def up(self) -> FloatArray:
        """Unit vector (3,) to the top of the picture."""
        return np.cross(self.toward, self.right)

    def project(self, points: FloatArray) -> FloatArray:
        """Coordinates (right, up) of points: (..., 3) -> (..., 2), L."""
        return np.asarray(points @ np.stack([self.right, self.up], axis=-1))

    def frame(self, points: FloatArray, *, margin: float = 0.04) -> tuple[FloatArray, FloatArray]:
        """Lower left and upper right corner (2,) of the picture of points (n, 3), with a margin, L."""
        flat = self.project(points)
        low, high = flat.min(axis=0), flat.max(axis=0)
        pad = margin * float(np.max(high - low))
        return low - pad, high + pad

    def visible(self, body: Surface, points: FloatArray) -> BoolArray:
        """Whether nothing of the body stands between points of it and the camera: (..., 3) -> (...)."""
        seen = np.zeros(points.shape[:-1], dtype=bool)
        finite = np.all(np.isfinite(points), axis=-1)
        seen[finite] = normal(body, points[finite]) @ self.toward > 0
        front = points[seen]
        # the first step clears the sag of curves drawn as polylines
        reach = size(body) * np.linspace(0.01, 2.0, 100)
        box = np.asarray(body.bounds)
        clear = np.ones(len(front), dtype=bool)
        for distance in reach:
            at = front + distance * self.toward
            inside = clear & np.all((at >= box[0]) & (at <= box[1]), axis=-1)
            if inside.any():
                clear[inside] = ~(body.level(at[inside]) < 0)
        seen[seen] = clear
        return seen


def shadow_view(direction: ArrayLike, turned: float = np.radians(35.0)) -> View:
    """View of the shadow side: along the direction of the wave, turned and raised so that the shadow line shows."""
    d = unit_direction(direction)
    # straight up or down every azimuth is as good; this one is the custom of 3-D plots
    azimuth = np.radians(-60.0) if np.hypot(d[0], d[1]) < 1e-6 else np.arctan2(d[1], d[0]) + turned
    # pulled to the horizon, so that z stays up: -42 to 66 degrees
    elevation = 0.6 * np.arcsin(np.clip(d[2], -1, 1)) + np.radians(12.0)
    return View(float(azimuth), float(elevation))
