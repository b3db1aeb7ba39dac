"""Colours and line styles that the colour-blind tell apart, held by numbers."""

from itertools import combinations

import numpy as np
import pytest
from colour_vision import EYES, contrast, difference, lab, of_hexadecimal, seen

from creeping.plotting import pages
from creeping.plotting._strokes import RAY_COLOUR, STATUS_COLOURS
from creeping.plotting.far_cuts import cut_curves

GROUPS = {
    "curves": pages.COLOURS,
    "curves of the page": ("#111111", *pages.COLOURS[:2]),
    "shadow line": tuple(STATUS_COLOURS.values()),
    "shadow line and rays": (RAY_COLOUR, *list(STATUS_COLOURS.values())[1:]),
}


@pytest.mark.parametrize(
    "one, other, found",
    [  # Sharma, Wu and Dalal 2005, table 1
        ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
        ((50, 2.5, 0), (73, 25, -18), 27.1492),
        ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
    ],
)
def test_the_measure_is_that_of_its_table(one, other, found):
    assert difference(np.array(one, float), np.array(other, float)) == pytest.approx(found, abs=1e-4)


@pytest.mark.parametrize("eye", EYES)
@pytest.mark.parametrize("group", GROUPS)
def test_any_two_colours_of_a_picture_differ(group, eye):
    colours = GROUPS[group]
    values = lab(seen(of_hexadecimal(colours), eye))
    apart = {
        (colours[i], colours[j]): difference(values[i], values[j]) for i, j in combinations(range(len(colours)), 2)
    }
    assert min(apart.values()) > 12, min(apart, key=apart.get)


def test_curves_stand_out_from_white():
    assert min(map(contrast, pages.COLOURS)) >= 3.0


def test_curves_of_a_picture_have_styles_of_their_own():
    values = np.ones((4, 2, 2), dtype=complex)
    curves = cut_curves(4, {"a": values, "b": values}, components=("tt", "pp"))
    looks = [(c.style["color"], str(c.style["linestyle"])) for c in curves]
    assert len({colour for colour, _ in looks}) == len({style for _, style in looks}) == 4
    assert looks[0][1] == "-"
