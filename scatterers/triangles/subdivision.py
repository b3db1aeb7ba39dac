"""A finer smooth surface by the vertices of a coarse mesh, and what these vertices leave open.

Loop's subdivision, of trimesh, has a smooth surface as its limit, which passes near the vertices it is given: these are
moved first, so that it passes near the ones of the mesh. With x -> S x the subdivision, read at the vertices that were
there before, S(2x - S x) misses x by (1 - S)^2 x where S x misses it by (1 - S) x: a tenth where edges turn little,
more than half of a cube.

Curvature that changes within an edge is not in a mesh. A fit to it has of a curvature kappa about

    kappa(v) - mean over the neighbours of v of kappa,   times max(1, turn^2),

wrong at a vertex v with edges e, turn the largest of kappa_n(e) e: half of the first by the interpolation, all of it
where the fit is the smoother for its grid; and over edges that turn by more than a radian it is less than that of the
body, by about that factor. Where they turn by more than `BLIND` nothing is known.

Sources: [L87] Loop, Smooth subdivision surfaces based on triangles, University of Utah 1987; Derivations, B6.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from creeping._typing import FloatArray, IntArray
from scatterers.triangles.topology import edges_of

Note = Callable[[str], None]
BLIND = 1.5
"""kappa_n(e) e beyond which a mesh shows nothing of the curvature, radians."""


class Source(NamedTuple):
    """The mesh that was subdivided.

    Attributes
    ----------
    vertices, edges : (n, 3), L, and (k, 2)
        Edges as numbers of their ends.
    """

    vertices: FloatArray
    edges: IntArray


class Subdivision(NamedTuple):
    """A subdivided mesh, and the same with its surface nearer to the vertices of the source.

    Attributes
    ----------
    vertices, triangles : (n, 3), L, and (m, 3)
    nearer : (n, 3)
        What the vertices are when the surface is moved by what it still misses.
    source : Source
    times : int
    """

    vertices: FloatArray
    triangles: IntArray
    nearer: FloatArray
    source: Source
    times: int


def subdivided(vertices: FloatArray, triangles: IntArray, times: int, note: Note) -> Subdivision:
    """Loop's subdivision, ``times`` times; vertices are first moved against its shift, which ``note`` is told.

    Raises
    ------
    ValueError
        If it would have more than 300 000 vertices.
    """
    import trimesh

    if len(vertices) * 4**times > 300_000:
        raise ValueError(
            f"subdivide = {times} makes {len(vertices) * 4**times} vertices of {len(vertices)}, more than 300000; "
            + ("subdivide fewer times" if times > 1 else "take the mesh as it is")
        )

    def subdivision(x: FloatArray) -> tuple[FloatArray, IntArray]:
        fine, corners = trimesh.remesh.subdivide_loop(x, triangles, iterations=times)
        return np.asarray(fine, dtype=float), np.asarray(corners, dtype=np.int64)

    count, bases = len(vertices), [vertices]
    found = []
    for _ in range(3):
        # the first vertices are the old ones, moved
        found.append(subdivision(bases[-1]))
        bases.append(bases[-1] + vertices - found[-1][0][:count])
    fine, corners = found[1]
    moved = np.linalg.norm(fine[:count] - vertices, axis=1)
    rms, most = float(np.sqrt(np.mean(moved**2))), float(moved.max())
    edge = float(np.mean(np.linalg.norm(vertices[triangles] - np.roll(vertices[triangles], 1, axis=1), axis=2)))
    note(
        f"subdivided {times} time{'s' * (times != 1)} after Loop: {count} vertices became {len(fine)}, "
        f"moved by {rms:.2g} m rms, {most:.2g} at most (mean edge {edge:.2g} m)"
    )
    return Subdivision(fine, corners, found[2][0], Source(vertices, edges_of(triangles).ends), times)


def edges_where_curved(vertices: FloatArray, triangles: IntArray, curvature: FloatArray) -> float:
    """Mean edge at vertices (n, 3), L, weighted by the fourth power of ``curvature`` (n,), 1/L.

    It is the edge that has to show the curvature, and half the mean edge or less where a mesh is drawn out. Vertices
    without a curvature do not count; if all are such, all do.
    """
    ends = edges_of(triangles).ends
    known = np.where(np.isfinite(curvature), curvature, 0.0)
    weight = (known / known.max()) ** 4 if known.max() > 0 else np.ones(len(vertices))
    length = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)
    total = sum(np.bincount(end, length, minlength=len(vertices)) for end in ends.T)
    return float(np.average(total / np.bincount(ends.ravel(), minlength=len(vertices)), weights=weight))


def turns(source: Source, along: Callable[[FloatArray, FloatArray], FloatArray]) -> FloatArray:
    """Largest kappa_n(e) e of the edges at each vertex (n,), by curvatures at points along directions, 1/L."""
    ends = source.edges.T.ravel()
    edges = np.tile(source.vertices[source.edges[:, 1]] - source.vertices[source.edges[:, 0]], (2, 1))
    length = np.linalg.norm(edges, axis=1)
    found = np.zeros(len(source.vertices))
    np.maximum.at(found, ends, np.abs(along(source.vertices[ends], edges / length[:, None])) * length)
    return found


def unseen(source: Source, turn: FloatArray, principal: FloatArray, gauss: FloatArray) -> tuple[float, float]:
    """Rms of what a mesh cannot show of principal curvatures (n, 2), 1/L, and of K (n,), 1/L^2, by those of its fit.

    Vertices at which it shows nothing at all are left out.
    """
    values = np.column_stack([principal, gauss])
    first, last = np.concatenate([source.edges, source.edges[:, ::-1]]).T
    total = np.stack([np.bincount(first, one[last], minlength=len(values)) for one in values.T], axis=1)
    of_neighbours = total / np.bincount(first, minlength=len(values))[:, None]
    left = np.maximum(1.0, turn**2)[:, None] * (values - of_neighbours)
    left = left[turn <= BLIND]
    return float(np.sqrt(np.mean(left[:, :2] ** 2))), float(np.sqrt(np.mean(left[:, 2] ** 2)))
