"""Pictures of echoes: which curve lies on top, in which order the legend lists them, what lies below the picture."""

from dataclasses import replace

import numpy as np
import pytest
from fake_fields import echo_of

from creeping.plotting import echo_pictures
from creeping.plotting.far_cuts import minus


@pytest.fixture
def drawn(monkeypatch):
    """Figures that would be written."""
    figures = []
    monkeypatch.setattr(echo_pictures, "save_figure", lambda figure, *_: figures.append(figure))
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
    echo_pictures.echo_cut_picture("a.png", two_channels(1.0))
    (figure,) = drawn
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert lines["VV"].get_zorder() > lines["HH"].get_zorder() and lines["VV"].get_linestyle() != "-"
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["HH", "VV"]


@pytest.mark.parametrize("over", ["angle", "frequency"])
def test_a_curve_below_the_picture_is_told_in_the_legend(drawn, over):
    echo = two_channels(1e-6)
    if over == "frequency":
        echo_pictures.echo_band_picture("a.png", several(echo))
    else:
        echo_pictures.echo_cut_picture("a.png", echo)
    first, second = (text.get_text() for text in drawn[0].legends[0].get_texts())
    low = drawn[0].axes[0].get_ylim()[0]
    assert first == "HH" and second == f"VV, below {minus(low)} dB"


def test_of_a_map_what_is_unresolved_has_a_veil(drawn):
    echo = several(two_channels(0.5))
    echo_pictures.echo_map_picture("a.png", echo)
    unresolved = echo.unresolved.copy()
    unresolved[1, 0, 1] = True
    echo_pictures.echo_map_picture("a.png", replace(echo, unresolved=unresolved))
    clear, veiled = drawn
    assert not clear.legends and veiled.legends[0].get_texts()[0].get_text() == "veiled: unresolved"
    shown = [int(np.ma.count(ax.collections[1].get_array())) for ax in veiled.axes if ax.get_title()]
    assert shown == [0, 1]


def test_rings_are_numbered_over_the_curves(drawn):
    echo_pictures.echo_cut_picture("a.png", two_channels(1.0), kind="polar")
    (ax,) = drawn[0].axes
    rings = [text for text in ax.texts if text.get_gid() == "ring"]
    assert rings and all(text.get_zorder() > line.get_zorder() for text in rings for line in ax.lines)
    assert not any("-" in text.get_text() for text in (*rings, *ax.get_xticklabels()))
