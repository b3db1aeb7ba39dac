"""Fans of many incidences at once: against `launch`, in whatever company, and bodies that need care."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import directions
from oracles.plain_sweep import PlainSweeper

import creeping as cr
from creeping.rays.ends import RayStatus
from creeping.shadow.status import NO_RAY, LineStatus
from creeping.sweeping.request import sweep_request
from creeping.sweeping.sweeper import Sweeper

BODIES = {
    "triaxial": sc.Ellipsoid(1.2, 0.8, 0.6),
    "torus": sc.Torus(),
    "twisted": sc.TwistedEllipsoid(),
    "weighted": sc.Ellipsoid(1.2, 0.8, 0.6, speed="1 + 0.3*x"),
}


@pytest.mark.parametrize("name", BODIES)
def test_agrees_with_launch(name, rng):
    body = BODIES[name]
    flow = cr.DirectFlow(body, rtol=1e-10)
    request = sweep_request("rays", length=2.0, n_rays=48, n_steps=3)
    d = directions(rng, 4)
    found, plain = Sweeper(flow, request)(d), PlainSweeper(flow, request)(d)
    assert set(found) == set(plain) == set(request.variables)
    for name, variable in request.variables.items():
        assert found[name].dtype == plain[name].dtype == np.dtype(variable.dtype)
        assert found[name].shape == plain[name].shape
        np.testing.assert_array_equal(found[name], plain[name], err_msg=name)
    assert np.all(found["incidence_status"] == LineStatus.OK)


@pytest.mark.parametrize("quantity", ["rays", "monostatic"])
def test_an_incidence_does_not_depend_on_its_company(quantity, rng):
    body = BODIES["twisted"]
    fields = {} if quantity == "rays" else {"wavenumbers": [20.0, 33.0], "boundary": ["soft", "pec"]}
    # 70 rays do not fill their blocks
    request = sweep_request(quantity, length=3.0, n_rays=70, **fields)
    d = directions(rng, 9)
    for flow in (cr.DirectFlow(body, rtol=1e-7), cr.build_phase_map(body, tolerance=1e-4, length=3.0, n_steps=12)):
        sweeper = Sweeper(flow, request)
        whole, part = sweeper(d), sweeper(d[4:6])
        for name in whole:
            np.testing.assert_array_equal(whole[name][4:6], part[name], err_msg=name)
        for name, values in sweeper(d).items():
            np.testing.assert_array_equal(values, whole[name], err_msg=name)


def test_singular_incidences_give_nothing():
    body = BODIES["torus"]
    found = Sweeper(cr.DirectFlow(body), sweep_request("rays", length=1.0, n_rays=16))(np.eye(3))
    assert found["incidence_status"].tolist() == [LineStatus.SINGULAR, LineStatus.SINGULAR, LineStatus.OK]
    assert np.all(found["ray_status"][:2] == NO_RAY) and np.all(np.isnan(found["points"][:2]))
    assert np.all(np.isfinite(found["points"][2]))
    field = sweep_request("monostatic", length=4.0, n_rays=64, wavenumbers=[20.0], boundary="soft")
    found = Sweeper(cr.DirectFlow(body), field)(np.eye(3)[:2])
    assert np.all(np.isnan(found["creeping"]))
    assert LineStatus.FAILED not in found["incidence_status"]


@pytest.mark.slow
def test_non_smooth_regions_ends_rays():
    body = sc.Implicit("x**2 + y**2 + 1.2*z**2 - 1")
    non_smooth = type("NonSmooth", (), {"non_smooth": staticmethod(lambda x: x[..., 2] > 0.8)})
    body.non_smooth = non_smooth.non_smooth  # type: ignore[attr-defined]
    request = sweep_request("rays", length=2.5, n_rays=64, n_steps=8)
    found = Sweeper(cr.DirectFlow(body), request)(np.array([[1.0, 0, 0]]))
    assert RayStatus.NON_SMOOTH in found["ray_status"]
    ended = found["ray_status"][0] == RayStatus.NON_SMOOTH
    assert np.all(found["detachment"][0][ended] < 2.5)
