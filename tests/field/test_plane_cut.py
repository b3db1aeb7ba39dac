"""Fields on planes: the grid, the values against the exact sphere, the marks, and what is refused."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.errors import InvalidInputError
from tests.reference import sphere

K = 10.0


@pytest.fixture(scope="module")
def fan():
    body = sc.Sphere()
    return cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, (0, 0, 1)), length=3.2, n_rays=24)


@pytest.fixture(scope="module")
def cut(fan):
    return cr.field_cut(fan, wavenumber=K, boundary="hard", point=(0.0, 0.1, 0.0), extent=(4.0, 3.0), step=0.25)


def test_values_are_those_of_the_exact_series(cut):
    at = cut.points[cut.outside]
    radius = np.linalg.norm(at, axis=1)
    away = radius > 1.2
    exact = sphere.total_field(K, 1.0, at[away], (0, 0, 1), "hard")
    error = np.abs(cut.wave()[cut.outside][away] - exact)
    assert np.sum(away) > 100
    assert np.mean(error <= cut.error[cut.outside][away]) > 0.9
    assert error.max() < 0.1


def test_grid_is_the_plane_that_was_asked_for(cut):
    assert cut.points.shape == (13, 17, 3)
    np.testing.assert_allclose(cut.axes, [[0, 0, 1], [1, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(cut.points[0, 0], [-1.5, 0.1, -2.0])
    np.testing.assert_allclose(cut.points[-1, -1], [1.5, 0.1, 2.0])
    np.testing.assert_allclose(cut.points[6, 8], [0.0, 0.1, 0.0], atol=1e-12)
    np.testing.assert_array_equal(cut.outside, np.linalg.norm(cut.points, axis=-1) >= 1)
    assert np.all(cut.status[~cut.outside] == -1) and np.all(np.isnan(cut.wave()[~cut.outside]))
    assert np.all(np.isfinite(cut.magnitude()[cut.outside]))


def test_shadow_line_crosses_where_geometry_says(cut):
    # the equator z = 0, at y = 0.1
    found = cut.shadow_points()
    expected = [[0.0, -np.sqrt(1 - 0.01)], [0.0, np.sqrt(1 - 0.01)]]
    np.testing.assert_allclose(found[np.argsort(found[:, 1])], expected, atol=1e-4)


def test_shadow_line_beyond_the_rectangle_is_not_marked(fan):
    found = cr.field_cut(fan, wavenumber=K, boundary="hard", point=(0, 0, 2), extent=(1, 1), step=0.5)
    assert found.shadow_points().shape == (0, 2)
    assert np.all(found.outside)


def test_labels_keep_the_grid(cut):
    pytest.importorskip("xarray")
    data = cut.to_xarray()
    assert data["total"].dims == ("up", "across") and data["total"].shape == (13, 17)
    one = data.sel(up=1.0, across=1.5)
    assert (float(one.x), float(one.y), float(one.z)) == pytest.approx((1.0, 0.1, 1.5))
    row, column = np.argmin(abs(cut.up - 1.0)), np.argmin(abs(cut.across - 1.5))
    assert complex(one.total) == cut.wave()[row, column]
    assert data.attrs["across"] == pytest.approx([0, 0, 1]) and data.attrs["up"] == pytest.approx([1, 0, 0])
    assert np.all(data["status"].values[~cut.outside] == -1)


@pytest.mark.slow
def test_default_plane_and_step(fan):
    body = sc.Ellipsoid(0.5, 1.5, 0.6)
    line = cr.shadow_line(body, (1, 0, 0))
    own = cr.launch(cr.DirectFlow(body, rtol=1e-7), line, length=2.0, n_rays=16)
    found = cr.field_cut(own, wavenumber=2.0, boundary="hard", method="rays")
    np.testing.assert_allclose(found.axes, [[1, 0, 0], [0, 1, 0]], atol=1e-12)
    # the body with 0.75 of its longest side all round, in steps of an eighth of a wavelength at most
    np.testing.assert_allclose([np.ptp(found.across), np.ptp(found.up)], [1 + 4.5, 3 + 4.5])
    assert found.step <= 2 * np.pi / 2.0 / 8 + 1e-12
    assert "LIT" in found.status_counts and "FieldCut(" in repr(found) and "<table>" in found._repr_html_()


def test_conductor_satisfies_its_boundary_condition_in_size(fan):
    # next to the lit pole of a large sphere E is the standing wave of a mirror: 2 |sin k h|, H is 2 |cos k h|
    options = {"wavenumber": 30.0, "boundary": "pec", "polarisation": (1, 0, 0)}
    found = cr.field_cut(fan, point=(0, 0, -1.05), extent=(0.08, 0.02), step=0.01, **options)
    middle = found.outside.shape[0] // 2
    height = -1 - found.points[middle, :, 2]
    np.testing.assert_allclose(found.magnitude("E")[middle], 2 * np.abs(np.sin(30 * height)), atol=0.15)
    np.testing.assert_allclose(found.magnitude("H")[middle], 2 * np.abs(np.cos(30 * height)), atol=0.15)
    # E along x on both sides of this plane: all of it is the component of the incident wave
    np.testing.assert_allclose(np.abs(found.wave("E")[middle]), found.magnitude("E")[middle], atol=0.02)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"step": 1e-4}, "points; 400000 are the most"),
        ({"extent": (1.0, -1.0)}, "a width and a height"),
        ({"across": (0, 0, 1), "up": (0, 0, -2)}, "both along"),
        ({"point": (0, 0)}, "three finite coordinates"),
        ({"extent": (0.4, 0.4)}, "inside the body; give a larger extent"),
        ({"polarisation": "theta"}, "of a conductor's field"),
        ({"boundary": "pec", "method": "rays"}, "or .equation."),
    ],
)
def test_bad_input_is_refused(fan, change, match):
    with pytest.raises(cr.InvalidInputError, match=match):
        cr.field_cut(fan, **{"wavenumber": K, "boundary": "hard", **change})


def test_unknown_quantity_and_lengths_are_refused(cut):
    with pytest.raises(cr.InvalidInputError, match="quantity = 'E' is not one of u"):
        cut.wave("E")
    with pytest.raises(cr.InvalidInputError, match="3 values for"):
        cut.on_grid([1, 2, 3])


def test_a_solution_of_any_body_has_its_plane():
    """Of two bodies without F: the points and values of its near field."""
    two = sc.Bodies([sc.Sphere(), sc.Sphere(0.5)], at=[(0, 0, 0), (0, 2, 0)])
    solution = cr.solve(two, [(1, 0, 0), (0, 1, 0)], wavenumber=3.0, boundary="hard")
    found = cr.field_cut(solution, incidence=1, extent=(4.0, 3.0), step=0.5, point=(0, 1, 0), up=(1, 0, 0))
    assert found.line is None and found.shadow_points().shape == (0, 2) and np.all(found.direction == (0, 1, 0))
    apart = [np.linalg.norm(found.points - centre, axis=-1) for centre in ((0, 0, 0), (0, 2, 0))]
    np.testing.assert_array_equal(found.outside, (apart[0] >= 1) & (apart[1] >= 0.5))
    at = found.points[found.outside]
    np.testing.assert_array_equal(found.field.values, solution.near_field(at, incidence=1).values)
    assert found.plot() is not None
    with pytest.raises(InvalidInputError, match="incidence = 2: the solution has 2"):
        cr.field_cut(solution, incidence=2)
    with pytest.raises(InvalidInputError, match=r"or give what creeping\.solve returns"):
        cr.field_cut(two, wavenumber=3.0)
