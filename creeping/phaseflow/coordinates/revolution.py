"""Maps of bodies of revolution: tables without the azimuth.

The flow commutes with turns about the axis (`creeping.geometry.revolution`), so a displacement of rotations or of
angles depends on where a ray is along the meridian and on its angle from it: two axes of a table instead of three. The
first axis of the grid, u, has one node.

Sources: Derivations, R18.
"""

from functools import cached_property

import numpy as np

from creeping._typing import FloatArray
from creeping.geometry.revolution import charted_axis
from creeping.geometry.surface import Surface
from creeping.phaseflow.coordinates.quaternions import quaternions
from creeping.phaseflow.coordinates.rotation import AngleModel, RotationModel
from creeping.phaseflow.grid import Grid


class MeridianModel(RotationModel):
    """Rotations on a body of revolution that is an image of the sphere: one chart, the meridian from pole to pole.

    u is the azimuth in turns, v = theta/pi with theta the angle from the axis on the sphere; see
    `phaseflow.kernels.meridian`.
    """

    name = "meridian"
    kind = 3
    charts = 1
    periodic = (True, False)
    is_flat = True

    def __init__(self, body: Surface) -> None:
        super().__init__(body)
        axis = charted_axis(body)
        assert axis is not None
        self.axis = axis

    @cached_property
    def _surface_table(self) -> FloatArray:
        return RotationModel(self.body)._surface_table

    def placement(self, grid: Grid) -> tuple[FloatArray, FloatArray]:
        """See `CompiledModel`; the axis follows the shift."""
        return grid.cells, np.array([*grid.origin, 0.0, *self.axis])

    def at(self, chart: int, u: FloatArray, v: FloatArray, angle: FloatArray) -> FloatArray:
        """See `Model`; v beyond [0, 1] goes on over the pole."""
        first = np.cross(self.axis, np.eye(3)[np.argmin(np.abs(self.axis))])
        first /= np.linalg.norm(first)
        azimuth, theta, angle = (np.asarray(t)[..., None] for t in (2 * np.pi * u, np.pi * np.asarray(v), angle))
        outwards = np.cos(azimuth) * first + np.sin(azimuth) * np.cross(self.axis, first)
        s = np.cos(theta) * self.axis + np.sin(theta) * outwards
        south = np.cos(theta) * outwards - np.sin(theta) * self.axis
        return quaternions(s, np.cos(angle) * south + np.sin(angle) * np.cross(s, south))


class RingModel(AngleModel):
    """(u, v, angle) in turns on the doubly periodic chart of a body of revolution, u its azimuth."""

    name = "ring"
    is_flat = True
