"""``creeping run``: frequencies, units, steps of cuts, what is drawn, what stands in the table."""

import json

import numpy as np
import pytest
import shared_bodies as sc
from command_line import ran, table

import creeping as cr
from creeping.commands import run_field
from creeping.commands.options import Output, WaveOptions
from creeping.commands.resuming import Unfinished
from creeping.errors import InvalidInputError
from creeping.field.waves.forward import lobe_step
from tests.reference import sphere

X = (1.0, 0.0, 0.0)


@pytest.mark.slow
def test_a_frequency_is_in_metres_and_dbsm(tmp_path, capsys):
    options = ["--direction", 0, 0, 1, "--flow", "direct", "--rays", 32, "--length", "0.5", "--no-pictures"]
    field = ["--frequency", "6GHz", "--boundary", "pec", "--observe", "backscatter", "--observe", "cut:0:90"]
    assert ran("run", "sphere:radius=0.15", *options, *field, "-o", tmp_path) == 0
    said, told = capsys.readouterr()
    assert "0.3 m, 6 wavelengths across" in told and "perfect conductor: far field by" in told
    assert said.startswith("sphere:radius=0.15, perfect conductor, d =")
    assert "6 GHz, k = 125.751" in said and "dBsm" in said and "no pictures" in said
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert not [name for name in summary["files"] if name.endswith(".png")]
    assert sorted(summary["files"]) == sorted(file.name for file in tmp_path.iterdir())
    assert summary["field"]["unit"] == "m" and summary["field"]["frequency"] == pytest.approx(6e9)
    rows = table(tmp_path / "far.csv")
    assert [row["observe"] for row in rows] == ["backscatter"] + 5 * ["cut:0:90"]
    np.testing.assert_allclose([float(row["angle"]) for row in rows], [np.nan, -180, -90, 0, 90, 180])
    exact = abs(sphere.pec_amplitudes(125.751, 0.15, [-1.0])[0][0]) / 125.751
    assert float(rows[0]["rcs_dB_tt"]) == pytest.approx(10 * np.log10(4 * np.pi * exact**2), abs=0.1)


def test_cuts_fit_their_lobes():
    job = run_field.job(WaveOptions(400.0), None, ["cut:30", "cut:0:2", "backscatter"], X)
    fitted = job.fitted(sc.Sphere())
    step = lobe_step(sc.Sphere(), 400.0, monostatic=False)
    # lobes are lambda/D wide: four angles or more to each
    assert np.radians(step) <= 2 * np.pi / 400 / 2 / 4
    counts = [len(target.directions) for target in fitted.targets]
    assert counts == [round(360 / step) + 1, 181, 1]
    assert np.degrees(fitted.targets[0].phi[0]) == pytest.approx(30)
    for step in ("0", "7", "-1", "0.0001", "x"):
        with pytest.raises(InvalidInputError, match="cut:0"):
            run_field.job(WaveOptions(20.0), None, [f"cut:0:{step}"], X)
    # of the finest lobes no more than is bearable
    huge = run_field.job(WaveOptions(1e6), None, ["cut:30"], X).fitted(sc.Sphere())
    assert len(huge.targets[0].directions) == 7201


@pytest.mark.parametrize(
    ("words", "match"),
    [
        ({"frequency": "2:3:1GHz"}, "range"),
        ({"frequency": "10"}, None),
        ({"frequency": "10GHz", "wavelength": "3cm"}, "give one of"),
        ({"frequency": "10 parsec"}, "--frequency: .*unknown unit"),
        ({"frequency": "10GHz", "polarisation": "HH"}, "of a conductor"),
        ({"frequency": "10GHz", "boundary": "pec", "polarisation": "HX"}, "give some of"),
    ],
)
def test_the_wave_is_asked_for_once(words, match):
    asked = {"boundary": None, "polarisation": None} | words
    boundary, polarisation = asked.pop("boundary"), asked.pop("polarisation")
    wave = WaveOptions(**asked)
    if match is None:
        assert run_field.job(wave, boundary, None, X).wavenumber == pytest.approx(cr.wavenumber(10.0))
        return
    with pytest.raises(InvalidInputError, match=match):
        run_field.job(wave, boundary, None, X, polarisation=polarisation)


