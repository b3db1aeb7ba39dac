"""The unit of a body's lengths, from the file to the axis of a picture."""

import numpy as np
import pytest
import shared_bodies as sc
import trimesh

import creeping as cr
from creeping.geometry.checks import unit_of


def fan_on(body):
    return cr.launch(cr.DirectFlow(body, rtol=1e-6), cr.shadow_line(body, (0, 0, 1)), length=1.0, n_rays=16)


@pytest.mark.parametrize(("units", "unit", "radius"), [("mm", "m", 1e-3), (None, "L", 1.0)])
def test_meshes_are_metres_if_their_unit_was_given(units, unit, radius):
    body = sc.Mesh(trimesh.creation.icosphere(3), units, cache=False)
    assert (body.unit, unit_of(body)) == (unit, unit)
    np.testing.assert_allclose(np.ptp(body.bounds, axis=0).max() / 2, radius, rtol=0.3)
    assert unit_of(sc.Sphere()) == "L"


def test_results_take_the_unit_of_their_body():
    far = {}
    for body in (sc.Metric(), sc.Sphere()):
        fan = fan_on(body)
        far[unit_of(body)] = cr.far_field(fan, [(0, 1, 0), (0, 0.6, 0.8), (0, 0, -1)], wavenumber=20.0)
        near = cr.near_field(fan, [(0, 0.5, 1.5)], wavenumber=20.0, boundary="soft")
        assert near.length_unit == near.to_xarray()["x"].attrs["units"] == unit_of(body)
    assert {name: one.unit for name, one in far.items()} == {"m": "m", "L": "L"}
    labels = [far[name].plot().get_ylabel() for name in "mL"]
    assert "dB re 1 m$^2$" in labels[0] and "dB re 1 L$^2$" in labels[1]
    # the radar's word is of conductors
    echo = cr.far_field(fan_on(sc.Metric()), [(0, 1, 0), (0, 0.6, 0.8)], wavenumber=20.0, boundary="pec")
    assert "dBsm" in echo.plot().get_ylabel() and "dBsm" not in far["m"].plot(unit="m").get_ylabel()
    assert far["m"].to_xarray()["wavenumber"].attrs["units"] == "m-1"
    assert " m rms" in repr(far["m"]) and " L rms" in repr(far["L"])


def test_sweeps_say_metres_of_a_body_that_knows():
    found = {
        unit_of(body): cr.backscatter(body, wavenumbers=20.0, boundary="soft", n_rays=16, cache=False)
        for body in (sc.Metric(), sc.Sphere())
    }
    units = {
        name: {one: ds[one].attrs["units"] for one in ("wavenumber", "creeping", "line_length")}
        for name, ds in found.items()
    }
    assert units == {
        "m": {"wavenumber": "m-1", "creeping": "m", "line_length": "m"},
        "L": {"wavenumber": "1/L", "creeping": "L", "line_length": "L"},
    }
    assert [found[name].field.dbsm.attrs["units"] for name in "mL"] == ["dBsm", "dB re 1 L^2"]
    assert "metre" not in found["L"].attrs["conventions"] and "wavenumbers in m-1" in found["m"].attrs["conventions"]
