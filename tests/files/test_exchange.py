"""Files of other programs: .ffe read back and damaged, MATLAB, STK."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.io
import shared_bodies as sc
from fake_fields import echo_of, far_of

import creeping as cr
from creeping.files import read_ffe, write_ffe, write_mat, write_stk
from creeping.files.ffe import grid_directions
from creeping.sweeping.echoes import echo_of as echo_from

THETA, PHI = np.linspace(0, np.pi, 4), np.linspace(0, 2 * np.pi, 5)


def loaded(folder, result, **options):
    write_mat(folder / "one.mat", result, **options)
    return scipy.io.loadmat(folder / "one.mat", simplify_cells=True)


@pytest.fixture
def far(rng):
    shape = (len(THETA) * len(PHI), 2, 2)
    total = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    # at the poles one direction has one field, whatever the azimuth
    total[:5], total[-5:] = total[0], total[-1]
    return far_of(grid_directions(THETA, PHI), total, boundary="pec", unit="m")


def test_ffe_comes_back_to_the_last_bit(far, tmp_path):
    write_ffe(tmp_path / "far.ffe", far, THETA, PHI, direction=(0, 0, 1))
    blocks = read_ffe(tmp_path / "far.ffe")
    assert [block.name for block in blocks] == ["incident_theta", "incident_phi"]
    # theta runs first in the file, phi in ours; between the poles the frames are the same
    inner = np.arange(len(far.directions)).reshape(4, 5)[1:3].T.ravel()
    for number, block in enumerate(blocks):
        rows = (block.theta > 1) & (block.theta < 179)
        np.testing.assert_array_equal(block.field[rows], far.total[inner, :, number])
        np.testing.assert_allclose(block.directions[rows], far.directions[inner], atol=1e-15)
        assert block.wavenumber == pytest.approx(20.0, rel=1e-14) and block.incidence == (180.0, 0.0)
    # at the pole by the component along x: theta and phi turn with the azimuth of the row
    pole = blocks[0].theta == 0
    azimuth = np.radians(blocks[0].phi[pole])
    x = blocks[0].field[pole, 0] * np.cos(azimuth) - blocks[0].field[pole, 1] * np.sin(azimuth)
    np.testing.assert_allclose(x, far.total[0, 0, 0], atol=1e-14)


FOREIGN = """##File Type: Far field
##File Format: 3
** written by hand
#Configuration Name: one
#Frequency:   3.0E+08
#Coordinate System: Spherical
#No. of Theta Samples: 2
#No. of Phi Samples: 1
#Result Type: Gain
#No. of Header Lines: 1
#                 "Theta"    "Phi"    "Re(Etheta)"  "Im(Etheta)"  "Re(Ephi)"  "Im(Ephi)"  "Gain(Total)"
  0.0  45.0  1.0  2.0  3.0  4.0  -1.0
  9.0  45.0  5.0  6.0  7.0  8.0  -2.0
