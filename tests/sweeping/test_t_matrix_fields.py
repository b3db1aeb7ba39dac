"""Sweeps by T-matrices: the values of the equation, taken by themselves where there are many incidences."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.tmatrix.computing import pays
from creeping.sweeping import echoes

BODY, K = sc.Cylinder(0.5, 1.0), 2.5
D = cr.fibonacci_directions(5)


@pytest.mark.slow
@pytest.mark.parametrize("quantity", ["monostatic", "bistatic"])
def test_a_sweep_has_the_fields_of_the_equation(quantity):
    boundaries = ["hard", cr.ImpedanceBoundary(0.5)]
    asked = {"wavenumbers": K, "boundary": boundaries}
    r = D[:2] if quantity == "bistatic" else None
    found = cr.sweep_directions(BODY, D, quantity=quantity, observation=r, method="t-matrix", **asked)
    assert found.attrs["served_by"] == "t-matrix" and not found.unresolved.any() and found.by_currents.all()
    for number, boundary in enumerate(boundaries):
        solution = cr.solve(BODY, D, wavenumber=K, boundary=boundary)
        own = solution.backscatter() if r is None else None
        total = own.total if own else np.array([solution.far_field(r, row).total for row in range(len(D))])
        np.testing.assert_allclose(found.total.values[:, number, 0], total, atol=5e-4 * np.abs(total).max())


@pytest.mark.slow
def test_a_conductor_has_all_its_polarisations_by_rays_too_where_it_has_a_flow():
    body = sc.Sphere(0.3)
    flow = cr.DirectFlow(body, rtol=1e-6)
    found = cr.sweep_directions(flow, D[:2], wavenumbers=5.0, boundary="pec", method="t-matrix")
    exact = cr.solve(body, D[:2], wavenumber=5.0, boundary="pec").backscatter().total
    np.testing.assert_allclose(found.total_pec.values[:, 0], exact, atol=1e-3 * np.abs(exact).max())


@pytest.mark.slow
def test_echoes_of_many_angles_take_it_by_themselves(monkeypatch):
    # of bodies without mirrors
    two = sc.Bodies([BODY, sc.Sphere(0.3)], at=[[0, 0, 0], [1, 2, 0.7]])
    assert pays(two, np.array([K]), "hard", 2000) and not pays(two, np.array([K]), "hard", 1)
    made = []
    monkeypatch.setattr(echoes, "pays", lambda body, k, boundary, count: made.append(count) or count > 2)
    asked = {"wavenumbers": 1.0, "boundary": "hard", "elevation": 20.0}
    many = cr.backscatter(BODY, azimuth=[0.0, 40.0, 80.0], **asked)
    few = cr.backscatter(BODY, azimuth=[0.0, 40.0], **asked)
    assert made == [3, 2] and many.attrs["served_by"] == "t-matrix" != few.attrs["served_by"]
    off = np.abs(many.total.values[:2] - few.total.values)
    assert np.all(off <= many.error.values[:2] + few.error.values)


@pytest.mark.parametrize(
    "asked, words",
    [
        ({"order": 1}, "no order 1"),
        ({"accuracy": 1e-3}, "accuracy goes with rays"),
        ({"quantity": "rays", "wavenumbers": (), "boundary": ()}, "is of a field"),
    ],
)
def test_what_does_not_go_with_it(asked, words):
    with pytest.raises(cr.InvalidInputError, match=words):
        cr.sweep_directions(BODY, D, **({"wavenumbers": K, "boundary": "hard", "method": "t-matrix"} | asked))
