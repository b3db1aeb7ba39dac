"""``creeping rcs`` and ``creeping ts``."""

import json
import re
from contextlib import contextmanager

import numpy as np
import pytest
import shared_bodies as sc
from command_line import ran, table

import creeping.plotting.pages
from creeping.commands.echo_request import echo_request
from creeping.commands.forecast import forecast
from creeping.errors import InvalidInputError


def test_band_of_a_sphere_with_a_comparison(tmp_path, capsys, monkeypatch):
    titles = {}
    drawn = creeping.plotting.pages.written_figure

    @contextmanager
    def figures(path, *given):
        with drawn(path, *given) as figure:
            yield figure
            titles[path.name] = [ax.get_title() for ax in figure.axes]

    monkeypatch.setattr("creeping.plotting.pages.written_figure", figures)
    given = tmp_path / "given.csv"
    # geometrical optics: pi radius^2
    given.write_text(
        "frequency_GHz,VV_dBsm\n" + "".join(f"{f},{10 * np.log10(np.pi * 0.15**2)}\n" for f in (8, 9.1, 10))
    )
    out = tmp_path / "out"
    words = ["sphere:radius=0.15", "--frequency", "8:10.4:0.15GHz", "--compare", given, "-o", out]
    assert ran("rcs", *words, "--no-cache") == 0
    said, told = capsys.readouterr()
    assert "VV against the reference at 3 places" in said and "range profile" in said
    # 0.3 m in wavelengths of 3.75 to 2.88 cm
    assert "0.3 m, 8.01 to 10.4 wavelengths across, perfect conductor" in told and "creeping rays and surface" in told
    assert "cross section of sphere:radius=0.15, perfect conductor, dBsm" in said.splitlines()[0]
    summary = json.loads((out / "summary.json").read_text())
    assert summary["values"] == 34 and summary["unresolved"] == 0
    assert summary["compared"]["VV"]["rms_db"] < 0.3
    assert sorted(p.name for p in out.iterdir()) == sorted(summary["files"])
    assert {"rcs.csv", "rcs.png", "range.csv", "range.png", "compared.png"} <= set(summary["files"])
    assert [row["channel"] for row in table(out / "rcs.csv")[::17]] == ["HH", "VV"]
    for name in ("rcs.png", "range.png", "compared.png"):
        (title,) = filter(None, titles[name])
        assert title.startswith("sphere:radius=0.15, azimuth 0°, elevation 0°; error ") and title.endswith("median")


@pytest.mark.slow
def test_map_of_target_strength_without_pictures(tmp_path, capsys):
    words = ["ellipsoid:a=0.06,b=0.05,c=0.04", "--sound-speed", 1477, "--frequency", "200:220:20kHz"]
    words += ["--boundary", "hard", "--monostatic", "az:0:20:10", "--no-pictures", "--json", "--no-cache"]
    assert ran("ts", *words, "--format", "csv,mat", "-o", tmp_path) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["unit"] == "dB re 1 m" and summary["files"] == ["ts.csv", "ts.mat", "summary.json"]
    rows = table(tmp_path / "ts.csv")
    assert {row["frequency_hz"] for row in rows} == {"200000.0", "220000.0"}
    assert len(rows) == 6 and {row["azimuth_deg"] for row in rows} == {"0.0", "10.0", "20.0"}
    # sqrt(rho1 rho2)/2 at the nose: b c/a/2
    assert float(rows[0]["level_db"]) == pytest.approx(20 * np.log10(0.05 * 0.04 / 0.06 / 2), abs=1.0)


NONE = dict.fromkeys(("wavelength", "sound_speed", "polarisation", "monostatic", "bistatic", "incidence"))
GOOD = NONE | {"frequency": "10GHz", "boundary": "pec"}


@pytest.mark.parametrize(
    "bad",
    [
        *({"frequency": None}, {"wavelength": "3cm"}, {"frequency": "ten"}),
        {"frequency": None, "wavelength": "300mhz"},
        {"polarisation": "HH,HH"},
        {"polarisation": "HH", "boundary": "soft"},
        {"monostatic": "az", "bistatic": "el"},
        *({"monostatic": text} for text in ("round", "az:5:3:1", "el:-100:0:1", "el:95", "az:1,az:2", "az:1:2")),
        {"incidence": "0,95"},
    ],
    ids=str,
)
def test_bad_options(bad):
    with pytest.raises(InvalidInputError, match="--"):
        echo_request("rcs", **(GOOD | bad))


def test_a_reference_that_does_not_fit_is_refused_first(tmp_path, capsys):
    given = tmp_path / "given.csv"
    given.write_text("angle,VV\n0,1\n1,2\n")
    assert ran("rcs", "sphere", "--frequency", "1:2:1GHz", "--compare", given, "-o", tmp_path) == 3
    assert "over angle" in capsys.readouterr().err
    assert ran("rcs", "sphere", "--frequency", "1GHz", "--polarisation", "HH", "--compare", given, "-o", tmp_path) == 3
    assert "--column" in capsys.readouterr().err
    assert ran("ts", "sphere", "--frequency", "1kHz", "--sound-speed", 1500, "--boundary", "pec") == 3
    assert ran("rcs", "sphere", "--frequency", "1GHz", "--format", "csv,csv", "-o", tmp_path / "x") == 3
    assert "give some of csv, mat" in capsys.readouterr().err


