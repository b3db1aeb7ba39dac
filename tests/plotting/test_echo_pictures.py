"""Pictures of echoes: which curve lies on top, in which order the legend lists them, what lies below the picture."""

from dataclasses import replace

import numpy as np
import pytest
from fake_fields import echo_of

from creeping.field.results.impulse import range_profile
from creeping.plotting import echo_pictures, pages
from creeping.plotting.far_cuts import Curve, band_words, heights_of
from creeping.plotting.pages import curve_style, minus


@pytest.fixture
def drawn(monkeypatch):
    """Figures that would be written."""
    figures = []
    monkeypatch.setattr(pages, "save_figure", lambda figure, *_: figures.append(figure))
    return figures


def two_channels(second):
    """An echo of HH and VV, the second so many times the first."""
    one = echo_of(0.5, 0.01)
    both = {name: np.concatenate([v, second * v]) for name, v in one.parts.items()}
    twice = {name: np.concatenate([getattr(one, name)] * 2) for name in ("error", "unresolved", "by_currents")}
    total = np.concatenate([one.total, second * one.total])
    return replace(one, channels=("HH", "VV"), total=total, parts=both, **twice)


def several(echo):
    """The same at two wavenumbers."""
    parts = {name: np.repeat(v, 2, axis=2) for name, v in echo.parts.items()}
    flags = {
        name: np.repeat(getattr(echo, name), 2, axis=2) for name in ("total", "error", "unresolved", "by_currents")
    }
    return replace(echo, wavenumbers=np.array([20.0, 21.0]), parts=parts, **flags)


def test_of_equal_curves_the_broken_one_lies_on_top(drawn):
    echo_pictures.echo_picture("a.png", two_channels(1.0))
    (figure,) = drawn
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert lines["VV"].get_zorder() > lines["HH"].get_zorder() and lines["VV"].get_linestyle() != "-"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["HH", "VV", "stated error"]


@pytest.mark.parametrize("over", ["angle", "frequency"])
def test_a_curve_below_the_picture_is_told_in_the_legend(drawn, over):
    echo = two_channels(1e-6)
    if over == "frequency":
        one = several(echo)
        flags = {name: getattr(one, name)[:, :1] for name in ("total", "error", "unresolved", "by_currents")}
        parts = {name: values[:, :1] for name, values in one.parts.items()}
        echo = replace(one, azimuth=one.azimuth[:1], elevation=one.elevation[:1], parts=parts, **flags)
    echo_pictures.echo_picture("a.png", echo)
    first, second, band = (text.get_text() for text in drawn[0].legends[0].get_texts())
    low = drawn[0].axes[0].get_ylim()[0]
    assert first == "HH" and second == f"VV, below {minus(low)} dB"
    assert band == "stated error, in part beyond the axis"


def test_of_a_map_what_is_unresolved_has_a_veil(drawn):
    echo = several(two_channels(0.5))
    echo_pictures.echo_picture("a.png", echo)
    unresolved = echo.unresolved.copy()
    unresolved[1, 0, 1] = True
    echo_pictures.echo_picture("a.png", replace(echo, unresolved=unresolved))
    clear, veiled = drawn
    assert not clear.legends and veiled.legends[0].get_texts()[0].get_text() == "veiled: unresolved"
    shown = [int(np.ma.count(ax.collections[1].get_array())) for ax in veiled.axes if ax.get_title()]
    assert shown == [0, 1]


def test_rings_are_numbered_over_the_curves(drawn):
    echo_pictures.echo_picture("a.png", two_channels(1.0), kind="polar")
    (ax,) = drawn[0].axes
    rings = [text for text in ax.texts if text.get_gid() == "ring"]
    assert rings and all(text.get_zorder() > line.get_zorder() for text in rings for line in ax.lines)
    assert not any("-" in text.get_text() for text in (*rings, *ax.get_xticklabels()))


def test_an_axis_holds_curves_and_bands():
    levels = np.linspace(-12.0, -11.0, 50)
    curve = Curve("a", levels, curve_style(0), np.stack([levels - 0.5, levels + 0.3]))
    assert heights_of([curve], 60.0) == (-13.0, -10.0)
    assert band_words([curve], -13.0, -10.0) == "stated error"
    # a null within its error has a band down to nothing, which no axis holds
    null = replace(curve, band=np.stack([np.where(levels < -11.9, -np.inf, levels - 0.5), levels + 0.3]))
    assert heights_of([null], 60.0) == (-13.0, -10.0)
    assert band_words([null], -13.0, -10.0).endswith("in part beyond the axis")
    wide = replace(curve, band=np.stack([levels - 300.0, levels + 40.0]))
    assert heights_of([wide], 60.0) == (-65.0, 5.0)


def test_side_lobes_of_the_window_stand_under_the_profile(drawn):
    echo = two_channels(1.0)
    k = np.linspace(10.0, 20.0, 41)
    many = {name: np.repeat(getattr(echo, name)[:, :1], len(k), axis=2) for name in ("total", "error", "unresolved")}
    flags = {"by_currents": np.repeat(echo.by_currents[:, :1], len(k), axis=2), "parts": {}}
    band = replace(echo, wavenumbers=k, azimuth=echo.azimuth[:1], elevation=echo.elevation[:1], **many, **flags)
    profile = range_profile(np.ones(len(k)), k)
    echo_pictures.range_picture("a.png", {"HH": profile}, band, (-5.0, 5.0))
    (ax,) = drawn[0].axes
    (line,), (area,) = ax.lines, ax.collections
    # of one echo alone the profile is that of the window
    held = {(round(x, 9), round(y, 9)) for x, y in area.get_paths()[0].vertices}
    assert {(round(x, 9), round(y, 9)) for x, y in line.get_xydata()} <= held
    assert "radar" in ax.get_xlabel()
    echo_pictures.range_picture("a.png", {"soft": profile}, replace(band, quantity="ts"), (-5.0, 5.0))
    assert "sonar" in drawn[1].axes[0].get_xlabel() and "radar" not in drawn[1].axes[0].get_ylabel()