"""


def test_ffe_of_others(tmp_path):
    file = tmp_path / "foreign.ffe"
    file.write_text(FOREIGN + FOREIGN.replace("3.0E+08", "6.0E+08"))
    one, two = read_ffe(file)
    assert (one.frequency, two.frequency) == (3e8, 6e8) and one.keys["Result Type"] == "Gain"
    # e^{+jwt} is ours conjugated
    np.testing.assert_array_equal(one.field, [[1 - 2j, 3 - 4j], [5 - 6j, 7 - 8j]])
    assert one.theta.tolist() == [0, 9] and one.phi.tolist() == [45, 45] and one.incidence is None


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("5.0  6.0", "5.0  six", "line 13: 'six' is no finite number"),
        ("8.0  -2.0", "8.0", "line 13: 6 numbers in 7 columns"),
        ('"Re(Ephi)"', '"Re(Ephj)"', r"line 11: no column Re\(Ephi\)"),
        ("Theta Samples: 2", "Theta Samples: 3", "2 rows, not 3 theta x 1 phi"),
        ("Theta Samples: 2", "Theta Samples: \u0662", "no whole number as 'No. of Theta Samples'"),
        ("5.0  6.0", "5.0  6_0", "line 13: '6_0' is no finite number"),
        ("** written", "\n".join(f"#a{n}: 1" for n in range(101)) + "\n** ", "more than 100 keys"),
        ("#No. of Phi Samples: 1", "", "No. of Phi Samples"),
        ("3.0E+08", "0", "no positive number as 'Frequency'"),
        ("#  ", "** ", "line 12: a row before"),
        ("** written", "** " + 5000 * "x", "line 3: more than 4096 characters"),
        (FOREIGN, "\x00\xff" * 100, "before the names"),
    ],
)
def test_damaged_ffe_is_refused_by_line(old, new, match, tmp_path):
    assert old in FOREIGN
    (tmp_path / "bad.ffe").write_text(FOREIGN.replace(old, new), encoding="utf-8")
    with pytest.raises(cr.InvalidInputError, match=match):
        read_ffe(tmp_path / "bad.ffe")
    with pytest.raises(cr.InvalidInputError, match="cannot read"):
        read_ffe(tmp_path / "none.ffe")


def test_matlab_has_names_units_and_values(far, tmp_path):
    back = loaded(tmp_path, far)
    np.testing.assert_array_equal(back["f"], far.total)
    assert back["f"].shape == (20, 2, 2) and back["boundary"] == "pec"
    units = back["units"]
    assert (units["f"], units["cross_section_dB"], units["wavenumber"]) == ("m", "dBsm", "m-1")
    np.testing.assert_allclose(back["cross_section_dB"], 10 * np.log10(4 * np.pi * np.abs(far.total) ** 2))
    assert loaded(tmp_path, replace(far, unit="L"))["units"]["cross_section_dB"] == "dB re 1 L^2"


def test_matlab_of_an_echo(tmp_path):
    write_mat(tmp_path / "echo.mat", echo_of(0.5j, 0.01))
    back = scipy.io.loadmat(tmp_path / "echo.mat")
    # a mirror of radius 1
    np.testing.assert_allclose(back["level"], 10 * np.log10(np.pi))
    assert back["level"].shape == (1, 2, 1) and back["channels"][0, 0][0] == "VV"
    assert back["frequency"][0, 0] == pytest.approx(20 * 299792458 / (2 * np.pi))
    with pytest.raises(cr.InvalidInputError, match=r"int is not written to \.mat; give one of Echo, FarField"):
        write_mat(tmp_path / "none.mat", 3)


@pytest.fixture(scope="module")
def ball_fan():
    ball = sc.Sphere()
    line = cr.shadow_line(ball, direction=(0, 0, 1))
    return cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=2.0, n_rays=16)


@pytest.mark.slow
def test_matlab_of_a_plane(ball_fan, tmp_path):
    assert loaded(tmp_path, [])["points"].size == 0
    cut = cr.field_cut(ball_fan, wavenumber=30.0, boundary="pec", extent=(3.0, 4.0), step=0.8, polarisation="theta")
    back = loaded(tmp_path, cut)
    inside = np.linalg.norm(back["points"], axis=-1) < 1
    assert inside.any() and np.array_equal(inside, back["outside"] == 0)
    assert np.all((back["status"] == -1) == inside) and np.array_equal(np.isnan(back["error"]), inside)
    assert np.array_equal(back["method"] == "inside", inside) and np.isnan(back["E"][inside]).all()
    # the plane is across x axes[0] + up x axes[1] from the point
    grid = back["point"] + back["across"][:, None] * back["axes"][0] + back["up"][:, None, None] * back["axes"][1]
    np.testing.assert_allclose(back["points"], grid, atol=1e-12)
    # by the way of labelled results
    labelled = cut.to_xarray()
    for name in ("E", "H"):
        np.testing.assert_array_equal(back[name], labelled[name].values)
        assert back["units"][name] == labelled[name].attrs["units"]


def test_stk_holds_a_grid(tmp_path):
    azimuth, elevation = (v.ravel() for v in np.meshgrid([0.0, 120.0, 240.0], [-30.0, 60.0]))
    asked = {"wavenumbers": 100.0, "azimuth": azimuth, "elevation": elevation, "cache": False, "n_rays": 32}
    echo = echo_from(cr.backscatter(sc.Ellipsoid(0.3, 0.25, 0.2), **asked), "rcs", ("HH", "VV"), "azimuth")
    write_stk(tmp_path / "body.rcs", echo, "VV")
    lines = (tmp_path / "body.rcs").read_text().splitlines()
    assert lines[0] == "stk.v.9.0" and lines[5] == "NumPoints 6" and lines[-1] == "END rcs"
    rows = np.array([line.split() for line in lines[7:-2]], dtype=float)
    # sorted by the angle from z, then about it
    np.testing.assert_allclose(rows[:, :2], [[30, -120], [30, 0], [30, 120], [120, -120], [120, 0], [120, 120]])
    at = (echo.azimuth == 240) & (echo.elevation == -30)
    assert rows[3, 2] == pytest.approx(float(echo.levels()[1, at, 0][0]), rel=1e-9)
    with pytest.raises(cr.InvalidInputError, match="not among HH, VV"):
        write_stk(tmp_path / "none.rcs", echo, "HV")


@pytest.mark.parametrize(("quantity", "match"), [("ts", "no target strength"), ("rcs", "holds a grid")])
def test_stk_refuses_what_it_cannot_hold(quantity, match, tmp_path):
    with pytest.raises(cr.InvalidInputError, match=match):
        write_stk(tmp_path / "none.rcs", echo_of(0.5j, 0.01, quantity), "VV")
