"""Fields from on the body to a size above it: against the series of the sphere, and by one way for each body."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.results.point_result import FieldStatus
from tests.reference import dipoles, sphere

HEIGHTS = (0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0)
D = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def places():
    """Points on the unit sphere (60, 3), two thirds of them behind the shadow line, where creeping rays come."""
    rng = np.random.default_rng(5)
    rise, turn = np.radians(rng.uniform(-40, 60, 60)), rng.uniform(0, 2 * np.pi, 60)
    return np.stack([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)], axis=1)


def fan_of(k, n_rays=64):
    ball = sc.Sphere()
    return cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, D), wavenumber=k, n_rays=n_rays)


@pytest.mark.parametrize(
    ("boundary", "k"),
    [
        pytest.param("soft", 15.0, marks=pytest.mark.slow),
        ("hard", 15.0),
        pytest.param("hard", 6.0, marks=pytest.mark.slow),
        pytest.param("soft", 40.0, marks=pytest.mark.slow),
    ],
)
def test_at_every_height_scalar_fields_are_covered(places, boundary, k):
    fan, rows = fan_of(k), []
    for height in HEIGHTS:
        x = places * (1 + height)
        u = cr.near_field(fan, x, wavenumber=k, boundary=boundary)
        off = np.abs(u - sphere.total_field(k, 1.0, x, D, boundary))
        ok = u.status == FieldStatus.OK
        assert np.all(off[ok] < 0.1)
        # the series itself rounds
        rows.append(np.mean(off[ok] <= u.error[ok] + 1e-12))
    assert min(rows) >= 0.95


@pytest.mark.slow
@pytest.mark.parametrize("k", [12.0, 20.0])
def test_at_every_height_fields_of_a_conductor_are_covered(places, k):
    fan, rows, x = fan_of(k), [], places[:24]
    for height in HEIGHTS:
        y = x * (1 + height)
        field = cr.conductor_field(fan, y, wavenumber=k, polarisation="theta")
        E, H = sphere.pec_total_field(k, 1.0, y, D, dipoles.frames(D[None])[0][0])
        off = np.maximum(*(np.linalg.norm(a - b, axis=1) for a, b in ((field.E, E), (field.H, H))))
        ok = field.status == FieldStatus.OK
        assert np.all(off[ok] < 0.1)
        rows.append(np.mean(off[ok] <= field.error[ok]))
    assert min(rows) >= 0.95


@pytest.mark.parametrize("n_rays", [48, 192])
def test_no_creeping_ray_is_missed_close_above_dark_ground(n_rays):
    k, fan = 15.0, fan_of(15.0, n_rays)
    rise, turn = np.radians(np.linspace(3, 35, 40)), np.linspace(0, 6, 40)
    x = np.stack([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)], axis=1)
    for height in (1e-5, 1e-4, 3e-4, 1e-3):
        u = cr.near_field(fan, x * (1 + height), wavenumber=k, boundary="hard", method="rays")
        on = sphere.total_field(k, 1.0, x, D, "hard")
        # the wave itself is 1.3, and leading order errs by 0.1
        assert np.abs(u - on).max() < 0.2


@pytest.mark.parametrize("boundary", ["hard", pytest.param("pec", marks=pytest.mark.slow)])
def test_solved_fields_are_right_down_to_the_body(boundary, places):
    k, x = 6.0, places[:20]
    solution = cr.solve(sc.Sphere(), D, wavenumber=k, boundary=boundary)
    for height in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2):
        y = x * (1 + height)
        if boundary == "hard":
            field = solution.near_field(y)
            off = np.abs(field - sphere.total_field(k, 1.0, y, D, "hard"))
        else:
            field = solution.conductor_field(y, polarisation="theta")
            E, H = sphere.pec_total_field(k, 1.0, y, D, dipoles.frames(D[None])[0][0])
            off = np.maximum(*(np.linalg.norm(a - b, axis=1) for a, b in ((field.E, E), (field.H, H))))
        assert off.max() < 0.01 and np.mean(off <= field.error) >= 0.95


@pytest.mark.parametrize("boundary", ["hard", pytest.param("pec", marks=pytest.mark.slow)])
def test_far_fields_near_fields_and_those_on_the_body_go_one_way(boundary):
    # expansions leave 4 % of the wave inside of this one, which is convex
    body, k, angle = sc.Ellipsoid(0.5, 0.5, 1.1), 4.0, np.linspace(0.2, 2.9, 6)
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (1, 0, 0.4)), wavenumber=k, n_rays=48)
    on = np.stack([0.5 * np.sin(angle), np.zeros(6), 1.1 * np.cos(angle)], axis=1)
    far = cr.far_field(fan, [(1, 0, 0)], wavenumber=k, boundary=boundary)
    if boundary == "hard":
        near = cr.near_field(fan, 1.2 * on, wavenumber=k, boundary="hard")
        surface = cr.surface_field(fan, on, wavenumber=k, boundary="hard")
    else:
        near = cr.conductor_field(fan, 1.2 * on, wavenumber=k, polarisation="phi")
        surface = cr.conductor_current(fan, on, wavenumber=k, polarisation="phi")
    assert {*far.method.ravel(), *near.method.ravel(), *surface.method} == {"equation"}
