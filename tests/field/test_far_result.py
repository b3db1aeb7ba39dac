"""Parts of far fields: waves of rays, creeping, reflected and forward, or of lit and of dark currents."""

import numpy as np
import pytest
import shared_bodies as sc
from fake_fields import far_of

import creeping as cr

R = cr.fibonacci_directions(6)


@pytest.mark.parametrize(("method", "known"), [("rays", True), ("currents", False)])
@pytest.mark.parametrize("boundary", ["hard", "pec"])
def test_parts_add_up_and_only_rays_know_the_creeping_one(method, known, boundary):
    fan = cr.launch(cr.DirectFlow(sc.Sphere()), cr.shadow_line(sc.Sphere(), (0, 0, 1)), length=3.0, n_rays=32)
    far = cr.far_field(fan, R, wavenumber=8.0, boundary=boundary, method=method)
    np.testing.assert_allclose(sum(far.parts.values()), far.total, atol=1e-14)
    for part in (far.creeping, far.reflected, far.forward):
        assert part.shape == far.total.shape and np.all(np.isfinite(part)) == known and np.all(np.isnan(part)) != known


def test_a_sweep_has_totals_where_the_creeping_part_is_not_known():
    # at k = 1 rays do not resolve the field: currents serve
    ds = cr.sweep_directions(
        cr.DirectFlow(sc.Sphere()), R[:2], wavenumbers=[1.0, 30.0], boundary="hard", n_rays=32, method="auto"
    )
    served = ds.by_currents.values
    assert served.any() and not served.all()
    np.testing.assert_array_equal(np.isnan(ds.creeping.values), served)
    assert np.all(np.isfinite(ds.field.total))


def test_fields_are_taken_apart_and_joined():
    far = far_of(R, np.arange(6) + 1j)
    again = cr.FarField.joined([far.take(slice(2)), far.take(np.array([2, 3, 4, 5]))])
    for name in ("directions", "total", "creeping", "method", "error"):
        np.testing.assert_array_equal(getattr(again, name), getattr(far, name))


def test_a_part_of_another_shape_is_refused():
    with pytest.raises(ValueError, match="part creeping"):
        far_of(R, np.ones(6), parts={"creeping": np.ones(5)})
