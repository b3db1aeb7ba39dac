"""Far field of bodies with edges and joints: against smooth twins, closed forms, and its own error."""

import numpy as np
import pytest
import shared_bodies as sc
from piecewise_bodies import SplitBall, TwoBalls, cut_sphere
from scipy.special import j1

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.field.equation import effort


@pytest.fixture(scope="module")
def fans():
    """Of a ball and of one of two halves, whose geometry is found once for all boundaries."""
    return tuple(fan_of(body, (1, 0, 0.5)) for body in (sc.Sphere(), SplitBall()))


@pytest.fixture(scope="module")
def facing():
    """Onto the facet of a cut ball."""
    return fan_of(cut_sphere(0.5), (0, 0, -1.0))


def fan_of(body, direction, n_rays=48, length=4.0):
    flow = cr.DirectFlow(body, rtol=1e-8)
    return cr.launch(flow, cr.shadow_line(body, direction), length=length, n_rays=n_rays, max_gap=np.inf)


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["soft", "hard", "pec"])
def test_ball_of_two_halves_is_the_ball(boundary, fans):
    """Across a joint that changes nothing the field is that of the smooth body, and the stated error holds."""
    r = cr.fibonacci_directions(60)
    # the ball by currents, the halves by rays and optics
    methods = ("auto", "rays")
    exact, found = (
        cr.far_field(fan, r, wavenumber=25.0, boundary=boundary, method=method)
        for fan, method in zip(fans, methods, strict=True)
    )
    off = np.abs(found.total - exact.total)
    assert np.mean(off <= found.error + exact.error) >= 0.9
    assert set(found.method) == {"rays+optics"} and found.error_by == "order"
    good = ~found.unresolved
    assert np.mean(good) > 0.7
    share = (off / np.abs(exact.total).max(axis=tuple(range(1, off.ndim)), keepdims=True))[good]
    assert np.median(share) < 0.02 and np.max(share) < 0.4


@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_facet_has_its_lobe(boundary, facing):
    """A disc of radius a reflects i k a^2 J1(x)/x at x = k a |q|, q the part of d - r in its plane; hard with n.r."""
    k, a = 25.0, np.sqrt(0.75)
    angle = np.array([0.0, 0.03, 0.1, 0.14])
    r = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    found = cr.far_field(facing, r, wavenumber=k, boundary=boundary, method="rays")
    x = k * a * np.sin(angle)
    lobe = (
        1j * k * a**2 * np.divide(j1(x), x, out=np.full(4, 0.5), where=x > 0) * np.exp(-0.5j * k * (1 + np.cos(angle)))
    )
    disc = lobe if boundary == "soft" else -lobe * np.cos(angle)
    # the ring of the ball below the rim is lit too, and no part of the disc
    assert np.all(np.abs(found.total - disc) <= found.error + 1 / np.sqrt(k))
    assert abs(found.total[0]) == pytest.approx(k * a**2 / 2, rel=0.05) and not found.unresolved[0]
    assert np.all(found.error < 2.0) and found.error[0] > 0.1


@pytest.mark.slow
def test_forward_lobe_is_that_of_the_outline():
    for body, d, area in (
        (cut_sphere(0.5), (1, 0, 0), np.pi - (np.arccos(0.5) - 0.5 * np.sqrt(0.75))),
        (sc.Cylinder(0.5, 2.0), (1, 0, 0), 2.0),
        (sc.Cylinder(0.5, 2.0), (0, 0, 1), np.pi / 4),
        (sc.Capsule(0.5, 3.0), (1, 0, 0), 2 + np.pi / 4),
    ):
        fan = fan_of(body, d, n_rays=16, length=1.0)
        found = cr.far_field(fan, [d], wavenumber=40.0, boundary="hard", method="rays")
        lobe = 40.0 * area / (2 * np.pi)
        assert abs(found.total[0] - 1j * lobe) < 0.02 * lobe + found.error[0]
        # optics integrate all of the lit side: the lobe is in the reflected part, and not known apart
        assert np.isnan(found.forward[0])
        assert abs(found.reflected[0] - 1j * lobe) < 0.01 * lobe


def test_cylinder_broadside():
    """Backscatter of a cylinder of length l, l sqrt(k a/(4 pi)) in size: a line of specular points, no single one."""
    body, k = sc.Cylinder(0.5, 2.0), 40.0
    found = cr.far_field(
        fan_of(body, (1, 0, 0), n_rays=16, length=1.0), [(-1, 0, 0)], wavenumber=k, boundary="soft", method="rays"
    )
    assert abs(found.total[0]) == pytest.approx(np.sqrt(k * 0.5 / (4 * np.pi)) * 2.0, rel=0.05)
    assert not found.unresolved[0]


@pytest.mark.slow
def test_what_is_lost_makes_directions_unresolved(facing):
    """Of a lit edge aside of every lobe the error is the whole of an edge's wave, and says so."""
    k = 25.0
    aside = [(np.sin(1.0), 0, np.cos(1.0)), (np.sin(1.2), 0, np.cos(1.2))]
    found = cr.far_field(facing, aside, wavenumber=k, boundary="hard", method="rays")
    assert np.all(found.error > 0.02) and np.all(np.isfinite(found.error))
    # faces that see each other: what goes between them is not there
    both = cr.far_field(fan_of(TwoBalls(0.7), (1, 0, 0)), [(-1, 0, 0.4)], wavenumber=k, boundary="hard", method="rays")
    assert both.error[0] > 0.1


def test_other_fields_are_refused_by_name_where_the_equation_costs_too_much(monkeypatch):
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    fan = fan_of(cut_sphere(0.5), (1, 0, 0.3), n_rays=8, length=3.0)
    for ask in (
        lambda: cr.near_field(fan, [(0, 0, 3.0)], wavenumber=20.0, boundary="soft"),
        lambda: cr.surface_field(fan, [(0, 0, -1.0)], wavenumber=20.0, boundary="soft"),
        lambda: cr.surface_currents(fan, wavenumber=20.0, boundary="soft"),
    ):
        with pytest.raises(InvalidInputError, match=r"edges|creases"):
            ask()
    waves = cr.surface_field(fan, wavenumber=20.0, boundary="hard")
    gone = fan.travel_time > fan.detachment[:, None]
    assert np.all(waves[gone] == 0) and gone.any()
