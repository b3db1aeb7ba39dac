"""Cuts that others measured, under the headers that they have."""

import numpy as np
import pytest
from fake_fields import echo_of

import creeping as cr
from creeping.files import measured, read_cut, write_echo


def written(tmp_path, text):
    file = tmp_path / "cut.csv"
    file.write_text(text)
    return file


@pytest.mark.parametrize(
    "text",
    [
        "Azimuth (deg),HH (dBsm),VV (dBsm)\n0,-10,-20\n90,-11,-21\n",
        "# a range\n# phi_deg; HH; VV\n0;-10;-20\n90;-11;-21\n",
        "% Angle HH VV\n0 -10 -20\n90 -11 -21\n",
        "angle\trcs_hh_dbsm\trcs_vv_dbsm\n90\t-11\t-21\n0\t-10\t-20\n",
        "phi_s_deg,VV_dBsm,HH_dBsm,phase_VV\n0,-20,-10,77\n90,-21,-11,78\n",
        "Azimuth,sigma_HH (m2),sigma_VV (m2)\n0,0.1,0.01\n90,0.0794328,0.00794328\n",
        "! azimuth_rad HH VV\n0 -10 -20\n1.5707963267948966 -11 -21\n",
    ],
)
def test_usual_headers(tmp_path, text):
    cut = read_cut(written(tmp_path, text))
    assert cut.over == "angle"
    np.testing.assert_allclose(cut.values, [0, 90])
    np.testing.assert_allclose(cut.of("HH"), [-10, -11], atol=1e-5)
    np.testing.assert_allclose(cut.of("VV"), [-20, -21], atol=1e-5)
    assert cut.of("HV") is None


@pytest.mark.parametrize(("name", "polar"), [("phi", False), ("angle (deg)", False), ("theta", True), ("el", True)])
def test_polar_angles_are_told_by_their_names(tmp_path, name, polar):
    assert read_cut(written(tmp_path, f"{name},VV\n0,-20\n90,-21\n")).polar is polar


def test_frequencies_and_no_header(tmp_path):
    cut = read_cut(written(tmp_path, "Frequency_kHz,Sphere_Rigid\n12,-46.2\n38,NA\n"))
    assert cut.over == "frequency" and cut.values.tolist() == [12e3, 38e3]
    levels = cut.of("hard")
    assert levels[0] == -46.2 and np.isnan(levels[1])
    cut = read_cut(written(tmp_path, "0 -1\n1 -2\n2 -3\n"))
    assert cut.over == "angle" and cut.of("VV").tolist() == [-1, -2, -3]


def test_own_table_reads_back(tmp_path):
    echo = echo_of(0.5, 0.1)
    write_echo(tmp_path / "rcs.csv", echo)
    lines = [line for line in (tmp_path / "rcs.csv").read_text().splitlines() if not line.startswith("#")]
    assert len(lines) == 3 and lines[0].startswith("channel,azimuth_deg")
    values = dict(zip(lines[0].split(","), lines[1].split(","), strict=True))
    assert float(values["level_db"]) == echo.levels()[0, 0, 0] and values["method"] == "rays"
    assert float(values["re_m"]) == 0.5 and float(values["reflected_re_m"]) == 0.375


@pytest.mark.parametrize(
    "text",
    [
        "theta_deg,phi_deg,VV_dBsm\n90,0,-20\n90,90,-21\n",
        "freq_ghz,azimuth_deg,VV_dBsm\n10,0,-20\n10,90,-21\n",
        "radar azimuth (deg),VV (dBsm)\n0,-20\n90,-21\n",
        "azimuth_deg,VV\n# measured in 2020, chamber A, day 3\n0,-20\n90,-21\n",
    ],
)
def test_the_column_that_varies_is_the_angle(tmp_path, text):
    cut = read_cut(written(tmp_path, text))
    assert cut.over == "angle" and cut.values.tolist() == [0, 90] and cut.of("VV").tolist() == [-20, -21]


@pytest.mark.parametrize(
    "text",
    [
        "angle,HH\n0,1\n1,2\nangle,VV\n0,3\n1,4\n",
        "angle,HH,HH\n0,1,2\n1,2,3\n",
        "angle,HH\n0,1,2\n1,2,3\n",
        "0,5;-10,2\n1,5;-11,2\n",
        "theta,phi,HH\n0,1,2\n1,2,3\n",
        "HH,angle\n-1,0\n-2,\n",
        # no cut at all
        "",
        "0\n1\n2\n",
        "a,b\n1,2\n",
        "angle,phase\n0,1\n1,2\n",
    ],
)
def test_tables_that_would_be_misread_are_refused(tmp_path, text):
    with pytest.raises(cr.InvalidInputError):
        read_cut(written(tmp_path, text))
    with pytest.raises(cr.InvalidInputError, match="cannot read"):
        read_cut(tmp_path / "none.csv")


@pytest.mark.parametrize(
    ("bound", "text", "said"),
    [
        ({"MOST_BYTES": 10}, "angle,HH\n0,1\n1,2\n", "0 MB"),
        ({"MOST_ROWS": 2}, "angle,HH\n0,1\n1,2\n2,3\n", "line 4: more than 2 rows"),
        ({"LONGEST": 20}, "angle,HH\n0," + "1" * 19 + "\n1,2\n", "line 2: more than 20 characters"),
    ],
)
def test_tables_that_are_too_large_are_refused(tmp_path, monkeypatch, bound, text, said):
    for name, most in bound.items():
        monkeypatch.setattr(measured, name, most)
    with pytest.raises(cr.InvalidInputError, match=said):
        read_cut(written(tmp_path, text))
