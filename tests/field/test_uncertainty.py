"""What the uncertainty of a body does to its far field."""

from functools import cache

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.rays.uncertain_body import coarse_fan
from tests.exact_meshes import on_body

D, K = (0.3, 0.2, 0.9), 20.0
LENGTH, RAYS = 3.0, 96


def grid(count=12):
    """Directions all about, none of them along the wave."""
    theta, phi = np.meshgrid(np.linspace(0.1, 3.0, count), np.linspace(0, 2 * np.pi, count, endpoint=False))
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)


@cache
def fan_of(body):
    line = cr.shadow_line(body, D)
    return cr.launch(cr.DirectFlow(body), line, length=LENGTH, n_rays=RAYS, n_steps=60, max_gap=np.inf)


class Unsure:
    """An ellipsoid that knows of a coarser one."""

    def __init__(self, body, coarse_fit):
        for name in ("level", "gradient", "hessian", "bounds", "atlas", "parameters", "compiled"):
            setattr(self, name, getattr(body, name))
        self.coarse_fit = coarse_fit


BODY, COARSE_FIT = sc.Ellipsoid(1.0, 0.8, 0.6), sc.Ellipsoid(1.001, 0.799, 0.6005)
UNSURE = Unsure(BODY, COARSE_FIT)


def test_bodies_known_exactly_have_none():
    assert cr.far_field_uncertainty(fan_of(BODY), grid(3), wavenumber=K) is None
    assert coarse_fan(fan_of(BODY)) is None


@pytest.mark.parametrize(
    "boundary, order", [("soft", 1), *(pytest.param(kind, 2, marks=pytest.mark.slow) for kind in ("pec", "hard"))]
)
def test_a_coarser_body_of_another_size_has_the_field_of_another_frequency(boundary, order):
    """A body s times as large scatters s times what the body does at the wavenumber s k: no second body is needed."""
    s, at = 1.001, grid(4)
    fan = fan_of(Unsure(BODY, sc.Ellipsoid(s, 0.8 * s, 0.6 * s)))
    found = cr.far_field_uncertainty(fan, at, wavenumber=K, boundary=boundary, order=order)
    options = {"boundary": boundary, "order": order}
    mine, its = (cr.far_field(fan_of(BODY), at, wavenumber=k, **options).total for k in (K, s * K))
    np.testing.assert_allclose(found, np.abs(mine - s * its), atol=1e-4 * np.abs(mine).max())
    assert found.max() > 1e-3 * np.abs(mine).max()


@pytest.mark.slow
def test_what_a_body_errs_by_more_is_in_its_field():
    more = Unsure(BODY, COARSE_FIT)
    more.coarse_factor = 3.0
    once, thrice = (cr.far_field_uncertainty(fan_of(body), grid(3), wavenumber=K) for body in (UNSURE, more))
    np.testing.assert_allclose(thrice, 3 * once, rtol=1e-9)
    assert once.max() > 0


def test_the_other_fan_is_of_the_coarser_body():
    fan, other = fan_of(UNSURE), coarse_fan(fan_of(UNSURE))
    assert other.body is COARSE_FIT and other.points.shape == fan.points.shape
    np.testing.assert_allclose(other.line.direction, fan.line.direction)
    np.testing.assert_allclose(COARSE_FIT.level(other.points), 0, atol=1e-9)
    assert 0 < np.abs(BODY.level(other.points)).max() < 1e-2


def test_bad_requests_are_those_of_the_field():
    with pytest.raises(cr.CreepingError, match="wavenumber"):
        cr.far_field_uncertainty(fan_of(UNSURE), grid(2), wavenumber=-1.0)
    with pytest.raises(cr.CreepingError):
        cr.far_field_uncertainty(fan_of(UNSURE), grid(2), wavenumber=K, boundary="firm")


class Triangles:
    def __init__(self, vertices, faces):
        self.vertices, self.faces = vertices, faces


@pytest.mark.slow
def test_the_field_of_a_mesh_agrees_within_its_uncertainty():
    exact, vertices, faces = on_body("ellipsoid", 2000)
    mesh = sc.Mesh(Triangles(vertices, faces), cache=False)
    at = grid()
    reported = cr.far_field_uncertainty(fan_of(mesh), at, wavenumber=K)
    fields = [cr.far_field(fan_of(body), at, wavenumber=K).total for body in (mesh, exact)]
    off, size = (float(np.sqrt(np.mean(np.abs(v) ** 2))) for v in (fields[0] - fields[1], fields[1]))
    estimate = float(np.sqrt(np.mean(reported**2)))
    assert off < 2 * estimate
    assert estimate < 2e-3 * size
