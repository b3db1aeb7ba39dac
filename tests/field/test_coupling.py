"""Coupling of ports: exact series of the sphere, reciprocity, the plane's limit, scales, statuses."""

from dataclasses import replace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.errors import InvalidInputError
from creeping.field.point_result import FieldStatus
from creeping.files import write_touchstone
from studies.reference.clouds import ellipsoid
from studies.reference.ports import coupled, sphere_coupling

DEGREES = np.array([5, 10, 20, 40, 60, 90, 120, 150, 165, 170, 175, 179.9, 180])


def on_sphere(degrees, turn=0.3):
    t = np.radians(degrees)
    return np.stack([np.sin(t) * np.cos(turn), np.sin(t) * np.sin(turn), np.cos(t)], axis=1)


@pytest.fixture(scope="module")
def ellipsoid_ports():
    rng = np.random.default_rng(4)
    v = rng.normal(size=(24, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True) * [1.0, 0.8, 0.6]


@pytest.mark.parametrize(("ka", "most"), [(10.0, 0.025), (30.0, 0.005), (100.0, 0.0012)])
def test_sphere_against_partial_waves(ka, most):
    ports = np.concatenate([[[0, 0, 1.0]], on_sphere(DEGREES)])
    found = cr.coupling(sc.Sphere(), ports, wavenumber=ka)
    exact = sphere_coupling(ka, 1.0, np.radians(DEGREES))
    off = np.abs(found[0, 1:] - exact)
    assert np.all(off < most * np.abs(exact))
    assert np.all(found.ok[0, 1:])
    assert np.all(off < found.error[0, 1:])
    assert set(found.method[0, -4:]) == {"beams"}


def test_second_order_is_ten_times_as_good_as_the_first():
    ports = np.concatenate([[[0, 0, 1.0]], on_sphere(np.array([20.0, 60.0, 120.0]))])
    exact = sphere_coupling(30.0, 1.0, np.radians([20.0, 60.0, 120.0]))
    one, two = (cr.coupling(sc.Sphere(), ports, wavenumber=30.0, order=order) for order in (1, 2))
    assert np.all(10 * np.abs(two[0, 1:] - exact) < np.abs(one[0, 1:] - exact))
    assert np.all(np.abs(one[0, 1:] - exact) < one.error[0, 1:])


def test_close_ports_are_on_a_plane():
    """The curvature changes the field e^{iks}/(2 pi s) of a plane by the order of (ks)^(1/2) s/rho."""
    body, k = sc.Ellipsoid(1.0, 0.8, 0.6), 40.0
    u = np.linspace(0, 2 * np.pi, 7, endpoint=False)
    ends = np.stack([0.01 * np.cos(u), 0.01 * np.sin(u)], axis=1)
    z = 0.6 * np.sqrt(1 - ends[:, 0] ** 2 - (ends[:, 1] / 0.8) ** 2)
    ports = np.concatenate([[[0, 0, 0.6]], np.column_stack([ends, z])])
    found = cr.coupling(body, ports, wavenumber=k)
    for j in range(1, len(ports)):
        s = found.paths(0, j).arclength[0]
        assert abs(found[0, j] * 2 * np.pi * s * np.exp(-1j * k * s) - 1) < 1.5 * np.sqrt(k * s) * s


def test_reciprocity(ellipsoid_ports):
    """Sources and receivers change places: other fans, other polynomials, the same geodesics and fields."""
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    there = cr.coupling(body, ellipsoid_ports, wavenumber=20.0)
    back = cr.coupling(body, ellipsoid_ports[::-1], wavenumber=20.0)
    swapped = back.values[::-1, ::-1]
    upper = np.triu(np.ones(there.shape, dtype=bool), 1)
    rays = upper & (there.method == "rays") & (back.method[::-1, ::-1] == "rays") & there.ok
    assert rays.sum() > 0.6 * upper.sum()
    apart = np.abs(there.values[rays] - swapped[rays]) / np.abs(swapped[rays])
    assert np.median(apart) < 5e-4
    assert np.all(apart < 0.3 * there.error[rays] / np.abs(there.values[rays]) + 1e-4)
    both = upper & there.ok & back.ok[::-1, ::-1]
    assert np.all(np.abs(there.values[both] - swapped[both]) < there.error[both] + back.error[::-1, ::-1][both])


def test_unit_of_length_does_not_matter(ellipsoid_ports):
    s = 1e3
    one = cr.coupling(sc.Ellipsoid(1.0, 0.8, 0.6), ellipsoid_ports[:8], wavenumber=20.0)
    other = cr.coupling(sc.Ellipsoid(1.0 * s, 0.8 * s, 0.6 * s), s * ellipsoid_ports[:8], wavenumber=20.0 / s)
    off = ~np.eye(8, dtype=bool)
    assert np.allclose(one.values[off], s * other.values[off], rtol=1e-5)
    assert np.allclose(one.error[off], s * other.error[off], rtol=1e-2)
    assert np.array_equal(one.status, other.status)


def test_rotated_sphere_is_the_same():
    ports = on_sphere(np.array([0.0, 30.0, 75.0, 110.0]))
    q, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    one, other = (cr.coupling(sc.Sphere(), p, wavenumber=25.0) for p in (ports, ports @ q.T))
    off = ~np.eye(4, dtype=bool)
    assert np.allclose(one.values[off], other.values[off], rtol=2e-4)


def test_paths_tell_which_geodesic_gave_what():
    found = cr.coupling(sc.Sphere(), on_sphere(np.array([0.0, 70.0])), wavenumber=30.0)
    forth, back = found.paths(0, 1), found.paths(1, 0)
    assert np.allclose(forth.arclength, np.radians([70.0, 290.0]), atol=1e-6)
    assert np.allclose(forth.spreading, np.sin(np.radians([70.0, 290.0])), atol=1e-5)
    assert np.allclose(forth.fock_parameter, np.cbrt(15.0) * forth.arclength)
    assert forth.caustics.tolist() == [0, 1]
    assert np.allclose(forth.departure, -back.arrival)
    assert np.allclose(forth.wave.sum(), found[0, 1])
    assert len(found.paths(1, 1)) == 0
    with pytest.raises(InvalidInputError, match="port 2 is not one of the ports 0 to 1"):
        found.paths(0, 2)


def test_concave_ground_is_told():
    """Behind the concave side of the twisted ellipsoid rays have ended; no pair is an error of the whole."""
    body = sc.TwistedEllipsoid()
    from creeping.geometry.surface import project

    ports = project(body, np.array([[0, -0.3, 0.7], [0, -0.3, -0.7], [0, 0.7, 0.0], [0.5, 0.2, 0.1]]))
    found = cr.coupling(body, ports, wavenumber=30.0)
    assert found.status[0, 1] in (FieldStatus.DETACHED, FieldStatus.NO_RAY)
    assert found.ok[2, 3]
    assert not np.any(np.isnan(found.values))
    assert not np.any(np.isnan(found.error))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ports": [(0, 0, 1.0), (0, 0, 1.0)]}, "1 pairs of ports are in one place"),
        ({"ports": [(0, 0, 1.0), (0, 0, 2.0)]}, "1 of 2 points are off the body"),
        ({"ports": [(0, 0, 1.0)]}, "give two or more"),
        ({"boundary": "soft"}, "hard bodies only"),
        ({"boundary": "pec"}, "hard bodies only"),
        ({"length": -1.0}, "length"),
        ({"order": 3}, "order = 3"),
    ],
)
def test_what_cannot_be_is_refused(change, words):
    given = {"ports": [(0, 0, 1.0), (0, 1.0, 0)], "wavenumber": 20.0} | change
    with pytest.raises(InvalidInputError, match=words):
        cr.coupling(sc.Sphere(), given.pop("ports"), **given)


