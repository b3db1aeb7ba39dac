"""Seconds of integrals over near tiles, beside those that `creeping.field.equation.effort` expects by its constants."""

import time

import pytest
import trimesh

import scatterers as sc
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.effort import equation_boundary, load_on
from creeping.field.equation.matrix import Matrix
from creeping.kernels.threads import thread_count
from tests.exact_meshes import geodesic_sphere

pytestmark = pytest.mark.slow
CASES = {
    "cylinder": lambda: (sc.Cylinder(1.0, 2.0), 8.0),
    "sphere": lambda: (sc.Sphere(), 12.0),
    "almond": lambda: (sc.Almond(2.0), 15.0),
    "torus": lambda: (sc.Torus(1.0, 0.4), 10.0),
    "facets": lambda: (sc.Facets(trimesh.Trimesh(*geodesic_sphere(16))), 12.0),
}


@pytest.mark.parametrize("coarse", [False, True])
@pytest.mark.parametrize("kind", ["hard", "soft", "pec"])
@pytest.mark.parametrize("which", CASES)
def test_integrals_over_near_tiles(benchmark, which, kind, coarse):
    (body, k), boundary = CASES[which](), equation_boundary(kind)
    tiles = body_tiles(body, k, boundary, coarse=coarse)
    matrix, form = Matrix(tiles, k, boundary), "slope" if kind == "soft" else "double"
    matrix.near(matrix.nodes.part(slice(0, 8)), form)
    begun = time.process_time()
    benchmark.pedantic(matrix.near, (matrix.nodes, form), rounds=1)
    taken, told = time.process_time() - begun, load_on(tiles, k, boundary).near * thread_count() / 2
    benchmark.extra_info.update(nodes=len(tiles.points), taken=taken, told=told)
    print(f"{which} {kind} coarse {coarse}: {len(tiles.points)} nodes, {taken:.2f} CPU s, {told:.2f} expected")
    assert told > 0
