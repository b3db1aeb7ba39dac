"""``method="equation"`` on bodies whose fields are else by expansions and rays, and conductors with joints."""

from dataclasses import replace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.currents import assembly, whole_solution
from creeping.geometry.directions import fibonacci_directions
from studies.joints import CASES, spread
from studies.reference import dipoles, stored
from studies.reference.revolution import Revolved

K = 10.0
AXES = (0.9, 0.55, 0.7)


def fan_of(body, d, n_rays=48):
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), length=4.0, n_rays=n_rays)


@pytest.fixture(scope="module")
def ellipsoid():
    return fan_of(sc.Ellipsoid(*AXES), (0.3, -0.5, 0.8))


@pytest.fixture(scope="module")
def pill():
    d = np.array([np.sin(0.9), 0, np.cos(0.9)])
    exact = dipoles.scatter(Revolved(CASES["capsule 5.3"][1]), 4.0, d[None], depth=0.3, per_wavelength=6.0)
    assert exact.residual.max() < 0.01
    return fan_of(CASES["capsule 5.3"][0], d), exact


@pytest.mark.parametrize("boundary", ["soft", pytest.param("hard", marks=pytest.mark.slow)])
def test_a_convex_body_in_all_of_space(ellipsoid, boundary):
    exact = stored.read("ellipsoid_equation")
    r, x, y = exact["far"], exact["on"], exact["near"]
    f = exact[f"{boundary} far"]
    solved, plain = (
        cr.far_field(ellipsoid, r, wavenumber=K, boundary=boundary, method=m) for m in ("equation", "currents")
    )
    off, before = (np.abs(far.total - f) for far in (solved, plain))
    assert set(solved.method) == {"equation"} and set(plain.method) == {"currents"}
    assert np.sqrt(np.mean(off**2)) < min(2e-3 * np.abs(f).max(), 0.5 * np.sqrt(np.mean(before**2)))
    assert np.mean(off <= solved.error) > 0.95
    u = cr.surface_field(ellipsoid, x, wavenumber=K, boundary=boundary, method="equation")
    unit = K if boundary == "soft" else 1.0
    assert set(u.method) == {"equation"} and np.all(u.ok)
    off = np.abs(u.values - exact[f"{boundary} on"]) / unit
    assert np.quantile(off, 0.95) < 0.02 and np.mean(off <= u.error / unit) > 0.9
    near = cr.near_field(ellipsoid, y, wavenumber=K, boundary=boundary, method="equation")
    assert set(near.method) == {"equation"} and np.all(near.ok)
    off = np.abs(near.values - exact[f"{boundary} near"])
    assert off.max() < 0.01 and np.mean(off <= near.error) > 0.95


@pytest.mark.slow
def test_a_conductor_with_joints(pill):
    """It had fields by rays and optics alone, and no current."""
    fan, exact = pill
    r = fibonacci_directions(200)
    f = exact.far_field(r)[:, 0]
    far = cr.far_field(fan, r, wavenumber=4.0, boundary="pec")
    rays = cr.far_field(fan, r, wavenumber=4.0, boundary="pec", method="rays")
    assert set(far.method) == {"equation"} and set(rays.method) == {"rays+optics"}
    off, before = (np.sqrt(np.mean(np.abs(one.total - f) ** 2)) / np.abs(f).max() for one in (far, rays))
    assert off < 1.5e-3 < 0.1 * before
    assert np.mean(np.abs(far.total - f) <= far.error) > 0.95 and not np.any(far.unresolved)


@pytest.mark.slow
def test_current_and_near_field_of_a_conductor_with_joints(pill, rng):
    fan, exact = pill
    x, n = spread(CASES["capsule 5.3"][1], rng, 200)
    H = exact.total(x)[1][:, :, 0]
    J = cr.conductor_current(fan, x, wavenumber=4.0)
    off = np.linalg.norm(J.values - np.cross(n[:, :, None], H, axis=1), axis=1)
    assert set(J.method.ravel()) == {"equation"} and np.all(J.ok)
    # at joints, where the curvature in the window of its sums is two, it errs most
    assert np.quantile(off, 0.95) < 0.012 and off.max() < 0.03 and np.mean(off <= J.error) > 0.8
    y = x + rng.uniform(0.3, 2.0, 200)[:, None] * 2 * np.pi / 4.0 * n
    field = cr.conductor_field(fan, y, wavenumber=4.0)
    E, H = (its[:, :, 0] for its in exact.total(y))
    off = np.maximum(np.linalg.norm(field.E - E, axis=1), np.linalg.norm(field.H - H, axis=1))
    assert set(field.method.ravel()) == {"equation"} and np.all(field.ok)
    assert off.max() < 5e-3 and np.mean(off <= field.error) > 0.95
    close = cr.conductor_field(fan, x + 0.2 * n, wavenumber=4.0)
    assert set(close.method.ravel()) == {"layer"} and np.mean(close.ok) > 0.95


