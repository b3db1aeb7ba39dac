"""Backscatter over angle and frequency, bistatic cuts: against Mie, against single calls, and what datasets offer."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.results.labelled import power
from creeping.shadow.status import LineStatus
from creeping.sweeping.echoes import echo_of, monostatic_method
from tests.reference import sphere

RADIUS = 0.15


@pytest.fixture(scope="module")
def band():
    k = cr.wavenumber("4:16:0.75GHz")
    return cr.backscatter(sc.Sphere(RADIUS), wavenumbers=k, cache=False)


def test_sphere_over_frequency_against_mie(band):
    k = band["wavenumber"].values
    exact = [abs(sphere.pec_amplitudes(one, RADIUS, [-1.0])[0][0]) / one for one in k]
    for name in ("HH", "VV"):
        fields = band.field.polarisation(name)
        size, error = (abs(v.values.squeeze()) for v in (fields.total, fields.error))
        assert np.all(np.abs(size - exact) <= error)
        # the smallest has ka = 12.6
        assert np.max(np.abs(20 * np.log10(size / exact))) < 0.02
        assert np.all(20 * np.log10(1 + error / size) < 0.5)


def test_labels_and_units(band):
    assert band["scattered"].values.tolist() == ["theta", "phi"]
    cross = band.field.polarisation("HV").dbsm
    assert cross.attrs["units"] == "dB re 1 L^2" and np.all(cross < -60)
    np.testing.assert_allclose(band.field.cross_section, 4 * np.pi * abs(band.field.total) ** 2)
    np.testing.assert_allclose(band.field.target_strength, band.field.dbsm - 10 * np.log10(4 * np.pi))
    with pytest.raises(cr.InvalidInputError, match="polarisation"):
        band.field.polarisation("XX")
    assert [power("m", 2), power("L", 2)] == ["m2", "L^2"]
    echo = echo_of(band, "rcs", ("VV", "HH"), "")
    np.testing.assert_allclose(echo.levels()[0, 0], band.field.polarisation("VV").dbsm[0])
    assert set(echo.parts) == {"creeping", "reflected"}


def test_angles_are_where_the_radar_is():
    body = sc.Ellipsoid(0.3, 0.1, 0.2)
    k = 150.0
    ds = cr.backscatter(body, wavenumbers=k, azimuth=[0.0, 90.0], elevation=[0.0, 0.0], boundary="hard", cache=False)
    np.testing.assert_allclose(ds["direction"].values, [[-1, 0, 0], [0, -1, 0]], atol=1e-12)
    # broadside is the brighter: geometrical optics has sqrt(rho1 rho2)/2
    f = abs(ds.field.total.values.squeeze())
    np.testing.assert_allclose(f, [0.1 * 0.2 / 0.3 / 2, 0.3 * 0.2 / 0.1 / 2], rtol=0.1)


def test_bistatic_is_the_far_field():
    body = sc.Ellipsoid(1.0, 0.8, 0.7)
    azimuth = np.array([10.0, 80.0, 200.0])
    ds = cr.bistatic(body, wavenumbers=15.0, incidence=(30.0, 20.0), azimuth=azimuth, boundary="soft", cache=False)
    a, e = np.radians([30, 20])
    d = -np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), wavenumber=15.0)
    r = np.stack([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth)), 0 * azimuth], axis=1)
    far = cr.far_field(fan, r, wavenumber=15.0)
    found = ds.field.total.values.squeeze()
    assert np.all(np.abs(found - far.total) < far.error)
    echo = echo_of(ds, "ts", ("soft",), "azimuth", sound_speed=1500.0)
    np.testing.assert_allclose(echo.incidence, (30.0, 20.0))
    np.testing.assert_allclose(echo.total[0, :, 0], found)
    with pytest.raises(KeyError):
        echo_of(ds, "ts", ("hard",), "azimuth")


@pytest.mark.parametrize("degrees", [10 + 5j, np.datetime64("2020-01-01"), np.timedelta64(9), [b"10"], "10", [True]])
def test_what_is_no_degree(degrees):
    asked = {"wavenumbers": 5.0, "cache": False}
    for ask in (
        lambda: cr.backscatter(sc.Sphere(), azimuth=degrees, **asked),
        lambda: cr.backscatter(sc.Sphere(), elevation=degrees, **asked),
        lambda: cr.bistatic(sc.Sphere(), azimuth=degrees, **asked),
        lambda: cr.bistatic(sc.Sphere(), incidence=(degrees, 0.0), **asked),
    ):
        with pytest.raises(cr.InvalidInputError, match=r"azimuths|elevations|incidence"):
            ask()


def test_bad_requests():
    bad = [{"wavenumbers": [30.0, 30.0]}, {"wavenumbers": []}, {"elevation": 100.0}, {"azimuth": [np.nan]}]
    for one in (*bad, {"azimuth": "north"}, {"azimuth": np.zeros((2, 2))}, {"boundary": "rubber"}):
        with pytest.raises(cr.InvalidInputError):
            cr.backscatter(sc.Sphere(), **({"wavenumbers": 30.0, "cache": False} | one))
    for one in ({"incidence": (0,)}, {"incidence": "ab"}, {"incidence": (0, 100)}, {"n_rays": None}):
        with pytest.raises(cr.InvalidInputError):
            cr.bistatic(sc.Sphere(), wavenumbers=20.0, cache=False, **one)
    with pytest.raises(cr.InvalidInputError):
        cr.backscatter("sphere", wavenumbers=20.0)


def test_a_wavenumber_without_currents_costs_no_other():
    ds = cr.bistatic(sc.Sphere(), wavenumbers=[8.0, 1e6], azimuth=[90.0], boundary="soft", n_rays=32, cache=False)
    assert np.all(np.isfinite(ds.field.total))
    assert ds["by_currents"].values.squeeze().tolist() == [True, False]


def test_far_fields_have_names_on_their_axes():
    fan = cr.launch(cr.DirectFlow(sc.Sphere()), cr.shadow_line(sc.Sphere(), (0, 0, 1)), length=3.0, n_rays=32)
    far = cr.far_field(fan, [[0, 1, 0], [0, 0, -1]], wavenumber=20.0, boundary="pec", method="rays")
    found = far.to_xarray()["total"].sel(scattered="phi", incident="theta")
    np.testing.assert_array_equal(found, far.total[:, 1, 0])
    np.testing.assert_allclose(far.dbsm[:, 0, 0] - far.target_strength[:, 0, 0], 10 * np.log10(4 * np.pi))
    table = far.to_dataframe()
    assert len(table) == 8 and {"total", "error", "azimuth", "unresolved"} <= set(table.columns)


def test_beyond_the_reach_of_rays_a_matrix_serves_many_angles():
    """Least k rho of 38 kHz is 0.2, that of the sphere 30."""
    fish, k = sc.Ellipsoid(0.07, 0.01, 0.01), 2 * np.pi * 38e3 / 1477
    assert monostatic_method(fish, np.array([k]), "soft", 181) == "t-matrix"
    assert monostatic_method(sc.Sphere(), np.array([30.0]), "soft", 181) == "auto"


def test_a_store_of_echoes_goes_on_and_is_not_written_over(tmp_path, capsys):
    asked = {"wavenumbers": [20.0, 21.0], "azimuth": np.arange(0.0, 40.0, 4.0), "method": "rays", "cache": False}
    plain = cr.backscatter(sc.Sphere(), **asked)
    told = []
    stored = cr.backscatter(sc.Sphere(), store=tmp_path / "s", rows=told.append, progress=True, **asked)
    assert "10 of 10 incidences" in capsys.readouterr().err
    again = cr.backscatter(sc.Sphere(), store=tmp_path / "s", resume=True, **asked)
    for one in (stored, again):
        assert np.array_equal(one["total_pec"], plain["total_pec"]) and "azimuth" in one.coords
    with pytest.raises(cr.InvalidInputError, match="give resume=True"):
        cr.backscatter(sc.Sphere(), store=tmp_path / "s", **asked)
    with pytest.raises(cr.InvalidInputError, match="stored"):
        cr.backscatter(sc.Sphere(), store=tmp_path / "s", resume=True, **(asked | {"azimuth": 3.0}))
    with pytest.raises(cr.InvalidInputError, match="resume goes with store="):
        cr.backscatter(sc.Sphere(), resume=True, **asked)


def test_lines_that_cross_themselves_leave_their_echoes_to_the_equation(monkeypatch):
    """Every line of a wave in the plane of a torus does: its echo is the same from everywhere there."""
    asked = {"wavenumbers": 4.0, "azimuth": [0.0, 37.0], "boundary": "hard", "cache": False}
    alone = cr.backscatter(sc.Torus(1.0, 0.4), **asked)
    # expansions do not reach so far, and nothing is launched that is not needed
    assert alone.attrs["flow"] == "none"
    monkeypatch.setattr("creeping.field.routes.is_reached", lambda *_: True)
    ds = cr.backscatter(sc.Torus(1.0, 0.4), **asked)
    np.testing.assert_allclose(ds.field.total, alone.field.total, atol=float(alone.field.error.max()))
    assert ds["incidence_status"].values.tolist() == [LineStatus.SINGULAR] * 2 and np.all(ds["by_currents"])
    total, error = ds.field.total.values.squeeze(), ds.field.error.values.squeeze()
    assert abs(total[0] - total[1]) < error.sum() < 0.01 * abs(total[0])
    exact = cr.solve(sc.Torus(1.0, 0.4), (-1, 0, 0), wavenumber=4.0, boundary="hard").backscatter()
    assert abs(total[0] - exact.total[0]) < error[0]
    by_equation = cr.backscatter(sc.Torus(1.0, 0.4), method="equation", **asked).field.total.values.squeeze()
    np.testing.assert_allclose(by_equation, total, atol=error.max())
    # where it costs too much there is nothing, and it says so
    monkeypatch.setattr("creeping.sweeping.sweeper.solution_for", lambda *_: None)
    rest = cr.backscatter(sc.Torus(1.0, 0.4), **asked).field
    assert np.all(np.isnan(rest.total)) and np.all(rest.unresolved)
