"""Monopoles on a conductor: exact series of the sphere, dipoles inside, the plane's limit, reciprocity, scales."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.errors import InvalidInputError
from creeping.files import write_touchstone
from creeping.geometry.surface import project
from studies.reference.clouds import ellipsoid
from studies.reference.monopoles import coupled_monopoles, plane_monopoles, sphere_monopoles

DEGREES = np.array([5, 10, 20, 40, 60, 90, 120, 149, 160, 165, 170, 175, 178])
HEIGHTS = (0.03, 0.05, 0.07, 0.09, 0.12)


def on_sphere(degrees):
    """Ports on a meridian, the first at the pole (n, 3)."""
    s = np.radians(np.concatenate([[0.0], degrees]))
    return np.stack([np.sin(s) * np.cos(0.3), np.sin(s) * np.sin(0.3), np.cos(s)], axis=1)


@pytest.fixture(scope="module")
def ports():
    v = np.random.default_rng(4).normal(size=(12, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True) * [1.0, 0.8, 0.6]


@pytest.mark.parametrize(("ka", "most"), [(10.0, 0.01), (30.0, 0.002), (100.0, 0.002)])
def test_sphere_against_partial_waves(ka, most):
    found = cr.monopole_coupling(sc.Sphere(), on_sphere(DEGREES), wavenumber=ka)
    exact = sphere_monopoles(ka, 1.0, np.radians(DEGREES))
    off = np.abs(found[0, 1:] - exact)
    assert np.all(off < most * np.abs(exact))
    assert np.all(found.ok[0, 1:])
    assert np.all(off < found.error[0, 1:])
    assert set(found.method[0, -2:]) == {"beams"}


def test_second_order_is_twenty_times_as_good_as_the_first():
    degrees = np.array([20.0, 60.0, 120.0])
    exact = sphere_monopoles(30.0, 1.0, np.radians(degrees))
    one, two = (
        cr.monopole_coupling(sc.Sphere(), on_sphere(degrees), wavenumber=30.0, order=order)[0, 1:] for order in (1, 2)
    )
    assert np.all(20 * np.abs(two - exact) < np.abs(one - exact))


@pytest.mark.parametrize("distance", [0.01, 0.04])
def test_close_monopoles_are_on_a_plane(distance):
    """All directions on ground of two curvatures; ks = 0.4 and 1.6: near field. E differs by the order of s/rho."""
    body, k = sc.Ellipsoid(1.0, 0.8, 0.6), 40.0
    u = np.linspace(0, 2 * np.pi, 7, endpoint=False)
    ends = distance * np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    found = cr.monopole_coupling(
        body, np.concatenate([[[0, 0, 0.6]], project(body, ends + np.array([0, 0, 0.6]))]), wavenumber=k
    )
    lengths = [found.paths(0, j).arclength[0] for j in range(1, 8)]
    exact = plane_monopoles(k, lengths)
    assert np.all(np.abs(found[0, 1:] - exact) < 3 * distance * np.abs(exact))


@pytest.mark.slow
def test_ellipsoid_against_dipoles_inside():
    """Torsion and curvatures that vary."""
    rng, k, axes = np.random.default_rng(7), 12.0, (0.75, 0.9, 1.15)
    sources, points = np.array([[0.45, 0.6, -np.sqrt(1 - 0.45**2 - 0.6**2)]]), rng.normal(size=(60, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points = points[np.max(points @ sources.T, axis=1) < 0.9]
    exact = coupled_monopoles(ellipsoid(*axes), k, sources, points, depth=0.25, heights=HEIGHTS)
    found = cr.monopole_coupling(sc.Ellipsoid(*axes), np.concatenate([exact.ports, exact.points]), wavenumber=k)
    off, size = np.abs(found[0, 1:] - exact.values[:, 0]), np.abs(exact.values[:, 0])
    known = found.ok[0, 1:] & (exact.spread[:, 0] < 0.02 * size)
    rays = known & (found.method[0, 1:] == "rays")
    assert known.mean() > 0.9
    assert np.median((off / size)[rays]) < 0.02
    assert np.quantile((off / size)[rays], 0.95) < 0.06
    assert np.mean((off < found.error[0, 1:] + exact.spread[:, 0])[known]) > 0.95


def test_reciprocity(ports):
    """Sources and receivers change places: other fans, other polynomials, the same geodesics and fields."""
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    there, back = (cr.monopole_coupling(body, given, wavenumber=20.0) for given in (ports, ports[::-1]))
    swapped = back.values[::-1, ::-1]
    rays = np.triu(there.ok & (there.method == "rays") & (back.method[::-1, ::-1] == "rays"), 1)
    assert rays.sum() > 20
    assert np.array_equal(there.values, there.values.T)
    assert np.median(np.abs(there.values[rays] / swapped[rays] - 1)) < 1e-3


def test_unit_of_length_does_not_matter(ports):
    s, off = 1e3, ~np.eye(len(ports), dtype=bool)
    one = cr.monopole_coupling(sc.Ellipsoid(1.0, 0.8, 0.6), ports, wavenumber=20.0)
    other = cr.monopole_coupling(sc.Ellipsoid(s, 0.8 * s, 0.6 * s), s * ports, wavenumber=20.0 / s)
    assert np.allclose(one.values[off], s**2 * other.values[off], rtol=1e-5, atol=1e-6 * np.max(one.error[off]))
    assert np.array_equal(one.status, other.status)


def test_what_cannot_be_is_refused():
    with pytest.raises(InvalidInputError, match="1 of 2 points are off the body"):
        cr.monopole_coupling(sc.Sphere(), [(0, 0, 1.0), (0, 0, 2.0)], wavenumber=20.0)
    with pytest.raises(InvalidInputError, match="order = 3"):
        cr.monopole_coupling(sc.Sphere(), [(0, 0, 1.0), (0, 1.0, 0)], wavenumber=20.0, order=3)
    with pytest.raises(InvalidInputError, match="has a speed"):
        cr.monopole_coupling(sc.Sphere(speed="1 + 0.1*x"), [(0, 0, 1.0), (0, 1.0, 0)], wavenumber=20.0)


def test_labelled(tmp_path):
    found = cr.monopole_coupling(sc.Sphere(), on_sphere(np.array([70.0, 140.0])), wavenumber=30.0)
    data = found.to_xarray()
    assert data["total"].attrs["units"] == data["error"].attrs["units"] == "1/L^2"
    assert "electric" in data["total"].attrs["long_name"]
    assert np.allclose(found.paths(0, 1).wave.sum(), found[0, 1])
    assert "3 ports, k = 30, pec" in repr(found)
    with pytest.raises(InvalidInputError, match="1 of 1 couplings are of a conductor"):
        write_touchstone(tmp_path / "monopoles.s3p", [found], reference_distance=0.5)
