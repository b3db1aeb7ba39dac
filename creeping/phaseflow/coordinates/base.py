"""Coordinates of the bundle in which a map is stored and composed.

A model says where a ray lies on the grid, what displacement is stored there, and how a displacement moves a ray:

    AmbientModel    (x, p) itself; any atlas. Stored: x' - x - t p and p' - p. Each leap ends back on T1Q.
    RotationModel   x = psi(s), s on the unit sphere: the rotation R = [s, q, s x q]. Stored: the quaternion of R^-1 R'.
    OctantModel     the same on an eighth of the sphere, if the coordinate planes are mirrors of the body.
    AngleModel      one doubly periodic chart: (u, v, angle) in turns. Stored: their differences.
    MeridianModel, RingModel    rotations and angles of bodies of revolution: the table has no axis u, the azimuth.

All but the first stay on T1Q whatever the error of the map, need no evaluation of F, and have four lanes.

Also here: maps of bodies of revolution: tables without the azimuth.

The flow commutes with turns about the axis (`creeping.geometry.revolution`), so a displacement of rotations or of
angles depends on where a ray is along the meridian and on its angle from it: two axes of a table instead of three. The
first axis of the grid, u, has one node.

Sources: Derivations, R15 and R18.
"""

from functools import cached_property
from typing import Protocol

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.geometry.directions import tangent_frames
from creeping.geometry.evaluators import is_compiled
from creeping.geometry.revolution import charted_axis
from creeping.geometry.surface import Surface, size
from creeping.phaseflow.coordinates.ambient import AmbientModel
from creeping.phaseflow.coordinates.rotation import AngleModel, OctantModel, RotationModel, quaternions
from creeping.phaseflow.splines import Grid, Leap


class Model(Protocol):
    """What a map needs of its coordinates; see the module head."""

    @property
    def body(self) -> Surface:
        """The body whose flow it is."""
        ...

    @property
    def name(self) -> str:
        """What stored maps call it."""
        ...

    @property
    def lanes(self) -> int:
        """Numbers stored for a displacement."""
        ...

    @property
    def charts(self) -> int:
        """Charts of the grid."""
        ...

    @property
    def periodic(self) -> tuple[bool, bool]:
        """Whether u and v of the charts have period 1."""
        ...

    @property
    def is_flat(self) -> bool:
        """Whether displacements do not depend on u."""
        ...

    @property
    def unit(self) -> float:
        """Error of (x, p), x in body sizes, that an error of 1 of a displacement makes at most."""
        ...

    def at(self, chart: int, u: FloatArray, v: FloatArray, angle: FloatArray) -> FloatArray:
        """Coordinates of points of a chart, u and v in [0, 1] on its square, angle in radians: (n,) x 3 -> (n, k)."""
        ...

    def states(self, coordinates: FloatArray) -> FloatArray:
        """Points and directions: (n, k) -> (n, 6)."""
        ...

    def displacement(self, nodes: FloatArray, traced: FloatArray, times: FloatArray) -> FloatArray:
        """Stored quantity of the last of the traced states (n, m, 6 or more), followed to it: (n, lanes)."""
        ...

    def flow(self, grid: Grid, leap: Leap, states: FloatArray, counts: IntArray) -> FloatArray:
        """Compose counts[0], then counts[1], ... maps on states (n, 6, 10 or 12): (n, m, the same)."""
        ...


def nodes_of(model: Model, grid: Grid) -> FloatArray:
    """Coordinates of the nodes of all charts: (charts nu nv na, k)."""
    shape = [values.ravel() for values in np.meshgrid(*grid.axes(), indexing="ij")]
    return np.concatenate([model.at(chart, *shape) for chart in range(model.charts)])


def model_of(body: Surface, name: str | None = None) -> Model:
    """Model of a body: the one named, or the fastest it allows."""
    if name != "ambient" and is_compiled(body):
        atlas: Any = body.atlas
        revolved = name in (None, "meridian", "ring") and charted_axis(body) is not None
        if hasattr(getattr(atlas, "sphere_map", None), "compiled_forward"):
            if revolved:
                return MeridianModel(body)
            folds = name == "octant" or (name is None and has_mirrors(body))
            return OctantModel(body) if folds else RotationModel(body)
        if getattr(atlas, "compiled_forward", None) is not None and all(atlas.charts[0].periodic):
            return RingModel(body) if revolved else AngleModel(body)
    return AmbientModel(body)


def has_mirrors(body: Surface) -> bool:
    """Whether the body says that the coordinate planes are its mirrors, and its sphere map agrees.

    A speed has no say in it: a weighted flow is not folded.
    """
    if not getattr(body, "mirrors", False) or getattr(body, "speed", None) is not None:
        return False
    sphere_map: Any = getattr(body.atlas, "sphere_map", None)
    s = np.random.default_rng(0).normal(size=(50, 3))
    s /= np.linalg.norm(s, axis=1, keepdims=True)
    points = sphere_map.forward(s)
    flips = 1.0 - 2.0 * np.eye(3)
    gaps = [np.abs(sphere_map.forward(s * flip) - points * flip).max() for flip in flips]
    return bool(max(gaps) <= 1e-13 * size(body))


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
        first, second = tangent_frames(self.axis)
        azimuth, theta, angle = (np.asarray(t)[..., None] for t in (2 * np.pi * u, np.pi * np.asarray(v), angle))
        outwards = np.cos(azimuth) * first + np.sin(azimuth) * second
        s = np.cos(theta) * self.axis + np.sin(theta) * outwards
        south = np.cos(theta) * outwards - np.sin(theta) * self.axis
        return quaternions(s, np.cos(angle) * south + np.sin(angle) * np.cross(s, south))


class RingModel(AngleModel):
    """(u, v, angle) in turns on the doubly periodic chart of a body of revolution, u its azimuth."""

    name = "ring"
    is_flat = True