def test_labelled():
    found = cr.coupling(sc.Sphere(), on_sphere(np.array([0.0, 70.0, 140.0])), wavenumber=30.0)
    data = found.to_xarray()
    assert np.array_equal(data["total"].sel(source=0, receiver=2).values, found[0, 2])
    assert data["total"].attrs["units"] == "1/L"
    frame = found.to_dataframe()
    assert frame.loc[(0, 2), "error"] == found.error[0, 2]
    assert "3 ports, k = 30" in repr(found)


@pytest.mark.parametrize("count", [2, 3, 6])
def test_touchstone_comes_back(count, tmp_path):
    degrees = np.linspace(0.0, 140.0, count)
    found = [cr.coupling(sc.Sphere(), on_sphere(degrees), wavenumber=k) for k in (20.0, 30.0)]
    path = tmp_path / f"ports.s{count}p"
    write_touchstone(path, found, reference_distance=0.5, sound_speed=343.0)
    lines = [line for line in path.read_text().splitlines() if not line.startswith(("!", "#"))]
    numbers = np.array([float(word) for line in lines for word in line.split()]).reshape(2, -1)
    assert np.allclose(numbers[:, 0] * 2 * np.pi / 343.0, [20.0, 30.0])
    values = (numbers[:, 1::2] + 1j * numbers[:, 2::2]).reshape(2, count, count)
    for mine, one in zip(values, found, strict=True):
        off = ~np.eye(count, dtype=bool)
        assert np.allclose(mine[off], np.pi * np.conj(one.values[off]), rtol=1e-15)
        assert np.all(np.diag(mine) == 0)
    assert max(len(line.split()) for line in lines) <= 9
    with pytest.raises(InvalidInputError, match="do not ascend"):
        write_touchstone(path, found[::-1], reference_distance=0.5)
    moved = replace(found[1], ports=found[1].ports[::-1])
    with pytest.raises(InvalidInputError, match="1 of 2 couplings are of other ports"):
        write_touchstone(path, [found[0], moved], reference_distance=0.5)


def test_ellipsoid_against_fundamental_solutions():
    """Curvature that varies, torsion, r that is not 1; the reference errs by about 1 % at most where it is used."""
    rng, k = np.random.default_rng(7), 14.0
    sources, points = rng.normal(size=(3, 3)), rng.normal(size=(60, 3))
    sources, points = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (sources, points))
    # off the planes of symmetry, where the reference's local solutions would meet their images
    sources = np.sign(sources) * np.maximum(np.abs(sources), 0.25)
    sources /= np.linalg.norm(sources, axis=1, keepdims=True)
    exact = coupled(
        ellipsoid(0.8, 0.9, 1.1), k, sources, points, depth=0.25, heights=(0.05, 0.08, 0.11, 0.14), per_wavelength=7.0
    )
    found = cr.coupling(sc.Ellipsoid(0.8, 0.9, 1.1), np.concatenate([exact.ports, exact.points]), wavenumber=k)
    part = slice(0, 3), slice(3, None)
    values, error = found.values[part].T, found.error[part].T
    known = exact.spread < 0.01 * np.abs(exact.values)
    assert known.mean() > 0.8
    off = np.abs(values - exact.values)
    assert np.median((off / np.abs(exact.values))[known]) < 0.015
    assert np.quantile((off / np.abs(exact.values))[known & (found.method[part].T == "rays")], 0.95) < 0.05
    assert np.mean((off < error + exact.spread)[known & found.ok[part].T]) > 0.95
