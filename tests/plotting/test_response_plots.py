"""Pictures and tables of responses, couplings, patterns of sources and echoes: levels, limits, what is in doubt."""

from dataclasses import replace

import numpy as np
import pytest
import shared_bodies as sc
from fake_fields import echo_of

import creeping as cr
from creeping.errors import InvalidInputError


@pytest.fixture(scope="module")
def two_paths():
    k = np.linspace(20.0, 60.0, 81)
    return cr.impulse_response(np.exp(3j * k) + 0.1 * np.exp(5j * k), k, error=np.full(81, 1e-3), start=0.0)


@pytest.fixture(scope="module")
def ports():
    return cr.coupling(sc.Sphere(), [(0, 0, 1), (1, 0, 0), (0, 0.6, -0.8)], wavenumber=30.0)


@pytest.fixture(scope="module")
def pattern():
    flow = cr.DirectFlow(sc.Sphere(), rtol=1e-8)
    around = np.radians(np.arange(30.0, 151.0, 30.0))
    directions = np.stack([np.sin(around), 0 * around, np.cos(around)], axis=1)
    return cr.source_pattern(flow, [(0, 0, 1), (1.5, 0, 0)], directions, wavenumber=20.0)


def test_a_response_has_its_paths_at_their_delays(two_paths):
    ax = two_paths.plot(start=1.0, end=8.0)
    line = next(one for one in ax.lines if one.get_label() == "envelope")
    x, y = line.get_data()
    for delay, level in ((3.0, 0.0), (5.0, -20.0)):
        near = np.abs(x - delay) < 0.2
        assert y[near].max() == pytest.approx(level, abs=0.1)
    assert ax.get_xlim() == (1.0, 8.0) and "(L)" in ax.get_xlabel()
    bound = next(one for one in ax.lines if one.get_label() == "error at most")
    assert bound.get_ydata()[0] == pytest.approx(-60.0)
    # seconds in a unit that suits
    k = np.linspace(200.0, 400.0, 101)
    ax = cr.impulse_response(np.exp(0.3j * k), k, speed=3e8, start=0.0).plot()
    x, y = ax.lines[0].get_data()
    assert "(ns)" in ax.get_xlabel() and x[np.argmax(y)] == pytest.approx(1.0, abs=0.1)


def test_what_cannot_be_drawn_is_refused(two_paths):
    with pytest.raises(InvalidInputError, match="nothing lies between start = 9 and end = 8"):
        two_paths.plot(start=9.0, end=8.0)
    many = replace(two_paths, values=np.ones((len(two_paths.delay), 7)), error=np.zeros(7))
    with pytest.raises(InvalidInputError, match="7 responses"):
        many.plot()
    echo = echo_of(1.0, 0.1)
    with pytest.raises(InvalidInputError, match="channel 'HH' is not among VV"):
        echo.plot(channel="HH")


def test_a_range_profile_has_its_echo_at_its_range():
    k = np.linspace(100.0, 200.0, 201)
    found = cr.range_profile(0.5 * np.exp(2j * k * -1.5), k)
    ax = found.plot(unit="m", start=-3.0, end=1.0)
    x, y = ax.lines[0].get_data()
    assert x[np.argmax(y)] == pytest.approx(-1.5, abs=0.05) and y.max() == pytest.approx(20 * np.log10(0.5), abs=0.05)
    assert "(m)" in ax.get_xlabel() and "re 1 m" in ax.get_ylabel()
    assert repr(found).startswith("RangeProfile(") and "array" not in repr(found)
    assert "resolution" in found._repr_html_() and "radar cross section" in echo_of(1.0, 0.1)._repr_html_()


def test_tables_of_notebooks_say_what_they_are(two_paths, ports, pattern):
    for result in (two_paths, ports, pattern):
        table = result._repr_html_()
        assert type(result).__name__ in table and "array" not in table and "nan" not in table


def test_a_coupling_matrix_shows_its_levels(ports):
    ax = ports.plot()
    shown = ax.images[0].get_array()
    off = ~np.eye(3, dtype=bool)
    np.testing.assert_allclose(shown[off], 20 * np.log10(np.abs(ports.values[off])))
    assert np.all(np.ma.getmaskarray(shown)[~off] | np.isnan(np.asarray(shown)[~off]))
    marks = ax.get_legend_handles_labels()[1]
    assert ("not OK" in marks) == bool(np.any(~ports.ok[off]))


def test_patterns_of_sources_have_a_curve_each(pattern):
    ax = pattern.plot()
    curves = [line for line in ax.lines if line.get_label().startswith("source at")]
    assert len(curves) == 2 and "re no body" in ax.get_ylabel()
    first = next(line for line in curves if "(0, 0, 1)" in line.get_label())
    np.testing.assert_allclose(first.get_ydata(), pattern.decibels[:, 0])


def test_an_echo_draws_what_varies():
    echo = echo_of(0.5j, 0.05)
    ax = echo.plot()
    np.testing.assert_allclose(ax.lines[0].get_ydata(), 10 * np.log10(np.pi))
    wide = {name: np.repeat(values, 3, axis=2) for name, values in echo.parts.items()}
    flags = np.zeros((1, 2, 3), dtype=bool)
    both = replace(
        echo,
        wavenumbers=np.array([10.0, 20.0, 30.0]),
        total=np.repeat(echo.total, 3, axis=2),
        parts=wide,
        error=np.repeat(echo.error, 3, axis=2),
        unresolved=flags,
        by_currents=flags,
    )
    assert both.plot().collections
    ds = both.to_xarray()
    assert ds["level"].attrs["units"] == "dBsm" and ds["total"].dims == ("channel", "angle", "frequency")
    np.testing.assert_allclose(ds["level"], 10 * np.log10(np.pi))
    assert len(both.to_dataframe()) == 6
