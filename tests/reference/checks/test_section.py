"""Integral equations on sections, against the series of the circle, energy, and themselves on more nodes."""

import numpy as np
import pytest

from tests.reference import section
from tests.reference.section import SectionSolver, directions, surface_data
from tests.reference.section_shapes import CapsuleSection, bump, ellipse, kite, peanut

SECTIONS = {
    "ellipse": ellipse(1.2, 0.8),
    "peanut": peanut(0.3),
    "kite": kite(),
    "bump": bump(0.02, 0.15, 1.0),
    "capsule": CapsuleSection(),
}


@pytest.mark.parametrize("boundary", ["soft", "hard", 0.5 + 0.2j])
def test_circle(boundary):
    found = surface_data(ellipse(1, 1), 12.0, 0.3, boundary)
    series = section.surface_derivative if boundary == "soft" else section.surface_field
    np.testing.assert_allclose(found.values, series(12.0, 1.0, found.nodes.s - 0.3, boundary), atol=1e-10)
    phi = np.linspace(0, 3, 7)
    far = section.far_field(12.0, 1.0, phi, boundary)
    np.testing.assert_allclose(found.far(directions(phi + 0.3)), far, atol=1e-11)


@pytest.mark.parametrize("name", SECTIONS)
@pytest.mark.parametrize("boundary", ["hard", pytest.param("soft", marks=pytest.mark.slow)])
def test_optical_theorem(name, boundary):
    """The cross section by the far field all round and by its forward value."""
    k, found = 10.0, surface_data(SECTIONS[name], 10.0, 0.4, boundary)
    turn = 2 * np.pi * np.arange(400) / 400
    section = 2 * np.pi * np.mean(np.abs(found.far(directions(turn))) ** 2)
    forward = found.far(directions([0.4]))[0] * np.exp(-0.25j * np.pi)
    assert np.sqrt(8 * np.pi / k) * forward.imag == pytest.approx(section, rel=1e-10)


@pytest.mark.parametrize("name", SECTIONS)
def test_reciprocity_of_an_impedance(name):
    solver = SectionSolver(SECTIONS[name], 8.0)
    eta = 0.5 + 0.3 * np.cos(3 * np.arange(len(solver.nodes.s)) * 2 * np.pi / len(solver.nodes.s))
    one = solver.solve(0.4, eta).far(directions([2.0]))
    other = solver.solve(2.0 + np.pi, eta).far(directions([0.4 + np.pi]))
    np.testing.assert_allclose(one, other, rtol=1e-9)
