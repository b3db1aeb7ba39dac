"""Wavenumbers from frequencies and wavelengths."""

import numpy as np
import pytest

import creeping as cr
from creeping.field.frequency import frequency


@pytest.mark.parametrize(
    "text, expected",
    [
        ("10 GHz", 209.58450219516817),
        ("10GHz", 209.58450219516817),
        ("1e10", 209.58450219516817),
        ("10000 MHz", 209.58450219516817),
        ("3 cm", 2 * np.pi / 0.03),
        ("30mm", 2 * np.pi / 0.03),
        (".3 m", 2 * np.pi / 0.3),
    ],
)
def test_texts(text, expected):
    assert cr.wavenumber(text) == pytest.approx(expected, rel=1e-12)


def test_ranges_keep_their_last_value():
    k = cr.wavenumber("2:18:0.05GHz")
    assert len(k) == 321
    np.testing.assert_allclose(frequency(k) / 1e9, 2 + 0.05 * np.arange(321), rtol=1e-12)
    # wavelengths ascend, so wavenumbers fall
    assert np.all(np.diff(cr.wavenumber("1:3:1cm")) < 0)


def test_each_number_of_a_range_may_have_its_unit():
    whole = cr.wavenumber("2:4:0.5GHz")
    np.testing.assert_array_equal(cr.wavenumber("2GHz:4GHz:0.5GHz"), whole)
    np.testing.assert_allclose(cr.wavenumber("2 GHz : 4 GHz : 500 MHz"), whole, rtol=1e-14)
    np.testing.assert_allclose(cr.wavenumber("2000 MHz:4:0.5 GHz"), whole, rtol=1e-14)
    np.testing.assert_allclose(cr.wavenumber("1cm:3cm:10mm"), 2 * np.pi / np.array([0.01, 0.02, 0.03]), rtol=1e-14)
    with pytest.raises(cr.InvalidInputError, match="mixes units"):
        cr.wavenumber("1cm:2cm:1GHz")
    with pytest.raises(cr.InvalidInputError, match="unknown unit 'parsec'"):
        cr.wavenumber("1parsec:2:1GHz")


def test_sound():
    assert cr.wavenumber(38e3, sound_speed=1477) == pytest.approx(2 * np.pi * 38e3 / 1477)
    assert cr.wavenumber("38kHz", sound_speed=1477) == pytest.approx(2 * np.pi * 38e3 / 1477)
    np.testing.assert_allclose(frequency(cr.wavenumber([1e3, 2e3], sound_speed=340.0), sound_speed=340.0), [1e3, 2e3])


TEXTS = ["ten GHz", "10 parsec", "10 MM", "", "0 GHz", "-1 GHz", "2:18GHz", "18:2:1GHz", "1:2:0GHz", "1:1e9:1e-9Hz"]


@pytest.mark.parametrize("bad", [*TEXTS, "nan GHz", "1e999 Hz", True, None, np.nan, -1.0, [1.0, 0.0], 1j, ["1 GHz"]])
def test_what_is_none(bad):
    with pytest.raises(cr.InvalidInputError):
        cr.wavenumber(bad)
    if bad is not None:
        with pytest.raises(cr.InvalidInputError):
            cr.wavenumber(1e9, sound_speed=bad)