def test_sound_has_its_speed():
    job = run_field.job(WaveOptions(None, "38kHz", None, 1477.0), "hard", None, X)
    assert job.wavenumber == pytest.approx(2 * np.pi * 38e3 / 1477) and job.unit == "m"
    assert job.told("m") == "38 kHz, k = 161.653/m"


@pytest.mark.slow
def test_a_cut_across_the_wave_is_smooth_through_the_poles(tmp_path):
    """At the poles the components are those of the cut, not those of phi = 0."""
    job = run_field.job(WaveOptions(30.0), "pec", ["cut:90"], X)
    body = sc.Sphere()
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-7), cr.shadow_line(body, X), length=3.0, n_rays=32)
    far, _ = job.far_field(fan, Unfinished(tmp_path, tmp_path / "run.parts", {}))
    # both unit vectors turn round at a pole
    before, at, after = far.total[[179, 180, 181]]
    np.testing.assert_allclose(at, 0.5 * (after - before), atol=1e-3 * np.abs(at).max())
    # y -> -y leaves body and incident phi alone, and turns that of theta round
    assert np.abs(at[[0, 1], [0, 1]]).max() < 5e-3 * np.abs(at[[0, 1], [1, 0]]).min()
    plain = np.abs(cr.far_field(fan, [(0, 0, 1)], wavenumber=30.0, boundary="pec").total[0])
    assert np.max(np.abs(plain - np.abs(at))) > 0.06 * np.abs(far.total).max()


@pytest.mark.slow
def test_pictures_have_titles_and_components(tmp_path, monkeypatch):
    drawn = {}

    def picture(path, angles, fields, **words):
        drawn[path.name] = (len(angles), list(fields), words)

    monkeypatch.setattr("creeping.plotting.far_cut_picture", picture)
    monkeypatch.setattr("creeping.plotting.currents_picture", lambda *_, wave, **__: drawn.update(wave=wave))
    wave = WaveOptions(frequency="0.5GHz")
    job = run_field.job(wave, "pec", ["cut:90", "cut:0", "cut:0:20"], X, polarisation="HV,VV")
    body = sc.Sphere()
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-6), cr.shadow_line(body, X), length=1.0, n_rays=16)
    far, _ = job.far_field(fan, Unfinished(tmp_path, tmp_path / "run.parts", {}))
    entry, names = job.write(far, fan, Output(tmp_path, "ball$", backend="matplotlib"))
    assert {"far.png", "far_2.png", "far.csv"} <= set(names) and entry["unit"] == "m"
    assert drawn["far.png"][:2] == (361, ["φ = 90°", "φ = 0°"]) and drawn["far_2.png"][0] == 19
    assert drawn["wave"].startswith("500 MHz, k = ") and drawn["wave"].endswith("/m")
    words = drawn["far.png"][2]
    assert words["components"] == ("pt", "tt") and words["quantity"] == "rcs"
    assert words["title"].startswith("ball\\$, d = (1, 0, 0)\n500 MHz, k = ") and ", pec; error " in words["title"]


def test_a_line_that_crosses_itself_leaves_the_field_to_the_equation(tmp_path, capsys):
    """Every wave in the plane of a torus has one; what it scatters backwards and on is known all the same."""
    given = ["--wavenumber", 4, "--boundary", "soft", "--observe", "backscatter", "-o", tmp_path]
    assert ran("run", "torus:R=1,r=0.4", "--direction", 1, 0, 0, *given, "--no-pictures") == 0
    assert "no creeping rays: the shadow line crosses itself at 4 points" in capsys.readouterr().out
    (row,) = table(tmp_path / "far.csv")
    exact = cr.solve(sc.Torus(1.0, 0.4), (1, 0, 0), wavenumber=4.0, boundary="soft").far_field([-1, 0, 0])
    assert float(row["re"]) == pytest.approx(exact.total[0].real) and int(row["unresolved"]) == 0
    assert ran("run", "torus:R=1,r=0.4", "--direction", 1, 0, 0, "-o", tmp_path / "rays") == 3
