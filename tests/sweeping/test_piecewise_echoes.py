"""Echoes of bodies with edges, joints and tips: against far fields, Mie, closed forms, fundamental solutions."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from tests.reference import stored

RADIUS, HALF, K = 0.4, 0.5, 20.0
CAPSULE = sc.Capsule(radius=RADIUS, length=2 * (HALF + RADIUS))


def backscatter(body, elevation, k, boundary, n_rays=32):
    """Of a length given: `creeping.backscatter` would ask twelve incidences for one."""
    e = np.radians(elevation)
    d = -np.stack([np.cos(e), 0 * e, np.sin(e)], axis=-1)
    flow, words = cr.DirectFlow(body, rtol=1e-8), {"boundary": boundary, "n_rays": n_rays, "length": 3.0}
    return cr.sweep_directions(flow, d, wavenumbers=k, **words)


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["soft", "pec"])
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


@pytest.mark.slow
def test_echoes_of_joints_are_by_currents():
    """Soft, from a side: within a percent of fundamental solutions, where rays and optics err by several."""
    exact = stored.read("capsule_echoes")
    e, exact = np.radians(exact["elevation"][2]), exact["soft"][2]
    d, flow, off = [(-np.cos(e), 0, -np.sin(e))], cr.DirectFlow(CAPSULE, rtol=1e-8), {}
    for method in ("rays", "currents"):
        words = {"boundary": "soft", "n_rays": 32, "length": 3.0, "method": method}
        ds = cr.sweep_directions(flow, d, wavenumbers=K, **words)
        total, error = complex(ds.field.total.squeeze()), float(ds.field.error.squeeze())
        off[method] = abs(total - exact)
        assert off[method] <= error
        assert method == "rays" or bool(np.all(ds["by_currents"]))
    assert off["currents"] < 0.01


def test_currents_of_a_body_with_edges_are_those_of_its_equation():
    """Fields all around it, of one incidence: they were rays and optics by default, which err by tenths."""
    body, k, a, e = sc.Cylinder(0.5, 1.0), 3.0, np.radians([0.0, 70.0]), np.radians(20.0)
    ds = cr.bistatic(body, wavenumbers=k, azimuth=np.degrees(a), elevation=20.0, boundary="hard", cache=False)
    r = np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.full(2, np.sin(e))], axis=-1)
    exact = cr.solve(body, (-1, 0, 0), wavenumber=k, boundary="hard").far_field(r)
    assert np.all(ds["by_currents"]) and not np.any(ds.field.unresolved)
    # nothing is launched that is not needed
    assert ds.attrs["flow"] == "none"
    np.testing.assert_allclose(ds.field.total.values.squeeze(), exact.total, atol=1e-12)


@pytest.mark.slow
def test_an_echo_goes_on_the_way_it_was_begun(tmp_path, monkeypatch):
    """Whether rays are needed is a question of memory, too, which is another when a run is resumed."""
    asked = {"wavenumbers": [3.0, 4.0], "azimuth": [0.0, 70.0], "boundary": "hard", "cache": False}
    for alone in (True, False):
        with monkeypatch.context() as patch:
            for room in ("echoes", "request"):
                patch.setattr(f"creeping.sweeping.{room}.by_equation_alone", lambda *_, now=alone, **__: now)
            first = cr.bistatic(sc.Cylinder(0.5, 1.0), store=tmp_path / str(alone), **asked)
        assert (first.attrs["flow"] == "none") == alone
        with monkeypatch.context() as patch:
            for room in ("echoes", "request"):
                patch.setattr(f"creeping.sweeping.{room}.by_equation_alone", lambda *_, now=not alone, **__: now)
            again = cr.bistatic(sc.Cylinder(0.5, 1.0), store=tmp_path / str(alone), resume=True, **asked)
        assert again.identical(first)


@pytest.mark.slow
def test_backscatter_goes_on_by_the_method_it_was_begun_with(tmp_path, monkeypatch):
    asked = {"wavenumbers": 3.0, "azimuth": [0.0, 30.0], "boundary": "hard", "cache": False, "store": tmp_path / "s"}
    with monkeypatch.context() as patch:
        patch.setattr("creeping.sweeping.echoes.pays", lambda *_: False)
        first = cr.backscatter(sc.Cylinder(0.5, 1.0), **asked)
    monkeypatch.setattr("creeping.sweeping.echoes.pays", lambda *_: True)
    assert cr.backscatter(sc.Cylinder(0.5, 1.0), resume=True, **asked).identical(first)
