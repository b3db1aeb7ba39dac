"""Coordinates of the bundle in which a map is stored and composed.

A model says where a ray lies on the grid, what displacement is stored there, and how a displacement moves a ray:

    AmbientModel    (x, p) itself; any atlas. Stored: x' - x - t p and p' - p. Each leap ends back on T1Q.
    RotationModel   x = psi(s), s on the unit sphere: the rotation R = [s, q, s x q]. Stored: the quaternion of R^-1 R'.
    OctantModel     the same on an eighth of the sphere, if the coordinate planes are mirrors of the body.
    AngleModel      one doubly periodic chart: (u, v, angle) in turns. Stored: their differences.
    MeridianModel, RingModel    rotations and angles of bodies of revolution: the table has no axis u, the azimuth.

All but the first stay on T1Q whatever the error of the map, need no evaluation of F, and have four lanes.

Maps stored in space, for any atlas, are D = x' - x - t p and p' - p at (chart, u, v, angle), with p = E (cos angle, sin
angle) and E(u, v) the polar frame of the chart (`creeping.geometry.evaluators.polar_frame`). A leap ends off T1Q by the
error of the map and is put back.

Also here: maps of bodies of revolution: tables without the azimuth.

The flow commutes with turns about the axis (`creeping.geometry.revolution`), so a displacement of rotations or of
angles depends on where a ray is along the meridian and on its angle from it: two axes of a table instead of three. The
first axis of the grid, u, has one node.

Sources: [YC06b]; Derivations, B2, R15 and R18.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import SurfaceError
from creeping.geometry.directions import tangent_frames
from creeping.geometry.evaluators import evaluators, is_compiled, locator, polar_frame
from creeping.geometry.revolution import charted_axis
from creeping.geometry.surface import Surface, size
from creeping.kernels.threads import in_threads, pause
from creeping.phaseflow.rotation import AngleModel, CompiledModel, OctantModel, RotationModel, quaternions
from creeping.phaseflow.splines import Grid, Leap


@dataclass(frozen=True, eq=False)
class AmbientModel:
    """(x, p) in space, charts as the atlas gives them.

    Attributes
    ----------
    body : Surface
    name : str
        What stored maps call it.
    lanes : int
        Numbers stored for a displacement.
    is_flat : bool
        Whether displacements do not depend on u.
    unit : float
        Error of (x, p), x in body sizes, that an error of 1 of a displacement makes at most.
    """

    body: Surface
    name: str = "ambient"
    lanes: int = 8
    is_flat: bool = False
    unit: float = 1.0

    @property
    def charts(self) -> int:
        """Charts of the atlas."""
        return len(self.body.atlas.charts)

    @property
    def periodic(self) -> tuple[bool, bool]:
        """Whether u and v of the charts have period 1.

        Raises
        ------
        SurfaceError
            If they differ from chart to chart.
        """
        kinds = {tuple(chart.periodic) for chart in self.body.atlas.charts}
        if len(kinds) != 1:
            raise SurfaceError(
                f"the charts of the atlas differ in periodicity ({sorted(kinds)}); use charts of one kind"
            )
        first, second = kinds.pop()
        return first, second

    def at(self, chart: int, u: FloatArray, v: FloatArray, angle: FloatArray) -> FloatArray:
        """Coordinates of points of a chart, u and v in [0, 1] on its square, angle in radians: (n,) x 3 -> (n, 6)."""
        one = self.body.atlas.charts[chart]
        uv = np.stack([u, v], axis=-1)
        frame = polar_frame(one.tangents(uv))
        directions = np.cos(angle)[:, None] * frame[..., 0] + np.sin(angle)[:, None] * frame[..., 1]
        return np.concatenate([one.point(uv), directions], axis=1)

    def states(self, coordinates: FloatArray) -> FloatArray:
        """States are the coordinates themselves: (n, 6) -> (n, 6)."""
        return coordinates

    def displacement(self, nodes: FloatArray, traced: FloatArray, times: FloatArray) -> FloatArray:
        """x' - x - t p and p' - p of the last of the traced states (n, m, 6 or more), padded to eight lanes: (n, 8)."""
        values = np.zeros((len(nodes), 8))
        values[:, :6] = traced[:, -1, :6] - nodes
        values[:, :3] -= times[-1] * nodes[:, 3:]
        return values

    def flow(self, grid: Grid, leap: Leap, states: FloatArray, counts: IntArray) -> FloatArray:
        """Compose counts[0], then counts[1], ... maps on states (n, 6 or 10): (n, m, the same)."""
        from creeping.phaseflow.kernels.composition import leap_in_space

        current = np.array(states, dtype=float, order="C")
        out = np.empty((len(states), len(counts), states.shape[1]))
        # so near a composed ray counts as on the body
        off = 1e-13 * size(self.body)
        tables = leap.state, leap.jacobi, grid.degree, grid.origin, grid.cells
        with evaluators(self.body) as parts, locator(self.body) as place:
            for k, count in enumerate(counts.tolist()):

                def run(part: slice, count: int = count) -> None:
                    # a map composed with itself in place may be left in between, every 0.1 s for a block
                    for done in range(0, count, 1000):
                        some = min(1000, count - done)
                        leap_in_space(*place, *parts[:2], *tables, leap.time, some, off, current[part])
                        pause()

                in_threads(run, len(current))
                out[:, k] = current
        return out


Model = AmbientModel | CompiledModel
"""What a map needs of its coordinates: the same attributes and methods; see the module head."""


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
    `phaseflow.kernels.surface_table.locate_meridian`.
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

    def placement(self, grid: Grid) -> tuple[FloatArray, FloatArray]:
        """See `CompiledModel`; the axis follows the shift."""
        return grid.cells, np.array([*grid.origin, 0.0, *self.axis])

    def at(self, chart: int, u: FloatArray, v: FloatArray, angle: FloatArray) -> FloatArray:
        """As for all models; v beyond [0, 1] goes on over the pole."""
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
