"""Results show themselves: reprs and tables hold the numbers of the object, found by another route."""

import pickle
import subprocess
import sys
import weakref
from dataclasses import FrozenInstanceError, fields, replace
from html.parser import HTMLParser

import numpy as np
import pytest
import shared_bodies as sc
from fake_fields import HOSTILE, Awkward, far_of

import creeping as cr


class Table(HTMLParser):
    """Rows of a table, and every tag and attribute in it."""

    def __init__(self, text):
        super().__init__()
        self.words, self.tags, self.attributes = [], set(), set()
        self.feed(text)
        self.caption, *words = self.words
        self.rows = dict(zip(words[::2], words[1::2], strict=True))

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        if tag in ("caption", "th", "td"):
            self.words.append("")

    def handle_data(self, data):
        if self.words:
            self.words[-1] += data.strip("\n")


def table(result):
    return Table(result._repr_html_())


def first_number(text):
    return float(text.split()[0])


@pytest.fixture(scope="module")
def results(twisted_fan, twisted_curves, ball_cut, small_map):
    return [
        twisted_fan.line,
        twisted_fan.line.curves[0],
        twisted_fan,
        twisted_curves[0],
        ball_cut,
        small_map,
        cr.DirectFlow(sc.Sphere()),
    ]


def test_reprs_are_short_and_tables_self_contained(results):
    for result in results:
        lines = repr(result).splitlines()
        assert len(lines) <= 3 and max(map(len, lines)) <= 180
        assert lines[0].startswith(f"{type(result).__name__}(")
        found = table(result)
        assert found.caption == type(result).__name__
        assert found.tags == {"table", "caption", "tbody", "tr", "th", "td"}
        assert found.attributes <= {"style", "scope"}
        assert len(found.rows) >= 5 and all(value.strip() for value in found.rows.values())


def test_results_stay_frozen_picklable_and_weakly_referable(results):
    for result in results:
        with pytest.raises(FrozenInstanceError):
            setattr(result, fields(result)[0].name, None)
        assert weakref.ref(result)() is result
        hash(result)
        if isinstance(result, cr.PhaseMap):
            # its model holds compiled parts; maps are saved in folders
            continue
        again = pickle.loads(pickle.dumps(result))
        assert repr(again) == repr(result)
        assert again._repr_html_() == result._repr_html_()


def test_a_table_takes_no_drawing_library():
    code = (
        "import sys, creeping as cr, scatterers as sc; cr.DirectFlow(sc.Sphere())._repr_html_();"
        "assert not {'matplotlib', 'pyvista', 'vtkmodules'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_table_of_a_line(torus_fan, twisted_fan):
    line = torus_fan.line
    rows = table(line).rows
    assert (int(rows["curves"]), int(rows["points"])) == (2, 128)
    assert first_number(rows["length"]) == pytest.approx(sum(curve.length for curve in line.curves), rel=1e-9)
    for name in ("attached", "occluded", "concave"):
        # points are equally spaced along a curve
        length = sum(np.sum(curve.status == name) * curve.length / 64 for curve in line.curves)
        assert first_number(rows[name]) == pytest.approx(length / line.length, abs=0.02)
    line = twisted_fan.line
    rows = table(line).rows
    # (1, 1, 1) leans from z by the angle of the cube's diagonal
    assert f"theta {np.degrees(np.arccos(1 / np.sqrt(3))):.6g}°" in rows["direction"]
    assert "phi 45°" in rows["direction"]
    assert f"about {np.degrees(line.singular_distance):.3g}°" in rows["singular distance"]


def test_table_of_a_fan(twisted_fan):
    rows = table(twisted_fan).rows
    assert int(rows["rays"]) == len(twisted_fan.points)
    assert f"{int((twisted_fan.status == 1).sum())} DETACHED" in repr(twisted_fan)
    for status in cr.RayStatus:
        assert first_number(rows.get(status.name, "0")) == np.sum(twisted_fan.status == status)
    assert first_number(rows["first detachment"]) == pytest.approx(twisted_fan.detachment.min(), rel=1e-5)
    assert float(rows["error at the end"].split("max ")[1].split()[0]) == pytest.approx(twisted_fan.error.max, rel=0.06)


def test_table_of_a_far_field(ball_cut):
    rows = table(ball_cut).rows
    assert int(rows["directions"]) == 45
    assert rows["theta"] == "0 to 180 degrees"
    largest = ball_cut.cross_section.max()
    assert first_number(rows["largest 4π|f|²"]) == pytest.approx(10 * np.log10(largest), abs=0.006)
    assert sum(int(v.split()[0]) for name, v in rows.items() if name.startswith("served")) == 45
    assert int(first_number(rows["unresolved"])) == ball_cut.unresolved.sum()


def test_tables_of_a_curve_and_of_a_map(twisted_curves, small_map):
    rows = table(twisted_curves[0]).rows
    theta = np.degrees([min(twisted_curves[0].parameters[:, 0]), max(twisted_curves[0].parameters[:, 0])])
    assert rows["level"] == "travel_time = 0.5" and rows["theta"] == "{:.6g} to {:.6g} degrees".format(*theta)
    rows, growth = table(small_map).rows, small_map.growth
    assert first_number(rows["horizon T0"]) == 0.5
    assert f"rms {growth.rms[-1]:.1e}" in rows[f"error after {growth.lengths[-1]:g}"]


def test_hostile_names_are_escaped(twisted_fan, twisted_curves, ball_cut, small_map):
    body = Awkward()
    flow = cr.DirectFlow(body)
    shown = [
        flow,
        replace(twisted_fan, body=body),
        replace(twisted_fan.line, body=body),
        replace(twisted_curves[0], of=HOSTILE),
        replace(ball_cut, boundary=HOSTILE, method=np.full(len(ball_cut.method), HOSTILE)),
        replace(small_map, body=body, parameters={HOSTILE: HOSTILE}),
    ]
    for result in shown:
        found = table(result)
        assert "script" not in found.tags
        assert any(HOSTILE[:8] in name + value for name, value in found.rows.items())
    # nor are they formulas
    replace(ball_cut, boundary=HOSTILE).plot().figure.draw_without_rendering()
    replace(small_map, body=body).plot().figure.draw_without_rendering()


def test_a_map_that_was_not_measured_says_so(small_map):
    blank = replace(small_map, growth=None, error=cr.ErrorEstimate(np.nan, np.nan, 0))
    assert "not measured" in repr(blank)
    assert table(blank).rows["error of one g_T0"] == "not measured"
    with pytest.raises(cr.InvalidInputError, match="not been measured"):
        blank.plot()


def test_a_line_that_launches_nothing_is_shown(dark_fan):
    assert dark_fan.points.shape[0] == 0
    assert "no rays" in repr(dark_fan) and "not measured" in repr(dark_fan)
    for result in (dark_fan, dark_fan.line):
        assert table(result).caption == type(result).__name__
        assert "shadow line, concave" in [one.get_label() for one in result.plot().collections]
        result.plot(kind="3d")
    assert table(dark_fan).rows["rays"] == "0"
    assert table(dark_fan.line).rows["concave"].startswith("1 of the length")


def test_a_line_without_curves_and_a_field_without_directions(twisted_fan):
    bare = replace(twisted_fan.line, curves=())
    assert len(repr(bare).splitlines()) == 3
    assert table(bare).rows["curves"] == "0"
    far = far_of(np.zeros((0, 3)), np.zeros(0))
    assert table(far).rows["directions"] == "0"
    with pytest.raises(cr.InvalidInputError, match="0 directions make no cut"):
        far.plot()
