"""Echoes: levels, range profiles, comparisons."""

import numpy as np
import pytest
from fake_fields import echo_of

import creeping as cr
from creeping.field.results.comparison import Echo


def test_levels():
    echo = echo_of(0.5, 0.25)
    # sigma = pi m^2 of |f| = 1/2, as of a sphere of 1 m
    np.testing.assert_allclose(echo.levels(), 10 * np.log10(np.pi))
    np.testing.assert_allclose(echo_of(0.5, 0.25, "ts").levels(), 20 * np.log10(0.5))
    low, high = echo.bounds()
    np.testing.assert_allclose(low, echo.levels() + 20 * np.log10(0.5))
    np.testing.assert_allclose(high, echo.levels() + 20 * np.log10(1.5))
    assert np.all(np.isneginf(echo_of(0.5, 0.6).bounds()[0]))
    assert echo.summary()["largest"]["VV"] == pytest.approx(4.971, abs=1e-3)
    assert echo.hertz[0] == pytest.approx(20 * 299792458 / (2 * np.pi))


def test_shapes_and_names_are_checked():
    with pytest.raises(cr.InvalidInputError, match="none of"):
        echo_of(1.0, 0.1, "loudness")
    with pytest.raises(cr.InvalidInputError, match="shape"):
        Echo(
            "rcs",
            ("VV",),
            "",
            np.zeros(1),
            np.zeros(1),
            None,
            np.ones(2),
            np.ones((1, 1, 1)),
            {"a": np.ones((1, 1, 1))},
            np.ones(1),
            np.ones(1),
            np.ones(1),
        )


@pytest.mark.parametrize("window", ["hann", "taylor", "none"])
def test_two_echoes_stand_at_their_ranges(window):
    k = np.linspace(150.0, 450.0, 301)
    f = 0.5 * np.exp(-2j * k * 0.4) + 0.2j * np.exp(2j * k * 0.25)
    found = cr.range_profile(f, k, window=window)
    size = np.abs(found.values)
    for where, amplitude in ((-0.4, 0.5), (0.25, 0.2j)):
        near = np.abs(found.range - where) < 0.05
        top = np.flatnonzero(near)[size[near].argmax()]
        # the side lobes of the other are below a hundredth, without a window a twentieth
        assert found.range[top] == pytest.approx(where, abs=np.pi / 300 / 8)
        at = np.interp(where, found.range, size)
        assert at == pytest.approx(abs(amplitude), rel=0.02 if window != "none" else 0.1)
    # half power: 0.886 and 1.44 widths of pi/(k_N - k_1)
    width = found.resolution / (np.pi / 301)
    assert width == pytest.approx({"none": 0.886, "hann": 1.44, "taylor": 1.2}[window], rel=0.05)


@pytest.mark.parametrize(
    "k, f",
    [
        (np.arange(1.0, 5.0), np.ones(4)),
        (np.geomspace(1, 2, 20), np.ones(20)),
        (np.linspace(2, 1, 20), np.ones(20)),
        (np.linspace(1, 2, 20), np.ones(19)),
        (np.linspace(1, 2, 20), np.full(20, np.nan)),
    ],
)
def test_no_band_has_no_profile(k, f):
    with pytest.raises(cr.InvalidInputError):
        cr.range_profile(f, k)


def test_comparison_finds_a_shift(rng):
    x = np.linspace(0, 90, 901)
    y = 10 * np.sin(np.radians(5 * x))
    at = np.sort(rng.uniform(10, 80, 60))
    found = cr.compare(x, y, at - 0.7, 10 * np.sin(np.radians(5 * at)) + 0.5, align=2.0, low=y - 1, high=y + 1)
    assert found.shift == pytest.approx(0.7, abs=0.03)
    assert found.mean == pytest.approx(-0.5, abs=0.02) and found.rms == pytest.approx(0.5, abs=0.02)
    assert found.within == 1.0 and found.austin == pytest.approx(0.5, abs=0.02)
    assert cr.compare(x, y, at, 10 * np.sin(np.radians(5 * at)) + 3, low=y - 1, high=y + 1).within == 0.0


