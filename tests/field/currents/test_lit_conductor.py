"""Currents of the lit side of a conductor against exact series: the sphere, and the cylinder met obliquely."""

import numpy as np
import pytest

from creeping.field.boundary import HARD, SOFT
from creeping.field.currents.lit import Ground, lit_conductor, lit_currents
from tests.reference import section, sphere

NOTHING = np.zeros(80)


def on_the_sphere(k, order=2):
    """Errors of J_a for h and of J_b for e, shares of 2, at c (80,)."""
    c = np.linspace(0, 1, 80)
    one = np.ones(80)
    mine = lit_conductor(Ground(c, one, one, NOTHING, NOTHING, NOTHING), k, order) * np.exp(-1j * k * c)[:, None, None]
    across, along = sphere.pec_surface_field(k, 1.0, -c)
    # at phi = 90 degrees a is -theta, b is +x, the way of E0, and J_b = -H_theta; at 0 h is -1 and J_a = H_phi
    return np.abs([mine[:, 0, 0] + along, mine[:, 1, 1] + across]) / 2


@pytest.mark.parametrize("k, hard, soft", [(12.0, 0.03, 9e-3), (40.0, 5e-3, 8e-4)])
def test_sphere(k, hard, soft):
    along, across = on_the_sphere(k)
    assert along.max() < hard and across.max() < soft


def test_order_on_the_sphere():
    first, last = (np.max(on_the_sphere(k), axis=1) for k in (20.0, 80.0))
    assert np.all(np.log(first / last) / np.log(4) > 1.2)
    # the second order is what makes it so
    assert np.all(np.max(on_the_sphere(80.0, order=1), axis=1) > 4 * last)


def on_the_cylinder(gamma):
    """Azimuths (40,) and geometry on the unit cylinder for a wave at an angle gamma to the axis."""
    phi = np.linspace(np.pi / 2, 0.97 * np.pi, 40)
    s, along_axis = np.sin(gamma), np.cos(gamma)
    c, sine = -s * np.cos(phi), np.sin(phi)
    square = 1 - c * c

    def radius(at):
        return (1 - (s * np.cos(at)) ** 2) / (s * np.sin(at)) ** 2

    step, rate = 1e-4, -s * sine / np.sqrt(square)
    slope = (radius(phi + step) - radius(phi - step)) / (2 * step) * rate
    bent = (radius(phi + step) - 2 * radius(phi) + radius(phi - step)) / step**2 * rate**2
    curvatures = (s * sine) ** 2 / square, along_axis**2 / square, s * sine * along_axis / square
    return phi, (c, *curvatures, np.clip(slope, -4, 4), np.clip(radius(phi) * bent, -20, 20))


@pytest.mark.parametrize("kind", [HARD, SOFT])
def test_scalar_currents_of_a_cylinder_met_obliquely(kind):
    # torsion alone: without its term the error is six and fifteen times as large
    gamma, k = 0.8, 320.0
    phi, geometry = on_the_cylinder(gamma)
    s = np.sin(gamma)
    of = section.surface_field if kind == HARD else section.surface_derivative
    exact = of(k * s, 1.0, phi, kind.kind) * np.exp(-1j * k * s * np.cos(phi))
    off = np.abs(lit_currents(Ground(*geometry), k, kind) - exact) / np.abs(exact).max()
    assert off.max() < 1e-4
    plain = list(geometry)
    plain[3] = 0 * phi
    assert np.max(np.abs(lit_currents(Ground(*plain), k, kind) - exact)) > 4 * off.max() * np.abs(exact).max()


def exact_on_the_cylinder(k, gamma, phi, geometry):
    s, along_axis, c, sine = np.sin(gamma), np.cos(gamma), geometry[0], np.sin(phi)
    length = np.sqrt(1 - c * c)
    out = np.empty((len(phi), 2, 2), dtype=complex)
    for column, (h, e) in enumerate(((1.0, 0.0), (0.0, 1.0))):
        # H0 = e v + h b, E0 = e b - h v with v in the plane of incidence across d
        magnetic = (e * c * along_axis - h * s * sine) / length
        electric = -(e * s * sine + h * c * along_axis) / length
        once = [section.pec_currents(k, 1.0, phi, gamma, *pair) for pair in ((1.0, 0.0), (0.0, 1.0))]
        J = [electric * once[0][i] + magnetic * once[1][i] for i in (0, 1)]
        out[:, 0, column] = (J[0] * s * sine + J[1] * along_axis) / length
        out[:, 1, column] = (J[0] * along_axis - J[1] * s * sine) / length
    return out * np.exp(-1j * k * s * np.cos(phi))[:, None, None]


@pytest.mark.parametrize("gamma", [0.8, 1.2, np.pi / 2])
def test_cylinder_met_obliquely(gamma):
    # both polarisations, and what each gives to the other, which is of order 1/m of the soft one
    phi, geometry = on_the_cylinder(gamma)
    for k, limit in ((40.0, 0.012), (320.0, 2e-3)):
        off = np.abs(lit_conductor(Ground(*geometry), k) - exact_on_the_cylinder(k, gamma, phi, geometry)) / 2
        assert off.max() < limit


def test_optics_take_over_on_flat_ground():
    # J = 2 n x H, whatever the plane of incidence
    c, none = np.array([0.3, 0.9]), np.zeros(2)
    J = lit_conductor(Ground(c, none, none, none, none, none), 10.0)
    np.testing.assert_allclose(J, [[[-2, 0], [0, 2 * x]] for x in c], atol=1e-12)
