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
from creeping._presenting import brief


class Table(HTMLParser):
    """Rows of the tables of a page, and every tag and attribute in it."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.tags, self.attributes, self.caption = {}, set(), set(), ""
        self._cells, self._at = [], ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        self._at = tag
        if tag in ("th", "td"):
            self._cells.append("")

    def handle_data(self, data):
        if self._at == "caption":
            self.caption += data
        elif self._at in ("th", "td"):
            self._cells[-1] += data

    def handle_endtag(self, tag):
        self._at = ""
        if tag == "tr":
            name, value = self._cells
            self.rows[name] = value
            self._cells = []


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


def test_reprs_are_three_lines_at_most(results):
    for result in results:
        lines = repr(result).splitlines()
        assert len(lines) <= 3
        assert max(map(len, lines)) <= 180
        assert lines[0].startswith(f"{type(result).__name__}(")


def test_reprs_say_what_is_wrong(twisted_fan, ball_cut):
    assert f"{int((twisted_fan.status == 1).sum())} DETACHED" in repr(twisted_fan)
    spoilt = far_of(ball_cut.directions, np.where(np.arange(len(ball_cut.total)) < 2, np.nan, 1.0))
    assert "0 unresolved, 2 not finite" in repr(spoilt)


def test_repr_of_a_body_is_one_line_and_cut():
    assert brief(Awkward()).startswith("<script>alert")
    assert brief("x" * 200, 20) == "'" + "x" * 16 + "..."
    assert len(repr(cr.DirectFlow(Awkward())).splitlines()) == 3


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


def test_showing_costs_nothing_until_asked():
    code = "import creeping, sys; assert not {'matplotlib', 'pyvista', 'numpy', 'creeping.plotting'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_table_takes_no_drawing_library():
    code = (
        "import sys, creeping as cr, scatterers as sc; cr.DirectFlow(sc.Sphere())._repr_html_();"
        "assert not {'matplotlib', 'pyvista', 'vtkmodules'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_tables_are_self_contained(results):
    for result in results:
        found = table(result)
        assert found.caption == type(result).__name__
        assert found.tags == {"table", "caption", "tbody", "tr", "th", "td"}
        assert found.attributes <= {"style", "scope"}
        assert len(found.rows) >= 5
        assert all(value.strip() for value in found.rows.values())


def test_table_of_a_torus_line(torus_fan):
    line = torus_fan.line
    rows = table(line).rows
    assert int(rows["curves"]) == 2
    assert int(rows["points"]) == 128
    assert first_number(rows["length"]) == pytest.approx(sum(curve.length for curve in line.curves), rel=1e-9)
    for name in ("attached", "occluded", "concave"):
        # points are equally spaced along a curve
        length = sum(np.sum(curve.status == name) * curve.length / 64 for curve in line.curves)
        assert first_number(rows[name]) == pytest.approx(length / line.length, abs=0.02)
    assert first_number(rows["curve 1"]) == pytest.approx(line.curves[1].length, rel=1e-9)


def test_table_of_a_line(twisted_fan):
    line = twisted_fan.line
    rows = table(line).rows
    # (1, 1, 1) leans from z by the angle of the cube's diagonal
    assert f"theta {np.degrees(np.arccos(1 / np.sqrt(3))):.6g}°" in rows["direction"]
    assert "phi 45°" in rows["direction"]
    assert f"about {np.degrees(line.singular_distance):.3g}°" in rows["singular distance"]


def test_table_of_a_fan(twisted_fan):
    rows = table(twisted_fan).rows
    assert int(rows["rays"]) == len(twisted_fan.points)
    counts = {
        status.name: np.bincount(twisted_fan.status, minlength=len(cr.RayStatus))[status] for status in cr.RayStatus
    }
    assert counts["DETACHED"] > 0
    for name, count in counts.items():
        assert first_number(rows.get(name, "0")) == count
    assert first_number(rows["first detachment"]) == pytest.approx(twisted_fan.detachment.min(), rel=1e-5)
    assert float(rows["error at the end"].split("max ")[1].split()[0]) == pytest.approx(twisted_fan.error.max, rel=0.06)


def test_table_of_a_curve(twisted_curves):
    rows = table(twisted_curves[0]).rows
    assert rows["level"] == "travel_time = 0.5"
    theta = np.degrees([min(twisted_curves[0].parameters[:, 0]), max(twisted_curves[0].parameters[:, 0])])
    assert rows["theta"] == "{:.6g} to {:.6g} degrees".format(*theta)


def test_length_of_a_circle(ball_fan):
    (circle,) = cr.iso_phase_curves(ball_fan, 0.5)
    count = len(circle.points)
    # equal chords of a circle of radius cos 0.5
    assert circle.closed and count >= 32
    assert circle.length == pytest.approx(2 * count * np.cos(0.5) * np.sin(np.pi / count), rel=1e-9)


def test_table_of_a_far_field(ball_cut):
    rows = table(ball_cut).rows
    assert int(rows["directions"]) == 45
    assert rows["theta"] == "0 to 180 degrees"
    largest = ball_cut.cross_section.max()
    assert first_number(rows["largest 4π|f|²"]) == pytest.approx(10 * np.log10(largest), abs=0.006)
    assert sum(int(v.split()[0]) for name, v in rows.items() if name.startswith("served")) == 45
    assert int(first_number(rows["unresolved"])) == ball_cut.unresolved.sum()


def test_table_of_a_map(small_map):
    rows = table(small_map).rows
    assert first_number(rows["horizon T0"]) == 0.5
    assert [int(n) for n in rows["nodes"].split(" x ")][1:] == list(small_map.grid.nodes)
    last = small_map.growth.lengths[-1]
    assert f"rms {small_map.growth.rms[-1]:.1e}" in rows[f"error after {last:g}"]
    assert rows["method"] == repr(small_map.parameters["method"])


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


def test_pictures_leave_pyplot_alone(results):
    from matplotlib import pyplot

    before = pyplot.get_fignums()
    for result in results[:-1]:
        result.plot()
    assert pyplot.get_fignums() == before


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
