"""The field of one source at many points of a body: a row of the coupling, with the source among them."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.geometry.surface import project

EGG = sc.Ellipsoid(1.2, 1.0, 0.8)
K = 30.0


@pytest.fixture(scope="module")
def points():
    return project(EGG, np.random.default_rng(5).normal(size=(14, 3)))


def test_it_is_a_row_of_the_coupling(points):
    found = cr.port_field(EGG, points[0], points[1:], wavenumber=K)
    whole = cr.coupling(EGG, points, wavenumber=K)
    np.testing.assert_allclose(found.values, whole[0, 1:], rtol=1e-9)
    assert found.method.tolist() == whole.method[0, 1:].tolist()
    assert found.status.tolist() == whole.status[0, 1:].tolist()


def test_source_among_the_points(points):
    found = cr.port_field(EGG, points[2], points[:4].reshape(2, 2, 3), wavenumber=K)
    assert np.isinf(found.values).tolist() == [[False, False], [True, False]]
    assert found.method[1, 0] == "none" and found.status[1, 0] == cr.FieldStatus.CAUSTIC
    assert "PortField(2 x 2 points" in repr(found) and "<table>" in found._repr_html_()
    np.testing.assert_allclose(found.source, points[2])


def test_labels(points):
    pytest.importorskip("xarray")
    data = cr.port_field(EGG, points[0], points[1:3], wavenumber=K).to_xarray()
    assert data["total"].dims == ("point",) and data["total"].attrs["units"] == "1/L"
    np.testing.assert_allclose(data.attrs["source"], points[0])


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"boundary": "soft"}, "hard bodies only"),
        ({"source": [(1, 0, 0), (0, 1, 0)]}, "one point"),
        ({"source": (2.0, 0, 0)}, "off the body|not on|away from"),
        ({"length": -1.0}, "length"),
    ],
)
def test_bad_input_is_refused(points, change, match):
    asked = {"source": points[0], "wavenumber": K, **change}
    with pytest.raises(cr.InvalidInputError, match=match):
        cr.port_field(EGG, asked.pop("source"), points[1:], **asked)