def test_a_comparison_that_fails_costs_no_results(tmp_path, capsys):
    given = tmp_path / "given.csv"
    given.write_text("angle,hard\n200,1\n201,2\n")
    words = ["sphere:radius=0.1", "--sound-speed", 1500, "--frequency", "60kHz", "--boundary", "hard", "--no-pictures"]
    words += ["--monostatic", "az:0:2:1", "-o", tmp_path, "--no-cache"]
    assert ran("ts", *words, "--compare", given) == 0
    assert "hard is not compared" in capsys.readouterr().out and len(table(tmp_path / "ts.csv")) == 3
    for stray in (["--align", 1], ["--compare", given, "--align", "nan"]):
        assert ran("ts", *words, *stray) == 3
        assert "--align" in capsys.readouterr().err


@pytest.mark.slow
def test_azimuths_of_another_turn_are_compared_and_polar_angles_are_not(tmp_path, capsys):
    """A sphere's echo is the same all round: pi radius^2 by optics, given at -3, -2, -1 degrees as 357, 358, 359."""
    words = ["sphere:radius=0.15", "--frequency", "9GHz", "--polarisation", "VV", "--no-pictures", "--no-cache"]
    words += ["--monostatic", "az:-5:5:1", "-o", tmp_path]
    given = tmp_path / "given.csv"
    rows = "".join(f"{angle},{10 * np.log10(np.pi * 0.15**2)}\n" for angle in (1, 2, 357, 358, 359))
    for name, places, wrapped in (("azimuth", 5, 3), ("theta", 2, 0)):
        given.write_text(f"{name}_deg,VV_dBsm\n{rows}")
        assert ran("rcs", *words, "--compare", given) == 0
        said = capsys.readouterr().out
        assert ("3 of its azimuths by whole turns" in said) == bool(wrapped)
        off = json.loads((tmp_path / "summary.json").read_text())["compared"]["VV"]
        assert (off["places"], off["wrapped"]) == (places, wrapped) and off["rms_db"] < 0.3


def test_what_may_take_minutes_is_told_before():
    """Of a slender body over a band, and not of rays alone."""
    fish = sc.Ellipsoid(0.07, 0.007, 0.007)
    asked = NONE | {"sound_speed": 1477.0, "boundary": "soft", "frequency": "38:200:2kHz", "monostatic": "az:0:360:2"}
    band = echo_request("ts", **asked)
    radar = band.angles(fish)
    told = forecast(fish, band.wavenumbers, "soft", radar=radar, metres=True)
    # by currents it took 75 minutes, by the equation of the whole body 15
    assert "the integral equation" in told.by and 2 <= float(re.search(r"about ([\d.]+) min", told.by)[1]) <= 75
    assert re.search(r"0\.14 m, 3.6 to 19 wavelengths across$", told.body)
    assert "rays alone, in seconds" in forecast(fish, band.wavenumbers, "soft", radar=radar, method="rays").by


@pytest.mark.parametrize(
    ("words", "azimuths", "elevations"),
    [
        ({"monostatic": "az:20"}, [20], [0]),
        ({"monostatic": "az:20,el:5"}, [20], [5]),
        ({"monostatic": "el:5", "incidence": "30,0"}, [30], [5]),
        ({"bistatic": "az:20", "incidence": "30,5"}, [20], [5]),
        ({"monostatic": "az:0:20:10"}, [0, 10, 20], [0, 0, 0]),
    ],
)
def test_one_direction_is_one(words, azimuths, elevations):
    request = echo_request("rcs", **(GOOD | words))
    found = request.angles(sc.Sphere())
    assert [list(angles) for angles in found] == [azimuths, elevations]
    if "incidence" in words and "bistatic" in words:
        assert request.incidence == (30, 5)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("rcs sphere --frequency 10", "2 m, 6.67e-08 wavelengths across, too small.*--frequency 10 is 10 Hz"),
        ("rcs sphere:radius=150 --frequency 10GHz", "300 m, 1e[+]04 wavelengths across.*lengths are metres"),
        ("rcs sphere --frequency 1000THz --monostatic az:1", "too large for any field; lengths are metres"),
        ("ts sphere --frequency 38kHz --sound-speed 1.5", "--sound-speed 1.5 m/s is slower.*give 1500"),
        ("run sphere --frequency 10 --direction 1 0 0 -o x", "too small for any field"),
        ("check sphere --wavenumber 1e-6", "too small for any field; --wavenumber 1e-06"),
        ("rcs equation:x**2+y**2+z**2-1 --frequency 1GHz", "give the expression or equation alone: 'x"),
        ("rcs spher --frequency 1GHz", "did you mean sphere"),
        ("figure fig6", "did you mean fig6-creeping or fig6-torus"),
    ],
)
def test_what_cannot_be_meant_names_the_cure(arguments, words, capsys):
    assert ran(*arguments.split()) == 3
    assert re.search(words, capsys.readouterr().err)
