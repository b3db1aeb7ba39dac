"""Echoes of bodies with edges, joints and tips: against far fields, Mie, closed forms, fundamental solutions."""

import numpy as np
import pytest
from creased_bodies import SplitBall

import creeping as cr
import scatterers as sc
from creeping.sweeping.echoes import echo_of
from creeping.sweeping.request import sweep_request
from creeping.sweeping.sweeper import Sweeper
from studies.reference import sphere, stored

RADIUS, HALF, K = 0.4, 0.5, 20.0
CAPSULE = sc.Capsule(radius=RADIUS, length=2 * (HALF + RADIUS))


@pytest.fixture(scope="module")
def flow():
    return cr.DirectFlow(CAPSULE, rtol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("quantity", ["monostatic", "bistatic"])
def test_each_value_is_that_of_the_far_field(flow, quantity):
    d, seen = np.array([[-1, 0, -0.4], [0.3, 0.2, -1]]), np.array([[0, 1.0, 0], [0.6, 0, 0.8]])
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    asked = {"wavenumbers": [15.0, K], "boundary": ["hard", "pec"], "length": 3.0, "n_rays": 32}
    observation = seen if quantity == "bistatic" else None
    ds = cr.sweep_directions(flow, d, quantity=quantity, observation=observation, **asked)
    assert ds.attrs["served_by"] == "rays+optics" and np.all(ds["incidence_status"] == 0)
    for row, one in enumerate(d):
        line = cr.shadow_line(CAPSULE, one)
        fan = cr.launch(flow, line, length=3.0, n_rays=32, max_gap=np.inf, measured=False)
        assert float(ds["line_length"][row]) == pytest.approx(line.length, rel=1e-12)
        for k, wavenumber in enumerate(asked["wavenumbers"]):
            # sweeps go by rays unless they are asked for more
            seen_from = -one if observation is None else seen
            far = cr.far_field(fan, seen_from, wavenumber=wavenumber, boundary="pec", method="rays")
            for name in ("creeping", "reflected", "error", "unresolved"):
                found = ds[f"{name}_pec"][row, k].values
                np.testing.assert_allclose(found, np.reshape(getattr(far, name), found.shape), rtol=1e-12, atol=1e-14)
            assert float(ds["least_k_rho"][row, k]) == far.validity.least_k_rho
            scalar = cr.far_field(fan, seen_from, wavenumber=wavenumber, boundary="hard", method="rays")
            found = ds.field.total[row, 0, k].values
            np.testing.assert_allclose(found, np.reshape(scalar.total, found.shape), rtol=1e-12, atol=1e-14)


def test_an_incidence_does_not_depend_on_its_company(flow):
    sweeper = Sweeper(flow, sweep_request("monostatic", length=2.0, n_rays=16, wavenumbers=[K], boundary="soft"))
    d = np.array([[1.0, 0, 0], [0.6, 0, 0.8], [0, 0.6, -0.8]])
    whole = sweeper(d)
    for name, values in sweeper(d[1:2]).items():
        np.testing.assert_array_equal(values, whole[name][1:2], err_msg=name)


def backscatter(body, elevation, k, boundary, n_rays=32):
    """Of a length given: `creeping.backscatter` would ask twelve incidences for one."""
    e = np.radians(elevation)
    d = -np.stack([np.cos(e), 0 * e, np.sin(e)], axis=-1)
    flow, words = cr.DirectFlow(body, rtol=1e-8), {"boundary": boundary, "n_rays": n_rays, "length": 3.0}
    return cr.sweep_directions(flow, d, wavenumbers=k, **words)


def test_ball_of_two_halves_against_mie():
    k = 25.0
    ds = backscatter(SplitBall(), np.array([40.0]), k, "pec")
    exact = abs(sphere.pec_amplitudes(k, 1.0, [-1.0])[0][0]) / k
    for name in ("HH", "VV"):
        of = ds.field.polarisation(name)
        size, error = abs(complex(of.total.squeeze())), float(of.error.squeeze())
        assert abs(size - exact) <= error < 0.25 * exact
    assert not bool(ds.field.unresolved.squeeze())


@pytest.mark.parametrize("boundary", ["soft", pytest.param("pec", marks=pytest.mark.slow)])
def test_capsule_against_fundamental_solutions(boundary):
    """From broadside, where the cylinder has no specular point of its own, to next to the axis."""
    exact = stored.read("capsule_echoes")
    elevation, exact = exact["elevation"], exact[boundary]
    ds = backscatter(CAPSULE, elevation, K, boundary)
    total, error = ds.field.total.values.squeeze(), ds.field.error.values.squeeze()
    off = np.abs(total - exact)
    assert np.mean(off <= error) >= 0.95
    assert np.median(error[~ds.field.unresolved.values.squeeze()]) < 0.06
    # a line of specular points of length 2 HALF, and the caps
    assert np.max(np.abs(total[0])) == pytest.approx(2 * HALF * np.sqrt(K * RADIUS / (4 * np.pi)), rel=0.3)


def test_cone_sphere_from_its_nose():
    """Soft: physical optics of a body of revolution along its axis is (ik/2 pi) of the integral of e^(-2ikz) dA."""
    a, angle, k = 0.4, np.radians(25), 60.0
    body = sc.ConeSphere(radius=a, length=a * (1 + 1 / np.sin(angle)))
    joint, top = a * np.sin(angle), a / np.sin(angle)
    z = [np.linspace(0, joint, 100_001), np.linspace(joint, top, 100_001)]
    rate = 2 * np.pi * z[0], 2 * np.pi * np.tan(angle) ** 2 * (top - z[1])
    optics = sum(np.trapezoid(v * np.exp(-2j * k * x), x) for v, x in zip(rate, z, strict=True)) * 0.5j * k / np.pi
    ds = backscatter(body, np.array([90.0, -90.0]), k, "soft")
    nose, base = ds.field.total.values.squeeze()
    error = ds.field.error.values.squeeze()
    assert abs(nose - optics) <= error[0] and error[0] < 0.01
    assert abs(abs(base) - a / 2) <= error[1] < 0.1 * a / 2


def test_echo_says_what_served():
    ds = backscatter(CAPSULE, np.array([30.0]), [K], "soft", n_rays=16)
    ds = ds.assign_coords(azimuth=("incidence", [0.0]), elevation=("incidence", [30.0]))
    echo = echo_of(ds, "ts", ("soft",), "elevation", sound_speed=1500.0)
    assert echo.otherwise == "rays+optics" and not echo.by_currents.any()
    assert echo.summary()["otherwise_by"] == "rays+optics" and np.all(echo.error > 0)


def test_echoes_of_joints_are_by_currents():
    """Soft, from a side: within a percent of fundamental solutions, where rays and optics err by several."""
    exact = stored.read("capsule_echoes")
    e, exact = np.radians(exact["elevation"][2]), exact["soft"][2]
    d, flow, off = [(-np.cos(e), 0, -np.sin(e))], cr.DirectFlow(CAPSULE, rtol=1e-8), {}
    for method in ("rays", "currents"):
        words = {"boundary": "soft", "n_rays": 64, "length": 3.0, "method": method}
        ds = cr.sweep_directions(flow, d, wavenumbers=K, **words)
        total, error = complex(ds.field.total.squeeze()), float(ds.field.error.squeeze())
        off[method] = abs(total - exact)
        assert off[method] <= error
        assert method == "rays" or bool(np.all(ds["by_currents"]))
    assert off["currents"] < 0.01


def test_a_piece_edge_on_fails_nothing(flow):
    """Along the axis the cylinder is edge on: its caps alone have a line, and nothing fails."""
    ds = cr.sweep_directions(flow, [(0, 0, -1.0)], wavenumbers=K, boundary="soft", length=2.0, n_rays=16)
    assert int(ds["incidence_status"][0]) == 0
    total, error = complex(ds.field.total.squeeze()), float(ds.field.error.squeeze())
    assert abs(abs(total) - RADIUS / 2) <= error
