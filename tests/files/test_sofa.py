"""SOFA files: what sofar reads back, against the patterns and, for a rigid sphere, the series."""

from dataclasses import replace

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.files import write_sofa
from tests.reference import sphere

sofar = pytest.importorskip("sofar")
RADIUS, SPEED = 0.0875, 343.0
EARS = RADIUS * np.array([(0.0, 1.0, 0.0), (0.0, -1.0, 0.0)])
AZIMUTH = np.array([0.0, 30.0, 90.0, 200.0, 270.0, 0.0])
ELEVATION = np.array([0.0, 45.0, 0.0, -20.0, 0.0, 90.0])
K = np.array([15.0, 25.0]) / RADIUS


def towards(azimuth, elevation):
    """Unit vectors by the standard's own words: azimuth counter-clockwise from x, elevation from the xy plane."""
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], axis=-1)


@pytest.fixture(scope="module")
def heard():
    flow = cr.DirectFlow(sc.Sphere(RADIUS), rtol=1e-7)
    return [cr.source_pattern(flow, EARS, towards(AZIMUTH, ELEVATION), wavenumber=k) for k in K]


def read(path):
    found = sofar.read_sofa(str(path), verbose=False)
    assert found.verify(issue_handling="return") is None
    return found


def test_a_head_comes_back(heard, tmp_path):
    write_sofa(tmp_path / "head.sofa", heard, sound_speed=SPEED, title="rigid sphere")
    assert [entry.name for entry in tmp_path.iterdir()] == ["head.sofa"]
    found = read(tmp_path / "head.sofa")
    assert (found.GLOBAL_SOFAConventions, found.GLOBAL_DataType) == ("SimpleFreeFieldHRTF", "TF")
    assert (found.GLOBAL_Title, found.GLOBAL_ApplicationVersion) == ("rigid sphere", cr.__version__)
    assert "far field" in found.GLOBAL_Comment and "hard boundary" in found.GLOBAL_Comment
    np.testing.assert_allclose(found.N, SPEED * K / (2 * np.pi), rtol=1e-14)
    assert found.SourcePosition_Units == "degree, degree, metre"
    np.testing.assert_allclose(found.SourcePosition[:, :2], np.stack([AZIMUTH, ELEVATION], axis=-1), atol=1e-10)
    np.testing.assert_allclose(np.squeeze(found.ReceiverPosition), EARS, atol=1e-15)
    values = found.Data_Real + 1j * found.Data_Imag
    assert values.shape == (len(AZIMUTH), 2, len(K))
    for number, one in enumerate(heard):
        assert np.array_equal(values[..., number], np.conj(one.values))


def test_the_file_holds_the_head_of_the_series(heard, tmp_path):
    write_sofa(tmp_path / "head.sofa", heard, sound_speed=SPEED)
    found = read(tmp_path / "head.sofa")
    values = found.Data_Real + 1j * found.Data_Imag
    ears = np.squeeze(found.ReceiverPosition) / RADIUS * (1 + 1e-12)
    for n, frequency in enumerate(found.N):
        ka = 2 * np.pi * frequency * RADIUS / SPEED
        exact = [sphere.total_field(ka, 1.0, ears, -r, "hard") for r in towards(*found.SourcePosition[:, :2].T)]
        assert np.max(np.abs(values[..., n] - np.conj(exact))) < 0.04
    # the left ear hears what comes from the left, first: less delay is more phase where time is e^{+iwt}
    left, right = values[2, :, 0]
    assert abs(left) > 1.9 > 1.2 > abs(right)


@pytest.mark.parametrize("count, asked", [(3, "auto"), (2, "GeneralTF")])
def test_other_receivers_are_general(heard, count, asked, tmp_path):
    turned = np.stack([EARS[1], EARS[0], 2 * EARS[0]])[:count]
    few = [replace(one, sources=turned, values=np.resize(one.values, (6, count))) for one in heard]
    few = [replace(one, error=np.zeros((6, count)), status=np.zeros((6, count), dtype=int)) for one in few]
    write_sofa(tmp_path / "array.sofa", few, sound_speed=SPEED, convention=asked)
    found = read(tmp_path / "array.sofa")
    assert found.GLOBAL_SOFAConventions == "GeneralTF"
    assert np.array_equal(found.Data_Real.reshape(6, count, 2)[..., 1], few[1].values.real)
    np.testing.assert_allclose(found.ReceiverPosition.reshape(count, 3), turned)


def test_units_of_length_are_those_of_the_body(heard, tmp_path):
    bare = [replace(one, sources=one.sources / RADIUS, wavenumber=one.wavenumber * RADIUS) for one in heard]
    write_sofa(tmp_path / "bare.sofa", bare, sound_speed=SPEED, unit_length=RADIUS)
    found = read(tmp_path / "bare.sofa")
    np.testing.assert_allclose(found.N, SPEED * K / (2 * np.pi), rtol=1e-14)
    np.testing.assert_allclose(np.squeeze(found.ReceiverPosition), EARS, atol=1e-15)
    metres = [replace(one, length_unit="m") for one in heard]
    with pytest.raises(cr.InvalidInputError, match="are metres"):
        write_sofa(tmp_path / "twice.sofa", metres, sound_speed=SPEED, unit_length=0.001)


def test_doubtful_values_are_counted(heard, tmp_path):
    status = heard[0].status.copy()
    status[3, 1] = 1
    values = heard[0].values.copy()
    values[3, 1] = np.nan
    write_sofa(tmp_path / "doubt.sofa", [replace(heard[0], status=status, values=values)], sound_speed=SPEED)
    found = read(tmp_path / "doubt.sofa")
    assert "1 of 12 values" in found.GLOBAL_Comment
    assert np.squeeze(found.Data_Real)[3, 1] == 0


def test_bad_patterns_are_named(heard, tmp_path):
    path = tmp_path / "bad.sofa"
    one, other = heard
    turned = replace(other, directions=other.directions[::-1])
    moved = replace(other, sources=2 * other.sources)
    soft = replace(other, boundary="soft")
    swapped = replace(one, sources=one.sources[::-1])
    for given, words in (
        ([], "none in it"),
        ([one, np.ones((6, 2))], "none in it"),
        ([one, turned], r"1 of 2 patterns are of other directions.*number 1"),
        ([one, moved], "of other sources"),
        ([one, soft], "several bodies: hard.*soft"),
        ([other, one], "do not ascend"),
        ([swapped], "left one.*GeneralTF"),
    ):
        with pytest.raises(cr.InvalidInputError, match=words):
            write_sofa(path, given, sound_speed=SPEED)
    with pytest.raises(TypeError, match="sound_speed"):
        write_sofa(path, heard)
    for speed in (None, float("nan"), "343"):
        with pytest.raises(cr.InvalidInputError, match="sound_speed"):
            write_sofa(path, heard, sound_speed=speed)
    with pytest.raises(cr.InvalidInputError, match="unit_length"):
        write_sofa(path, heard, sound_speed=SPEED, unit_length=-1)
    with pytest.raises(cr.InvalidInputError, match="convention"):
        write_sofa(path, heard, sound_speed=SPEED, convention="HRIR")
    with pytest.raises(cr.InvalidInputError, match=r"end it in \.sofa"):
        write_sofa(tmp_path / "head.nc", heard, sound_speed=SPEED)
    with pytest.raises(cr.CreepingError, match="create the folder first"):
        write_sofa(tmp_path / "no" / "head.sofa", heard, sound_speed=SPEED)
    assert not list(tmp_path.iterdir())
