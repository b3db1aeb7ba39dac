"""Monge charts of a body F = 0, graphs over squares in its tangent planes, and an atlas of them, for any genus.

With x0 on the body, N = n(x0), E1 and E2 tangent, E1 x E2 = N, w the half width, and g = grad F,

    x(u, v) = x0 + q + h N,   q = w ((2u - 1) E1 + (2v - 1) E2),   F(x(u, v)) = 0,
    x_u = 2w (E1 - N (g.E1)/(g.N)),   x_v = 2w (E2 - N (g.E2)/(g.N)).

A point belongs to the chart for which max(|2u - 1|, |2v - 1|) is least, (2u - 1, 2v - 1) = (E1, E2).(x - x0)/w, among
those listed for its voxel with n.N >= VALID and the height within bounds. The polar frame of such a chart is the
least rotation that takes N to n,

    t_i = E_i - (E_i.n)(n + N)/(1 + n.N).

Sources: Derivations, B3.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import cached
from scatterers.charts.cover import MongeCharts, covered_by, probes
from scatterers.charts.samples import Field
from scatterers.kernels.charts import ATLAS
from scatterers.kernels.compiled import Compiled, call


@dataclass(frozen=True, eq=False)
class MongeChart:
    """One chart of the atlas."""

    graph: MongeCharts
    periodic: tuple[bool, bool] = (False, False)

    def point(self, uv: FloatArray) -> FloatArray:
        """Point of the body: (..., 2) -> (..., 3), L."""
        uv = np.asarray(uv, dtype=float)
        flat = uv.reshape(-1, 2)
        # the nodes of a map repeat (u, v) for every angle
        single, where = np.unique(flat[:, 0] + 1j * flat[:, 1], return_inverse=True)
        points = self.graph.points(np.stack([single.real, single.imag], axis=-1))
        return points[where].reshape(*uv.shape[:-1], 3)

    def tangents(self, uv: FloatArray) -> FloatArray:
        """Columns x_u, x_v: (..., 2) -> (..., 3, 2), L."""
        e, n = self.graph.axes[:2], self.graph.axes[2]
        g = self.graph.gradient(self.point(uv))
        slope = (g @ e.T) / self.graph._lean(g, n)[..., None]
        return np.asarray(2 * self.graph.half * (e.T - n[:, None] * slope[..., None, :]))


@dataclass(frozen=True, eq=False)
class MongeAtlas:
    """Monge charts that cover a body.

    Attributes
    ----------
    graphs : MongeCharts
    parameters : (k,)
        Charts and table of voxels, as `scatterers.kernels.charts` orders them.
    """

    graphs: MongeCharts
    parameters: FloatArray

    @property
    def margin(self) -> float:
        """How far charts reach beyond their unit squares on every side, in half widths of these."""
        return float(self.parameters[ATLAS.outside]) - 1.0

    @classmethod
    def covering(
        cls, level: Field, gradient: Field, hessian: Field, cloud: FloatArray, *, margin: float = 0.6
    ) -> "MongeAtlas":
        """Cover the body F = 0.

        Parameters
        ----------
        level, gradient, hessian : callable
            F and its derivatives, (..., 3) -> (...), (..., 3) and (..., 3, 3).
        cloud : (n, 3), L
            Points spread evenly over the whole body, such as `scatterers.fits.cloud.body_cloud` gives, a tenth of the
            least radius of curvature apart or less.
        margin : float
            How far charts reach beyond their unit squares, in half widths: splines have nodes there.

        Raises
        ------
        ValueError
            If the cloud is no array of finite points, or charts do not cover the body: the cloud is too coarse for it,
            or it has thin or sharp parts.
        """
        cloud = _checked(cloud)
        # times that the cloud is completed where the atlas misses a point between
        for _ in range(4):
            atlas = cls(*covered_by(level, gradient, hessian, cloud, margin))
            # points of other places than those that the charts were chosen by
            other = probes(level, gradient, cloud, seed=1)
            missed = other[~atlas._holds(other)]
            if not len(missed):
                return atlas
            cloud = np.concatenate([cloud, missed])
        raise ValueError(
            f"{len(missed)} of {len(other)} points of the body lie in no chart (first near "
            f"{missed[0].round(4).tolist()}); give a denser cloud, or a body without thin or sharp parts"
        )

    def _holds(self, points: FloatArray) -> BoolArray:
        """Whether points (n, 3) are in the unit squares of their charts and, tried for each eighth, on their sheet."""
        chart, uv = self.locate(points)
        inside = (chart >= 0) & np.all((uv >= 0) & (uv <= 1), axis=-1)
        some = np.flatnonzero(inside)[::8]
        back = self.graphs[chart[some]]
        inside[some] = np.linalg.norm(back.points(uv[some]) - points[some], axis=-1) < 1e-6 * back.half
        return np.asarray(inside)

    @cached
    def charts(self) -> Sequence[MongeChart]:
        """All charts."""
        return tuple(MongeChart(self.graphs[k]) for k in range(len(self.graphs.half)))

    def locate(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Chart number (...) and chart variables (..., 2) of points (..., 3); -1 and NaN where there is none."""
        x = np.ascontiguousarray(np.reshape(points, (-1, 3)).T, dtype=float)
        normal, n = np.ascontiguousarray(self.graphs.gradient(x.T).T), x.shape[1]
        chart, uv = np.empty(n, np.int64), np.empty((2, n))
        call(self.compiled.function, x, normal, chart, uv, np.empty((6, n)), self.parameters)
        # the locator takes a chart for every point; by these it is known whether it is one
        row = self.parameters[ATLAS.charts : int(self.parameters[ATLAS.voxels])].reshape(-1, ATLAS.width)[chart]
        height = np.einsum("in,ni->n", x, row[:, 9:12]) - np.einsum("ni,ni->n", row[:, :3], row[:, 9:12])
        with np.errstate(invalid="ignore"):
            lean = np.einsum("in,ni->n", normal, row[:, 9:12]) / np.linalg.norm(normal, axis=0)
        none = ~((lean >= self.parameters[ATLAS.lean]) & (height >= row[:, 13]) & (height <= row[:, 14]))
        chart[none], uv[:, none] = -1, np.nan
        return chart.reshape(np.shape(points)[:-1]), uv.T.reshape(*np.shape(points)[:-1], 2)

    def arrays(self) -> dict[str, FloatArray]:
        """All that `restored` needs besides F."""
        graphs = self.graphs
        found = {"centres": graphs.centres, "axes": graphs.axes, "half": graphs.half, "bend": graphs.bend}
        return found | {"parameters": self.parameters}

    @classmethod
    def restored(cls, level: Field, gradient: Field, arrays: Mapping[str, FloatArray]) -> "MongeAtlas":
        """The atlas whose `arrays` these are, of the same F."""
        parts = (np.ascontiguousarray(arrays[name], dtype=float) for name in ("centres", "axes", "half", "bend"))
        graphs = MongeCharts(level, gradient, *parts)
        return cls(graphs, np.ascontiguousarray(arrays["parameters"], dtype=float))

    @property
    def digest(self) -> str:
        """Text that tells atlases apart: what is stored on the charts of one is of no use on those of another."""
        return hashlib.blake2b(self.parameters.tobytes(), digest_size=8).hexdigest()

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled locator."""
        from scatterers.kernels.charts import locate_graph

        return Compiled(locate_graph, "locator", self.parameters)


def _checked(cloud: FloatArray) -> FloatArray:
    # points that determine neighbours
    fewest = 16
    cloud = np.ascontiguousarray(cloud, dtype=float)
    if cloud.ndim != 2 or cloud.shape[1] != 3 or len(cloud) < fewest:
        raise ValueError(f"the cloud has shape {cloud.shape}; give (n, 3) with at least {fewest} points of the body")
    if bad := int(np.sum(~np.all(np.isfinite(cloud), axis=-1))):
        raise ValueError(f"{bad} of {len(cloud)} points of the cloud are not finite; leave them out")
    return cloud
