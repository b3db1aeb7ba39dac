"""The two numbers that tell how far a wave is from the limit of short waves."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.validity_range import (
    SOME,
    TURN,
    Validity,
    body_validity,
    launch_validity,
    validities,
    validity_numbers,
    validity_words,
)
from creeping.geodesics.equations import sharpest_curvature
from creeping.rays.reach import early_length
from creeping.shadow.line import shadow_lines
from creeping.shadow.status import LineStatus


def fan_of(body, d, length=2.0):
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction=d), length=length, n_rays=32)


def test_a_slender_body_along_its_axis():
    # rho = c^2/a and kappa_t = 1/a on the equator, where the rays start and are least curved
    a, c, k = 0.6, 1.2, 20.0
    found = cr.validity(fan_of(sc.Ellipsoid(a, a, c), (0, 0, 1), 0.01), wavenumber=k)
    rho = c * c / a
    assert found.least_k_rho == pytest.approx(k * rho, rel=1e-3)
    assert found.largest_transverse == pytest.approx(rho / a / (k * rho / 2) ** (2 / 3), rel=1e-3)


def test_a_fan_without_rays(dark_fan):
    assert np.all(np.isnan(cr.validity(dark_fan, wavenumber=10.0)))


def test_bad_wavenumbers_are_named(ball_fan):
    with pytest.raises(cr.InvalidInputError, match="wavenumber"):
        cr.validity(ball_fan, wavenumber=-1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    "body", [sc.TwistedEllipsoid(), sc.Ellipsoid(1.0, 0.6, 0.4), sc.Ellipsoid(2.0, 0.4, 0.4), sc.Torus()], ids=repr
)
def test_many_incidences_have_what_each_has(body):
    # the same rays at the same points, carried by the flow of order 8
    directions, ks = cr.fibonacci_directions(6), (20.0, 45.0)
    lines = shadow_lines(body, directions, SOME)
    until = 0.6 * early_length(body, ks[0])
    least, largest = validities(body, lines.launch, until, ks)
    steps = max(8, int(np.ceil(until * sharpest_curvature(body) / TURN)))
    for row in np.flatnonzero(lines.status != LineStatus.SINGULAR):
        line = cr.shadow_line(body, directions[row])
        options = {"length": until, "n_rays": SOME, "n_steps": steps, "max_gap": np.inf}
        fan = cr.launch(cr.DirectFlow(body), line, **options)
        for j, k in enumerate(ks):
            assert (least[row, j], largest[row, j]) == pytest.approx(cr.validity(fan, wavenumber=k), rel=2e-3)


def test_the_start_of_the_rays_serves_every_wavenumber():
    body = sc.Ellipsoid(1.0, 0.6, 0.4)
    fan = fan_of(body, (1, 2, 3), 1e-3)
    radius, transverse = launch_validity(body, fan.line.launch_points(32))
    for k in (7.0, 300.0):
        found = cr.validity(fan, wavenumber=k)
        assert k * radius[0] == pytest.approx(found.least_k_rho, rel=1e-2)
        assert transverse[0] / k ** (2 / 3) == pytest.approx(found.largest_transverse, rel=1e-2)


def test_a_body_has_the_worst_of_its_incidences():
    body = sc.Ellipsoid(1.0, 0.6, 0.4)
    each = np.array([cr.validity(fan_of(body, d), wavenumber=30.0) for d in cr.fibonacci_directions(12)])
    found = body_validity(body, wavenumber=30.0)
    assert found.least_k_rho == pytest.approx(each[:, 0].min(), rel=0.05)
    assert found.largest_transverse == pytest.approx(each[:, 1].max(), rel=0.1)


def test_a_far_field_has_that_of_its_fan(ball_fan):
    far = cr.far_field(ball_fan, [(0, 1, 0)], wavenumber=20.0, method="rays")
    assert far.validity == cr.validity(ball_fan, wavenumber=20.0)
    assert validity_numbers(far.validity) in repr(far)


def test_words_are_graded():
    words = [
        validity_words(Validity(*numbers)) for numbers in ((10.0, 1.0), (7.7, 0.7), (30.0, 1.5), (3.0, 0.1), (50, 3))
    ]
    assert ["within" in w for w in words] == [True, False, False, False, False]
    assert ["edge" in w for w in words] == [False, True, True, False, False]
    assert ["beyond" in w for w in words] == [False, False, False, True, True]
    measured = validity_words(Validity(3.0, 0.1), measured=True)
    assert "go by the error measured" in measured and "large" not in measured
