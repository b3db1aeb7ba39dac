"""CAD bodies whose faces join smoothly while the curvature jumps: joints, and the side of each piece."""

import numpy as np
import pytest
from cad_files import made

import scatterers as sc

pytest.importorskip("gmsh", exc_type=ImportError)
pytestmark = pytest.mark.slow

MAKER = """
make.fillet([make.addBox(0, 0, 0, 60, 40, 30)], list(range(1, 13)), [6.0])
write("filleted_box.step")
"""


@pytest.fixture(scope="module")
def filleted(tmp_path_factory):
    return made(tmp_path_factory.mktemp("cad"), MAKER) / "filleted_box.step"


def test_a_box_with_all_edges_filleted_is_told_by_its_joints(filleted):
    """No edge, no bad vertex: the curvature jumps all over the mesh, so that jets see nothing odd."""
    body, r = sc.Cad(filleted, points=1000, cache=False), 6e-3
    # 6 planes, 12 quarters of cylinders, 8 of balls; each of 24 + 24 joints a line or a quarter of a circle
    half, inner = np.array([30e-3, 20e-3, 15e-3]), np.array([24e-3, 14e-3, 9e-3])
    straight = [round(2 * side, 6) for side in inner for _ in range(8)]
    assert len(body.pieces) == 26 and {crease.kind for crease in body.creases} == {"joint"}
    assert body.quality.verdict == "curvature jumps"
    assert body.quality.jumps == pytest.approx((sum(straight) + 24 * np.pi / 2 * r) / body.quality.edge_mean, rel=0.15)
    lengths = np.sort([crease.length for crease in body.creases])
    np.testing.assert_allclose(lengths, np.sort([*straight, *24 * [np.pi / 2 * r]]), rtol=5e-3)

    def exact(x):
        q = np.abs(x - half) - inner
        return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(axis=-1), 0) - r

    # next to the body, where four pieces meet as well
    x = half + np.random.default_rng(2).uniform(-1, 1, size=(20_000, 3)) * (half + 1e-3)
    away = exact(x)
    near = (np.abs(away) > 1e-6) & (np.abs(away) < 1e-4)
    assert near.sum() > 200
    np.testing.assert_array_equal(body.level(x[near]) > 0, away[near] > 0)
    np.testing.assert_allclose(body.level(x[near]), away[near], atol=2e-6)
