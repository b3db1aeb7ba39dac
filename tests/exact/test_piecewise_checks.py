"""Checks, sweeps of rays and summaries of bodies with creases."""

from pathlib import Path

import numpy as np
import pytest
import shared_bodies as sc
from fake_fields import echo_of
from piecewise_bodies import TwoBalls, cut_sphere

import creeping as cr
from creeping.commands import echo_report
from creeping.commands.run_report import readable, summary_of
from creeping.geometry.checks import wrong_signs
from creeping.geometry.piecewise import is_piecewise, nearest_crease, pieces_of
from creeping.geometry.surface import fingerprint
from creeping.rays.specular import smooth_parts
from scatterers import Cylinder

BODIES = {"cut": cut_sphere(), "two": TwoBalls()}
CUT = BODIES["cut"]


@pytest.mark.parametrize("name", BODIES)
def test_good_bodies_pass_their_check(name):
    report = cr.check_surface(BODIES[name])
    assert report.ok, report
    assert is_piecewise(BODIES[name]) and len(fingerprint(BODIES[name])) > 20


def test_a_wrong_piece_is_found():
    body = cut_sphere()
    body.pieces[0].hessian = lambda x: np.zeros((*x.shape, 3))
    report = cr.check_surface(body)
    assert not report.ok and any("piece 0: Hessian" in check.name and not check.ok for check in report.checks)


class TurnedAtItsTop(Cylinder):
    def level(self, points):
        return np.where(points[..., 2] > 0.999, -1, 1) * super().level(points)


def test_wrong_signs_are_a_share_of_the_area_and_rcs_says_so(tmp_path):
    body = TurnedAtItsTop(0.05, 2.0)
    end = np.pi * 0.05**2 / (2 * np.pi * 0.05 * 2.05)
    share, worst, _ = wrong_signs(body)
    # of tiles as coarse as its radius
    assert share == pytest.approx(end, rel=0.15) and worst == 1.0
    (row,) = (check for check in cr.check_surface(body).checks if "wrong sign" in check.name)
    assert row.worst == share and not row.ok and "(of that of piece" in row.name
    echo = echo_of(0.5, 0.25)
    extra = echo_report.write_results(tmp_path, echo, {}, body, "rod", pictures=False)[1]
    said = dict.fromkeys(("error_db_median", "otherwise_by", "by_currents", "values", "unresolved"))
    said |= (
        echo.summary() | extra | {"body": "rod", "boundary": "pec", "seconds": 0.0, "files": [], "failed_incidences": 0}
    )
    said["validity"] = {"least_k_rho": None, "largest_transverse": None}
    assert "beside 1.1 % of its area F has the wrong sign" in echo_report.readable(said, tmp_path)


def test_parts_and_creases():
    assert smooth_parts(sc.Capsule(0.5, 3.0)) == ((0, 1, 2),) and smooth_parts(sc.Cylinder(0.5, 2.0)) == (
        (0,),
        (1,),
        (2,),
    )
    found, distance = nearest_crease(sc.Cylinder(0.5, 2.0), np.array([[0.6, 0, 1.0], [0, 0.5, -0.9]]))
    assert found.tolist() == [1, 0]
    np.testing.assert_allclose(distance, 0.1, atol=1e-4)
    assert [len(piece.samples) > 10 for piece in pieces_of(sc.Cone(0.5, 1.0))] == [True, True]


@pytest.mark.slow
def test_sweep_of_rays_is_that_of_each_fan():
    body, d = CUT, np.array([[1.0, 0, 0.2], [0, 0, 1.0]])
    flow = cr.DirectFlow(body, rtol=1e-9)
    found = cr.sweep_directions(flow, d, quantity="rays", n_rays=8, length=3.0)
    assert np.all(found["incidence_status"] == 0)
    for row in range(2):
        line = cr.shadow_line(body, d[row])
        fan = cr.launch(flow, line, n_rays=8, length=3.0, max_gap=np.inf)
        assert float(found["line_length"][row]) == pytest.approx(line.length, rel=1e-12)
        np.testing.assert_array_equal(found["ray_status"][row], fan.status)
        np.testing.assert_allclose(found["detachment"][row], fan.detachment, atol=1e-9)


@pytest.mark.slow
def test_summary_tells_what_is_lost():
    body = CUT
    line, flow = cr.shadow_line(body, (1, 0, 0.2)), cr.DirectFlow(body, rtol=1e-8)
    fan = cr.launch(flow, line, n_rays=16, length=3.0, max_gap=np.inf)
    summary = summary_of("cut", None, line, flow, fan, [])
    assert summary["losses"] == fan.losses()._asdict() and summary["ray_status"]["EDGE"] > 0
    summary |= {"drawn_by": None, "files": [], "seconds": 0.0}
    assert "on edges and tips: " in readable(summary, Path("out"))


def test_iso_phase_curves_end_with_their_rays():
    body = CUT
    line = cr.shadow_line(body, (1, 0, 0.2))
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-10), line, n_rays=24, length=3.0, max_gap=np.inf)
    (curve,) = cr.iso_phase_curves(fan, [2.2])[:1]
    assert np.all(fan.detachment[curve.rays] >= 2.2)
    # on the ball and across the rays: great circles
    exact = fan.points[curve.rays, 0] * np.cos(2.2) + line.direction * np.sin(2.2)
    np.testing.assert_allclose(curve.points, exact, atol=1e-7)
