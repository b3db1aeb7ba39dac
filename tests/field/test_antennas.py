"""Slots and monopoles on one conductor: series of the sphere, dipoles inside, the plane's limit, signs, blocks."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.errors import InvalidInputError
from creeping.files import write_touchstone
from creeping.geometry.surface import normal, project
from studies.reference.antennas import plane_antennas, slots_of_monopoles, sphere_antennas
from studies.reference.clouds import ellipsoid

DEGREES = np.array([5, 10, 20, 40, 60, 90, 120, 139, 161, 165, 170, 175, 177])
HEIGHTS = (0.03, 0.05, 0.07, 0.09, 0.12)
AXES = (0.75, 0.9, 1.15)


def on_sphere(degrees):
    """Places on a meridian, and b = n x t there, t away from the pole: (n, 3), (3,)."""
    s, b = np.radians(degrees), np.array([-np.sin(0.3), np.cos(0.3), 0.0])
    return np.stack([np.sin(s) * np.cos(0.3), np.sin(s) * np.sin(0.3), np.cos(s)], axis=1), b


@pytest.fixture(scope="module")
def both():
    """Slots, their axes, and monopoles on an ellipsoid."""
    rng = np.random.default_rng(4)
    v = rng.normal(size=(14, 3))
    ports = v / np.linalg.norm(v, axis=1, keepdims=True) * [1.0, 0.8, 0.6]
    return ports[:8], rng.normal(size=(8, 3)), ports[8:]


@pytest.mark.parametrize(("ka", "most"), [(10.0, 0.03), (30.0, 0.009), (100.0, 0.0025)])
def test_sphere_against_partial_waves(ka, most):
    """E of a slot at monopoles, and H at slots of a monopole, b of the path from it: the same."""
    away, b = on_sphere(DEGREES)
    exact, pole = sphere_antennas(ka, 1.0, np.radians(DEGREES)), [(0, 0, 1.0)]
    slot = cr.antenna_coupling(sc.Sphere(), pole, b, away, wavenumber=ka)
    monopole = cr.antenna_coupling(sc.Sphere(), away, b, pole, wavenumber=ka)
    for found, part in ((slot, (0, slice(1, None))), (monopole, (-1, slice(None, -1)))):
        off = np.abs(found[part] - exact)
        assert np.all(off < most * np.abs(exact))
        assert np.all(found.ok[part])
        assert np.all(off < found.error[part])
        assert set(found.method[part][-2:]) == {"beams"}


def test_second_order_is_ten_times_as_good_as_the_first():
    away, b = on_sphere(np.array([20.0, 60.0, 120.0]))
    exact = sphere_antennas(30.0, 1.0, np.radians([20.0, 60.0, 120.0]))
    one, two = (
        cr.antenna_coupling(sc.Sphere(), [(0, 0, 1.0)], b, away, wavenumber=30.0, order=order) for order in (1, 2)
    )
    assert np.all(10 * np.abs(two[0, 1:] - exact) < np.abs(one[0, 1:] - exact))
    assert np.all(np.abs(one[0, 1:] - exact) < one.error[0, 1:])


def test_slots_along_the_path_give_nothing_on_a_sphere():
    away, b = on_sphere(np.array([15.0, 70.0]))
    found, abreast = (
        cr.antenna_coupling(sc.Sphere(), [(0, 0, 1.0)], axis, away, wavenumber=30.0)
        for axis in (np.cross(b, (0, 0, 1.0)), b)
    )
    assert np.all(np.abs(found[0, 1:]) < 1e-6 * np.abs(abreast[0, 1:]))
    assert np.all(found.ok[0, 1:])


@pytest.mark.parametrize("distance", [0.01, 0.04])
def test_close_ones_are_on_a_plane(distance):
    """All directions on ground of two curvatures; ks = 0.4 and 1.6: near field. H differs by the order of s/rho."""
    body, k = sc.Ellipsoid(1.0, 0.8, 0.6), 40.0
    u = np.linspace(0, 2 * np.pi, 7, endpoint=False)
    ends = distance * np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    monopoles, axis = project(body, ends + np.array([0, 0, 0.6])), np.array([0.6, 0.8, 0.0])
    found = cr.antenna_coupling(body, [(0, 0, 0.6)], axis, monopoles, wavenumber=k)
    for j in range(1, 8):
        path = found.paths(0, j)
        wave = plane_antennas(k, path.arclength[:1])[0]
        exact = wave * (np.cross((0, 0, 1.0), path.departure[0]) @ axis)
        assert abs(found[0, j] - exact) < 3 * distance * abs(wave)


@pytest.mark.slow
def test_ellipsoid_against_dipoles_inside():
    """H at slots along random axes, torsion and curvatures that vary, as a share of the largest over the axes."""
    rng, k = np.random.default_rng(7), 12.0
    sources, points = np.array([[0.45, 0.6, -np.sqrt(1 - 0.45**2 - 0.6**2)]]), rng.normal(size=(80, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points = points[np.max(points @ sources.T, axis=1) < 0.9]
    exact = slots_of_monopoles(ellipsoid(*AXES), k, sources, points, depth=0.25, heights=HEIGHTS)
    angle = rng.uniform(0, 2 * np.pi, len(points))
    turned = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    found = cr.antenna_coupling(
        sc.Ellipsoid(*AXES),
        exact.points,
        np.einsum("na,nac->nc", turned, exact.tangents),
        exact.ports,
        wavenumber=k,
    )
    size, spread = np.linalg.norm(exact.values[:, 0], axis=1), exact.spread[:, 0]
    off = np.abs(found[-1, :-1] - np.sum(turned * exact.values[:, 0], axis=1))
    known = found.ok[-1, :-1] & (spread < 0.02 * size)
    rays = known & (found.method[-1, :-1] == "rays")
    assert known.mean() > 0.9
    assert np.median((off / size)[rays]) < 0.02
    assert np.quantile((off / size)[rays], 0.95) < 0.06
    assert np.mean((off < found.error[-1, :-1] + spread)[known]) > 0.95


def test_blocks_of_one_kind_are_those_of_its_function(both):
    """Values, errors and statuses of slots alone and of monopoles alone, for the same length of geodesics."""
    body, (slots, axes, monopoles) = sc.Ellipsoid(1.0, 0.8, 0.6), both
    found = cr.antenna_coupling(body, slots, axes, monopoles, wavenumber=20.0)
    n = len(slots)
    alone = cr.slot_coupling(body, slots, axes, wavenumber=20.0), cr.monopole_coupling(body, monopoles, wavenumber=20.0)
    for part, one in zip((slice(0, n), slice(n, None)), alone, strict=True):
        off = ~np.eye(len(one), dtype=bool)
        assert np.allclose(found[part, part][off], one.values[off], rtol=1e-9)
        assert np.allclose(found.error[part, part][off], one.error[off], rtol=1e-9)
        assert np.array_equal(found.status[part, part], one.status)
    assert np.array_equal(found[:n, n:], -found[n:, :n].T)
    assert np.array_equal(found.error, found.error.T)


def test_order_of_ports_does_not_matter(both):
    """The slot of each pair is its source, whatever its number."""
    body, (slots, axes, monopoles) = sc.Ellipsoid(1.0, 0.8, 0.6), both
    there = cr.antenna_coupling(body, slots, axes, monopoles, wavenumber=20.0)
    back = cr.antenna_coupling(body, slots[::-1], axes[::-1], monopoles[::-1], wavenumber=20.0)
    n = len(slots)
    one, other = there[:n, n:], back[:n, n:][::-1, ::-1]
    fine = there.ok[:n, n:] & (there.method[:n, n:] == "rays")
    assert fine.sum() > 20
    assert np.all(np.abs(one - other)[fine] <= 1e-7 * np.abs(one).max())


def test_changes_of_the_path_are_those_of_its_reverse(both):
    """What turns the wave at each end, from either of them."""
    from creeping.rays.port_rays import rays_between

    body, ports = sc.Ellipsoid(1.0, 0.8, 0.6), both[0]
    there, back = (rays_between(body, given, 2.0) for given in (ports, ports[::-1]))
    compared = 0
    for j in np.flatnonzero(np.abs(there.spreading) > 0.3):
        same = (back.first == 7 - there.second[j]) & (back.second == 7 - there.first[j])
        same &= np.abs(back.arclength - there.arclength[j]) < 1e-4
        for other in np.flatnonzero(same):
            assert np.allclose(there.turning[j], -back.turning[other][::-1], atol=5e-3)
            compared += 1
    assert compared > 10


def test_unit_of_length_does_not_matter(both):
    s, (slots, axes, monopoles) = 1e3, both
    one = cr.antenna_coupling(sc.Ellipsoid(1.0, 0.8, 0.6), slots, axes, monopoles, wavenumber=20.0)
    body = sc.Ellipsoid(s, 0.8 * s, 0.6 * s)
    other = cr.antenna_coupling(body, s * slots, 5 * axes, s * monopoles, wavenumber=20.0 / s)
    off = ~np.eye(len(one), dtype=bool)
    assert np.allclose(one.values[off], s**2 * other.values[off], rtol=1e-5, atol=1e-6 * np.max(one.error[off]))
    assert np.array_equal(one.status, other.status)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"monopoles": np.zeros((0, 3))}, "one or more of each"),
        ({"slots": (0, 0, 1.0)}, "one or more of each"),
        ({"monopoles": [(0, 0, 1.0)]}, "1 pairs of ports are in one place"),
        ({"axes": (0, 0, 1.0)}, "no tangential part"),
        ({"monopoles": [(0, 2.0, 0)]}, "1 of 2 points are off the body"),
        ({"order": 3}, "order = 3"),
    ],
)
def test_what_cannot_be_is_refused(change, words):
    given = {"slots": [(0, 0, 1.0)], "axes": (1.0, 0, 0), "monopoles": [(0, 1.0, 0)], "wavenumber": 20.0, "order": 2}
    with pytest.raises(InvalidInputError, match=words):
        cr.antenna_coupling(sc.Sphere(), **(given | change))


def test_labelled(tmp_path):
    away, b = on_sphere(np.array([70.0, 140.0]))
    found = cr.antenna_coupling(sc.Sphere(), [(0, 0, 1.0)], b, away, wavenumber=30.0)
    data = found.to_xarray()
    assert data["source_kind"].values.tolist() == ["slot", "monopole", "monopole"]
    assert np.allclose(data["moment"].values, [b, *normal(sc.Sphere(), away)])
    assert found.to_dataframe().loc[(0, 2), "error"] == found.error[0, 2]
    for source, receiver in ((0, 1), (1, 0), (1, 2)):
        assert np.allclose(found.paths(source, receiver).wave.sum(), found[source, receiver], rtol=1e-6)
    assert "3 ports, k = 30, pec" in repr(found)
    with pytest.raises(InvalidInputError, match="1 of 1 couplings are of a conductor"):
        write_touchstone(tmp_path / "antennas.s3p", [found], reference_distance=0.5)
