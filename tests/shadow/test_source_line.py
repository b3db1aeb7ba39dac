"""Shadow lines of point sources: closed forms, other routes to curves and states, limits, and bad sources."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import unit
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

import creeping as cr
from creeping.geometry.surface import size
from creeping.geometry.triangulation import triangulate

BODIES = {
    "torus": sc.Torus,
    "triaxial": lambda: sc.Ellipsoid(1.0, 0.8, 0.6),
    "twisted": sc.TwistedEllipsoid,
    "peanut": lambda: sc.Implicit("(x**2 + y**2 + z**2 + 0.64)**2 - 2.56*x**2 - 0.6561"),
}


def sources(body, count, rng):
    """Places outside a body, some of them next to it or in its holes."""
    found = []
    while len(found) < count:
        x = rng.normal(size=3) * size(body) * rng.choice([0.3, 0.6, 1.0, 3.0])
        if body.level(x[None])[0] > 1e-3:
            found.append(x)
    return found


def curves_of_signs(body, source, mesh):
    """Number of closed curves between vertices that face a source and those that do not."""
    sees = np.sum(body.gradient(mesh.vertices) * (mesh.vertices - source), axis=1) >= 0
    mixed = mesh.triangles[np.ptp(sees[mesh.triangles].astype(int), axis=1) > 0]
    edges = np.sort(np.stack([mixed, np.roll(mixed, -1, axis=1)], axis=-1), axis=-1)
    crossed = sees[edges[..., 0]] != sees[edges[..., 1]]
    keys = (edges[..., 0] * len(mesh.vertices) + edges[..., 1])[crossed]
    triangle = np.nonzero(crossed)[0]
    order = np.argsort(keys, kind="stable")
    pairs = triangle[order].reshape(-1, 2)
    return connected_components(coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(mixed),) * 2))[0]


@pytest.mark.parametrize("distance", [1.0002, 3.0, 1e5])
def test_circle_on_a_sphere(distance):
    d = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)
    line = cr.shadow_line(sc.Sphere(2.0), source=cr.PointSource(-2 * distance * d))
    (curve,) = line.curves
    assert line.length == pytest.approx(4 * np.pi * np.sqrt(1 - distance**-2), rel=1e-10)
    np.testing.assert_allclose(-curve.points @ d, 2 / distance, atol=1e-11)
    np.testing.assert_allclose(curve.curvature, 0.5, rtol=1e-10)
    assert line.fractions["attached"] == 1.0
    assert np.abs(curve.grazing).max() < 1e-10


def test_two_circles_seen_from_the_middle_of_a_torus():
    line = cr.shadow_line(sc.Torus(), source=cr.PointSource((0, 0, 0)))
    # n.x = 0 where cos theta = -r/R
    assert [curve.length for curve in line.curves] == pytest.approx([1.5 * np.pi] * 2)
    assert sorted(curve.points[0, 2] for curve in line.curves) == pytest.approx([-np.sqrt(3) / 4, np.sqrt(3) / 4])
    assert line.fractions["attached"] == 1.0


@pytest.mark.parametrize("name", BODIES)
def test_curves_and_states_by_another_route(name, rng):
    body = BODIES[name]()
    mesh = triangulate(body, cells=120)
    share = np.linspace(1e-4, 1, 1500)[1:, None]
    for source in sources(body, 8, rng):
        line = cr.shadow_line(body, source=cr.PointSource(source), n_points=64)
        assert len(line.curves) == curves_of_signs(body, source, mesh)
        wrong = total = 0
        for curve in line.curves:
            away = curve.points - source
            p = unit(away)
            assert np.max(np.abs(np.sum(unit(body.gradient(curve.points)) * p, axis=1))) < 1e-9
            bent = np.einsum("ni,nij,nj->n", p, body.hessian(curve.points), p)
            hidden = [np.any(body.level(x - share * y) < -1e-9) for x, y in zip(curve.points, away, strict=True)]
            expected = np.where(bent <= 0, "concave", np.where(hidden, "occluded", "attached"))
            wrong, total = wrong + np.sum(curve.status != expected), total + len(expected)
        # next to where a state ends either may be right
        assert wrong <= 0.02 * total


def test_a_far_source_is_a_plane_wave():
    body, d = BODIES["twisted"](), np.array([0.48, 0.6, 0.64])
    plane = cr.shadow_line(body, direction=d)
    gaps = []
    for distance in (1e2, 1e3, 1e4):
        line = cr.shadow_line(body, source=cr.PointSource(-distance * d))
        assert len(line.curves) == len(plane.curves)
        gaps.append(abs(line.length - plane.length))
        assert line.fractions == pytest.approx(plane.fractions, abs=10 / distance)
    assert gaps[0] > 5 * gaps[1] > 25 * gaps[2]
    assert gaps[2] < 1e-3
    wave = cr.shadow_line(body, source=cr.PlaneWave(d))
    assert wave.source == plane.source
    np.testing.assert_array_equal(wave.curves[0].points, plane.curves[0].points)


def test_arcs_end_where_states_change():
    line = cr.shadow_line(BODIES["torus"](), source=cr.PointSource((1.9, 0.3, 0.2)))
    assert min(line.fractions.values()) > 0.01
    assert sum(line.fractions.values()) == pytest.approx(1.0)
    launch = line.launch_points(64)
    assert np.all(launch.there)
    away = launch.points[0] - (1.9, 0.3, 0.2)
    np.testing.assert_allclose(launch.headings[0], unit(away), atol=1e-12)
    np.testing.assert_allclose(launch.phase[0], np.linalg.norm(away, axis=1), rtol=1e-12)
    np.testing.assert_allclose(launch.openings[0] * launch.phase[0], 1.0, rtol=1e-12)


def test_a_source_over_a_point_of_vanishing_curvature_is_near_singular():
    # from the axis of the torus along the top circle, where K = 0 and the circle's tangent is the null direction
    body = BODIES["torus"]()
    with pytest.raises(cr.SingularIncidenceError, match="move the source"):
        cr.shadow_line(body, source=cr.PointSource((1.0, -1.2, 0.5)))
    near = cr.shadow_line(body, source=cr.PointSource((1.0, -1.2, 0.52)))
    assert 0 < near.singular_distance < 0.05


@pytest.mark.parametrize(
    ("source", "match"),
    [
        ((0, 0, 0.3), "inside the body or on it"),
        ((0, 0, 1), "inside the body or on it|above it"),
        ((0, 0, 1 + 1e-8), "source_pattern"),
        ((0, 0, 1e9), "give a PlaneWave"),
        ((0, 0, np.nan), "three finite numbers"),
        ((0, 0), "three finite numbers"),
        ((0, 0, 1j), "complex"),
        ("here", "numbers"),
    ],
)
def test_bad_places(source, match):
    with pytest.raises(cr.InvalidInputError, match=match):
        cr.shadow_line(sc.Sphere(), source=cr.PointSource(source))


def test_one_wave_exactly():
    source = cr.PointSource((0, 0, 2))
    for given, match in (({}, "neither"), ({"direction": (1, 0, 0), "source": source}, "both")):
        with pytest.raises(cr.InvalidInputError, match=match):
            cr.shadow_line(sc.Sphere(), **given)
    with pytest.raises(cr.InvalidInputError, match="PointSource"):
        cr.shadow_line(sc.Sphere(), source=(0, 0, 2))
    with pytest.raises(cr.InvalidInputError, match="smooth body"):
        cr.shadow_line(sc.Cylinder(0.5, 1.0), source=source)


def test_waves_are_values():
    assert cr.PointSource([1, 2, 3]) == cr.PointSource((1.0, 2.0, 3.0))
    assert len({cr.PlaneWave((0, 0, 1)), cr.PlaneWave((0, 0, 5)), cr.PlaneWave((0, 1, 0))}) == 2
    line = cr.shadow_line(sc.Sphere(), source=cr.PointSource((0, 0, 2)))
    assert "source (0, 0, 2)" in repr(line)
    for of in (line, line.curves[0], line.launch_points(8)):
        with pytest.raises(cr.InvalidInputError, match="source_pattern"):
            getattr(of, "directions" if hasattr(type(of), "directions") else "direction")