def test_comparison_of_strangers():
    with pytest.raises(cr.InvalidInputError, match="no place"):
        cr.compare([0, 1], [0, 0], [5, 6], [0, 0])
    with pytest.raises(cr.InvalidInputError, match="ascending"):
        cr.compare([1, 0], [0, 0], [5, 6], [0, 0])


def test_alignment_keeps_the_overlap():
    x = np.linspace(0, 360, 3601)
    y = 5 * np.cos(np.radians(3 * x))
    found = cr.compare(x, y, x[10:3500:10] + 3, y[10:3500:10], align=90.0)
    assert found.shift == pytest.approx(-3, abs=0.5) and len(found.values) > 300
    # where all shifts are as good there is none
    assert cr.compare(x, 0 * x, x[100:200], np.zeros(100), align=5.0).shift == 0


def lobes(azimuth):
    """A cut without symmetry that repeats after a turn, dB."""
    at = np.radians(azimuth)
    return 6 * np.cos(at) + 3 * np.sin(2 * at) + np.cos(5 * at + 0.4)


@pytest.mark.parametrize(
    "ours", [np.linspace(-180, 180, 3601), -180 + np.arange(3600) / 10, np.linspace(720, 1080, 3601)]
)
@pytest.mark.parametrize("theirs", [np.arange(0, 360.5, 0.5), np.arange(-360, 361.0), np.array([-900.2, 179.97, 5e4])])
def test_azimuths_are_compared_modulo_a_turn(ours, theirs):
    """The same function of the angle on both sides: nothing is left over, whatever turn both are given in."""
    y = lobes(ours)
    found = cr.compare(ours, y, theirs, lobes(theirs), low=y - 0.1, high=y + 0.1, period=360.0)
    assert len(found.values) == len(theirs) and np.all(np.diff(found.values) >= 0)
    np.testing.assert_allclose(found.residual, 0, atol=1e-3)
    np.testing.assert_allclose(found.reference, lobes(found.values), atol=1e-9)
    assert found.within == 1.0 and found.summary()["wrapped"] == found.wrapped
    # a last place without the step to the first is within the turn, not beyond it
    last = ours[0] + 360
    assert found.wrapped == np.sum((theirs < ours[0]) | (theirs > last + 1e-9))


def test_a_turned_shift_and_a_part_of_a_turn():
    x = np.linspace(-90, 90, 1801)
    at = np.arange(0, 360.0)
    found = cr.compare(x, lobes(x), at, lobes(at + 1.5), align=3.0, period=360.0)
    assert found.shift == pytest.approx(1.5, abs=0.04) and found.rms < 0.02
    assert found.values.min() < -85 and found.wrapped == pytest.approx(90, abs=2)
    # the gap of half a turn is not bridged, nor is any without a period
    assert np.all(np.abs(found.values) <= 90)
    plain = cr.compare(x, lobes(x), at, lobes(at))
    assert plain.wrapped == 0 and plain.values.tolist() == list(range(91))
    for period in (0.0, -360.0, np.nan):
        with pytest.raises(cr.InvalidInputError, match="period"):
            cr.compare(x, lobes(x), at, lobes(at), period=period)
    with pytest.raises(cr.InvalidInputError, match="whole periods of 360"):
        cr.compare([0, 1], [0, 0], [5, 6], [0, 0], period=360.0)


def test_resolution_of_long_bands():
    for n in (100, 3000, 40_000):
        k = np.linspace(100.0, 200.0, n)
        assert cr.range_profile(np.ones(n), k, window="none").resolution == pytest.approx(0.0278, rel=0.01)


def test_one_failed_row_does_not_hide_the_others():
    echo = echo_of(0.5, 0.1)
    echo.total[0, 0, 0] = np.nan
    summary = echo.summary()
    assert summary["largest"]["VV"] == pytest.approx(4.971, abs=1e-3) and summary["not_finite"] == 1
