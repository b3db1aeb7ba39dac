"""Slots in a conductor: exact series of the sphere, fundamental solutions, the plane's limit, reciprocity, scales."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.errors import InvalidInputError
from creeping.field.point_result import FieldStatus
from creeping.files import write_touchstone
from creeping.geometry.surface import normal, project
from creeping.rays.port_rays import tangent_frames
from studies.reference.clouds import ellipsoid
from studies.reference.slots import coupled_slots, plane_slots, sphere_slots

DEGREES = np.array([5, 10, 20, 40, 60, 90, 120, 150, 160, 165, 170, 175, 178])
TURN = 0.3
HEIGHTS = (0.05, 0.08, 0.11, 0.14)


def on_sphere(degrees):
    """Ports on a meridian, the first at the pole, with b and t there: (n, 3) each."""
    s = np.radians(np.concatenate([[0.0], degrees]))
    b = np.broadcast_to([-np.sin(TURN), np.cos(TURN), 0.0], (len(s), 3))
    ports = np.stack([np.sin(s) * np.cos(TURN), np.sin(s) * np.sin(TURN), np.cos(s)], axis=1)
    return ports, b, np.cross(b, ports)


@pytest.fixture(scope="module")
def ellipsoid_slots():
    rng = np.random.default_rng(4)
    v = rng.normal(size=(16, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True) * [1.0, 0.8, 0.6], rng.normal(size=(16, 3))


@pytest.mark.parametrize(("ka", "most"), [(10.0, 0.06), (30.0, 0.02), (100.0, 0.005)])
def test_sphere_against_partial_waves(ka, most):
    """Slots across, along and at any angle; as a share of the larger of both components at that distance."""
    ports, b, t = on_sphere(DEGREES)
    across, along = sphere_slots(ka, 1.0, np.radians(DEGREES))
    larger = np.maximum(np.abs(across), np.abs(along))
    angles = np.random.default_rng(1).uniform(0, 2 * np.pi, (4, len(ports)))
    angles[0], angles[1] = 0, np.pi / 2
    inside = []
    for c, s in zip(np.cos(angles), np.sin(angles), strict=True):
        found = cr.slot_coupling(sc.Sphere(), ports, c[:, None] * b + s[:, None] * t, wavenumber=ka)
        off = np.abs(found[0, 1:] - across * c[0] * c[1:] - along * s[0] * s[1:])
        assert np.all(off < most * larger)
        assert np.all(found.ok[0, 1:])
        assert set(found.method[0, -2:]) == {"beams"}
        inside.append(off < found.error[0, 1:])
    assert np.mean(inside) >= 0.95


def test_second_order_is_ten_times_as_good_as_the_first():
    ports, b, _ = on_sphere(np.array([20.0, 60.0, 120.0]))
    exact, _ = sphere_slots(30.0, 1.0, np.radians([20.0, 60.0, 120.0]))
    one, two = (cr.slot_coupling(sc.Sphere(), ports, b, wavenumber=30.0, order=order) for order in (1, 2))
    assert np.all(10 * np.abs(two[0, 1:] - exact) < np.abs(one[0, 1:] - exact))
    assert np.all(np.abs(one[0, 1:] - exact) < one.error[0, 1:])


def test_crossed_slots_receive_nothing_on_a_sphere():
    ports, b, t = on_sphere(np.array([15.0, 70.0]))
    found = cr.slot_coupling(sc.Sphere(), ports, np.concatenate([b[:1], t[1:]]), wavenumber=30.0)
    abreast = cr.slot_coupling(sc.Sphere(), ports, b, wavenumber=30.0)
    assert np.all(np.abs(found[0, 1:]) < 1e-6 * np.abs(abreast[0, 1:]))
    assert np.all(found.ok[0, 1:])


@pytest.mark.parametrize("distance", [0.01, 0.04])
def test_close_slots_are_on_a_plane(distance):
    """All directions on ground of two curvatures; ks = 0.4 and 1.6: near field. H differs by the order of s/rho."""
    body, k = sc.Ellipsoid(1.0, 0.8, 0.6), 40.0
    u = np.linspace(0, 2 * np.pi, 7, endpoint=False)
    ends = distance * np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    ports = np.concatenate([[[0, 0, 0.6]], project(body, ends + np.array([0, 0, 0.6]))])
    axis = np.array([0.6, 0.8, 0.0])
    found = cr.slot_coupling(body, ports, axis, wavenumber=k)
    for j in range(1, len(ports)):
        path = found.paths(0, j)
        across, along = (value[0] for value in plane_slots(k, path.arclength[:1]))
        share = path.departure[0] @ axis
        exact = along * share**2 + across * (1 - share**2)
        assert abs(found[0, j] - exact) < 3 * distance * max(abs(across), abs(along))


@pytest.fixture(scope="module")
def solved():
    """Ports of an ellipsoid, and of two tangents at both ends: fields found, by the reference, errors, OK, by rays."""
    rng, k, axes = np.random.default_rng(1), 12.0, (0.75, 0.9, 1.15)
    sources, points = rng.normal(size=(1, 3)), rng.normal(size=(60, 3))
    sources, points = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (sources, points))
    # off the planes of symmetry, where the reference's dipoles would meet their images
    sources = np.sign(sources) * np.maximum(np.abs(sources), 0.3)
    sources /= np.linalg.norm(sources, axis=1, keepdims=True)
    points = points[np.max(points @ sources.T, axis=1) < 0.95]
    exact = coupled_slots(ellipsoid(*axes), k, sources, points, depth=0.25, heights=HEIGHTS)
    body = sc.Ellipsoid(*axes)
    ports = np.concatenate([exact.ports, exact.points])
    here = np.stack(tangent_frames(normal(body, exact.points)), axis=1)
    want = np.einsum("nsac,nrc->arns", exact.values, here)
    found = [
        cr.slot_coupling(body, ports, np.concatenate([exact.tangents[:, a], here[:, r]]), wavenumber=k)
        for a in range(2)
        for r in range(2)
    ]

    def part(of):
        return np.array([value[:1, 1:].T for value in of]).reshape(want.shape)

    told, fine = part([one.error for one in found]), part([one.ok for one in found])
    rays, values = part([one.method == "rays" for one in found]), part([one.values for one in found])
    return body, k, ports, exact.tangents, here, values, want, told, fine, rays


def test_ellipsoid_against_dipoles_inside(solved):
    """Torsion and curvatures that vary; the reference errs by some parts of a thousand of the largest component."""
    *_, values, want, told, fine, rays = solved
    off = np.abs(values - want)
    share = off / np.sqrt(np.sum(np.abs(want) ** 2, axis=(0, 1)))
    assert fine.mean() > 0.95
    assert np.median(share[fine & rays]) < 0.015
    assert np.median(share[fine]) < 0.03
    assert np.quantile(share[fine & rays], 0.95) < 0.05
    assert np.mean((off < told)[fine]) > 0.95


def test_torsion_turns_the_field(solved):
    """Across the path at one end and along it at the other: what the torsion brings, and nothing on a sphere."""
    body, k, ports, there, here, values, want, _, _, rays = solved
    paths, seen = cr.coupling(body, ports, wavenumber=k), []
    for n in range(len(here)):
        path = paths.paths(0, 1 + n)
        if not rays[..., n, 0].all() or not len(path) or path.arclength[0] > 1.5:
            continue
        b = np.cross(normal(body, ports[0]), path.departure[0])
        # parts of slots across at the source, and along at the receiver
        parts = np.multiply.outer(there[0] @ b, here[n] @ path.arrival[0])
        larger = np.linalg.norm(want[..., n, 0])
        seen.append([np.sum(parts * of[..., n, 0]) / larger for of in (values, want)])
    mine, its = np.array(seen).T
    strong = np.abs(its) > 0.03
    assert strong.sum() >= 5
    assert np.median(np.abs(mine - its)[strong] / np.abs(its)[strong]) < 0.5
    assert np.sqrt(np.mean(np.abs(mine - its) ** 2)) < 0.6 * np.sqrt(np.mean(np.abs(its) ** 2))


def test_reciprocity(ellipsoid_slots):
    """Sources and receivers change places: other fans, other polynomials, the same geodesics and fields."""
    body, (ports, axes) = sc.Ellipsoid(1.0, 0.8, 0.6), ellipsoid_slots
    there = cr.slot_coupling(body, ports, axes, wavenumber=20.0)
    back = cr.slot_coupling(body, ports[::-1], axes[::-1], wavenumber=20.0)
    assert np.array_equal(there.values, there.values.T)
    swapped = back.values[::-1, ::-1]
    upper = np.triu(np.ones(there.shape, dtype=bool), 1)
    rays = upper & (there.method == "rays") & (back.method[::-1, ::-1] == "rays") & there.ok
    assert rays.sum() > 0.5 * upper.sum()
    apart = np.abs(there.values[rays] - swapped[rays])
    assert np.median(apart / np.abs(swapped[rays])) < 1e-3
    assert np.all(apart < 0.3 * there.error[rays] + 1e-4 * np.abs(swapped[rays]))
    both = upper & there.ok & back.ok[::-1, ::-1]
    assert np.mean(np.abs(there.values[both] - swapped[both]) < there.error[both] + back.error[::-1, ::-1][both]) > 0.98


def test_unit_of_length_does_not_matter(ellipsoid_slots):
    s, (ports, axes) = 1e3, ellipsoid_slots
    one = cr.slot_coupling(sc.Ellipsoid(1.0, 0.8, 0.6), ports[:8], axes[:8], wavenumber=20.0)
    other = cr.slot_coupling(sc.Ellipsoid(1.0 * s, 0.8 * s, 0.6 * s), s * ports[:8], 5 * axes[:8], wavenumber=20.0 / s)
    off = ~np.eye(8, dtype=bool)
    assert np.allclose(one.values[off], s**2 * other.values[off], rtol=1e-5, atol=1e-6 * np.max(one.error[off]))
    assert np.allclose(one.error[off], s**2 * other.error[off], rtol=2e-2)
    assert np.array_equal(one.status, other.status)


def test_rotated_sphere_is_the_same():
    ports, b, t = on_sphere(np.array([30.0, 75.0, 110.0]))
    q, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    one, other = (
        cr.slot_coupling(sc.Sphere(), p @ q.T, (b + t) @ q.T, wavenumber=25.0)
        for p, q in ((ports, np.eye(3)), (ports, q))
    )
    off = ~np.eye(4, dtype=bool)
    assert np.allclose(one.values[off], other.values[off], rtol=3e-4)


def test_concave_ground_is_told():
    """Behind the concave side of the twisted ellipsoid rays have ended; no pair is an error of the whole."""
    body = sc.TwistedEllipsoid()
    ports = project(body, np.array([[0, -0.3, 0.7], [0, -0.3, -0.7], [0, 0.7, 0.0], [0.5, 0.2, 0.1]]))
    found = cr.slot_coupling(body, ports, (0.3, 0.5, 0.7), wavenumber=30.0)
    assert found.status[0, 1] in (FieldStatus.DETACHED, FieldStatus.NO_RAY)
    assert found.ok[2, 3]
    assert not np.any(np.isnan(found.values))
    assert not np.any(np.isnan(found.error))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"axes": [(1.0, 0, 0)]}, "axes have shape"),
        ({"axes": [(1.0, 0, 0), (0, 5.0, 0)]}, "1 of 2 axes are not finite or have no tangential part"),
        ({"axes": [(1.0, 0, 0), (0, 0, np.nan)]}, "1 of 2 axes are not finite or have no tangential part"),
        ({"axes": "b"}, "axes"),
        ({"ports": [(0, 0, 1.0), (0, 0, 2.0)]}, "1 of 2 points are off the body"),
        ({"order": 3}, "order = 3"),
    ],
)
def test_what_cannot_be_is_refused(change, words):
    given = {"ports": [(0, 0, 1.0), (0, 1.0, 0)], "axes": [(1.0, 0, 0), (0, 0, 1.0)], "wavenumber": 20.0} | change
    with pytest.raises(InvalidInputError, match=words):
        cr.slot_coupling(sc.Sphere(), given.pop("ports"), given.pop("axes"), **given)


def test_labelled(tmp_path):
    ports, b, _ = on_sphere(np.array([70.0, 140.0]))
    found = cr.slot_coupling(sc.Sphere(), ports, b, wavenumber=30.0)
    data = found.to_xarray()
    assert np.array_equal(data["total"].sel(source=0, receiver=2).values, found[0, 2])
    assert data["total"].attrs["units"] == data["error"].attrs["units"] == "1/L^2"
    assert np.allclose(data["slot"].values, b)
    assert found.to_dataframe().loc[(0, 2), "error"] == found.error[0, 2]
    assert np.allclose(found.paths(0, 1).wave.sum(), found[0, 1])
    assert "3 ports, k = 30, pec" in repr(found)
    with pytest.raises(InvalidInputError, match="1 of 1 couplings are of a conductor"):
        write_touchstone(tmp_path / "slots.s3p", [found], reference_distance=0.5)