def test_sweeps_ask_for_it(monkeypatch):
    """Currents that only say that they are solved stand for those that are."""
    monkeypatch.setattr(assembly, "solved_on_whole_body", lambda currents, *_: replace(currents, solved=True))
    body, asked = sc.Ellipsoid(*AXES), {"wavenumbers": 5.0, "boundary": "hard", "cache": False, "n_rays": 32}
    ds = cr.backscatter(body, azimuth=[20.0], elevation=10.0, method="equation", **asked)
    assert bool(ds["by_currents"].all())
    line = cr.shadow_line(body, ds["direction"].values[0])
    fan = cr.launch(cr.DirectFlow(body), line, n_rays=32, wavenumber=5.0)
    one = cr.far_field(fan, [-line.direction], wavenumber=5.0, boundary="hard", method="equation")
    total = sum(ds[name].values.ravel()[0] for name in ("creeping", "reflected"))
    assert total == pytest.approx(complex(one.total[0]), rel=1e-3)


@pytest.mark.slow
def test_conductors_with_joints_in_sweeps():
    """Rays serve where they resolve the direction, the equation where they do not."""
    body, asked = sc.Capsule(1.0, 3.0), {"wavenumbers": 3.0, "cache": False, "n_rays": 32}
    ds = cr.backscatter(body, azimuth=[0.0, 40.0], elevation=5.0, **asked)
    rays = cr.backscatter(body, azimuth=[0.0, 40.0], elevation=5.0, method="rays", **asked)
    taken = ds["by_currents_pec"].values.ravel()
    np.testing.assert_array_equal(taken, rays["unresolved_pec"].values.ravel())
    assert np.any(taken) and "by_currents_pec" not in rays
    assert np.all(ds["error_pec"].values.reshape(2, -1)[taken] < rays["error_pec"].values.reshape(2, -1)[taken])


def test_what_it_refuses(ellipsoid, monkeypatch):
    fan = fan_of(CASES["capsule 5.3"][0], (np.sin(0.9), 0, np.cos(0.9)))
    with pytest.raises(cr.InvalidInputError, match="method 'equation' has no order 1"):
        cr.far_field(ellipsoid, [(0, 0, 1)], wavenumber=K, method="equation", order=1)
    with pytest.raises(cr.InvalidInputError, match="give points"):
        cr.surface_field(ellipsoid, wavenumber=K, method="equation")
    with pytest.raises(cr.InvalidInputError, match="not one of 'auto', 'equation'"):
        cr.surface_field(ellipsoid, [AXES], wavenumber=K, method="currents")
    drum = sc.Cylinder(1.0, 3.0)
    edged = cr.launch(cr.DirectFlow(drum), cr.shadow_line(drum, (1, 0.2, 0.3)), length=3.0, n_rays=24)
    with pytest.raises(cr.InvalidInputError, match="edges"):
        cr.surface_currents(edged, wavenumber=6.0, boundary="hard", solve=True)
    with pytest.raises(cr.InvalidInputError, match=r"at wavenumber 150: \d+ nodes take about"):
        cr.far_field(edged, [(0, 0, 1)], wavenumber=150.0, boundary="hard", method="equation")
    with pytest.raises(cr.InvalidInputError, match="not solved at wavenumber 4: give solve=True"):
        cr.surface_currents(fan, wavenumber=4.0, boundary="pec", solve=False)
    fan = fan_of(fan.body, fan.line.direction)
    monkeypatch.setattr(whole_solution, "MOST", 1e6)
    with pytest.raises(cr.InvalidInputError, match='method="equation"'):
        cr.conductor_current(fan, [(0.0, 1.0, 0.0)], wavenumber=4.0)
    monkeypatch.setattr(whole_solution, "ASKED", 1e6)
    with pytest.raises(cr.InvalidInputError, match="nodes, more than 1000"):
        cr.far_field(fan, [(0, 0, 1)], wavenumber=4.0, boundary="pec", method="equation")
    assert set(cr.far_field(fan, [(0, 0, 1)], wavenumber=4.0, boundary="pec").method) == {"rays+optics"}
