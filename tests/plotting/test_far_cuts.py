"""Cuts of the far field: which curves, how high, and what is refused."""

from types import SimpleNamespace

import numpy as np
import pytest

from creeping import InvalidInputError
from creeping.field.results.comparison import decibels, shown_range
from creeping.plotting import far_cut_picture
from creeping.plotting.far_cuts import cut_curves

ANGLES = np.radians(np.arange(-180.0, 181.0, 5.0))


@pytest.fixture
def lobe():
    """A FarField-like of a lobe at 0 with nulls, no forward part."""
    creeping = np.cos(4 * ANGLES) * np.exp(1j * ANGLES) / (0.1 + np.abs(ANGLES))
    parts = {"creeping": creeping, "reflected": 0.1 * creeping, "forward": np.zeros_like(creeping)}
    return SimpleNamespace(parts=parts, total=1.1 * creeping, wavenumber=20.0, boundary="hard")


@pytest.fixture
def vector():
    values = np.arange(1, 5).reshape(2, 2) * np.ones((len(ANGLES), 1, 1)) * 1j
    return SimpleNamespace(parts={"creeping": values, "reflected": 0 * values}, total=values, boundary="pec")


@pytest.mark.parametrize(("kind", "quantity"), [("cartesian", "amplitude"), ("polar", "rcs")])
def test_picture_is_drawn(tmp_path, lobe, kind, quantity):
    from matplotlib.image import imread

    path = tmp_path / "cut.png"
    fields = {"ours": lobe, "other": 0.5 * lobe.total}
    far_cut_picture(path, ANGLES, fields, kind=kind, quantity=quantity, exact=lobe.total, parts=True, dpi=50)
    assert imread(path)[..., :3].std() > 0.03
    assert list(tmp_path.iterdir()) == [path]


def test_curves_are_the_levels_of_total_and_parts(lobe):
    curves = cut_curves(len(ANGLES), {"ours": lobe}, exact=lobe.total, parts=True)
    # the forward part vanishes and has no curve
    assert [curve.label for curve in curves] == ["ours", "ours, creeping", "ours, reflected", "exact"]
    np.testing.assert_allclose(curves[0].levels, 20 * np.log10(np.abs(lobe.total)))
    np.testing.assert_allclose(curves[1].levels - curves[2].levels, 20)
    lobe.total[3] = np.inf
    assert np.isnan(cut_curves(len(ANGLES), {"ours": lobe})[0].levels[3])


def test_curves_of_a_vector_field_are_its_components(vector):
    curves = cut_curves(len(ANGLES), {"pec": vector}, components=("tt", "tp", "pp"))
    assert [curve.label for curve in curves] == ["pec θθ (VV)", "pec θφ (VH)", "pec φφ (HH)"]
    np.testing.assert_allclose([curve.levels[7] for curve in curves], 20 * np.log10([1, 2, 4]))


def test_range_ignores_nulls_and_poles():
    levels = decibels([0.0, 1e-9, 0.2, 9.0, np.inf])
    assert shown_range([levels], 40.0) == (-20.0, 20.0)
    assert shown_range([np.array([3.0, 4.0])], 40.0) == (0.0, 5.0)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"kind": "radar"}, "kind 'radar' is unknown"),
        ({"quantity": "power"}, "quantity 'power' is unknown"),
        ({"components": ("xx",)}, "are not among tt, tp, pt, pp"),
        ({"span": -1.0}, "span = -1.0 dB"),
        ({"exact": np.ones(3, dtype=complex)}, r"field 'exact' has shape \(3,\); 73 angles"),
        ({"fields": {}}, "no field to draw"),
        ({"fields": {"a": np.zeros(73, dtype=complex)}}, "none of 73 values can be drawn"),
        ({"angles": [1.0, np.nan]}, "two or more finite"),
    ],
)
def test_bad_input_is_refused(tmp_path, lobe, change, match):
    arguments = {"angles": ANGLES, "fields": {"ours": lobe}, **change}
    with pytest.raises(InvalidInputError, match=match):
        far_cut_picture(tmp_path / "a.png", **arguments)
    assert not list(tmp_path.iterdir())
