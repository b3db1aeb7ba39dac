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
    """Rows of a table, the text above it, and every tag and attribute in it."""

    def __init__(self, text):
        super().__init__()
        self.words, self.tags, self.attributes = [], set(), set()
        self.feed(text)
        self.text, *words = self.words
        self.rows = dict(zip(words[::2], words[1::2], strict=True))

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        if tag in ("pre", "th", "td"):
            self.words.append("")

    def handle_data(self, data):
        if self.words:
            self.words[-1] += data


def table(result):
    return Table(result._repr_html_())


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
        assert found.text == repr(result)
        assert found.tags == {"pre", "table", "tbody", "tr", "th", "td"}
        assert found.attributes <= {"style", "scope"}
        assert set(found.rows) == {one.name for one in fields(result) if not one.name.startswith("_")}
        assert all(value.strip() for value in found.rows.values())


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


def test_the_text_of_a_line(torus_fan, twisted_fan):
    line = torus_fan.line
    assert "ShadowLine(2 curves, 128 points" in repr(line)
    shares = dict(reversed(part.split()) for part in repr(line).splitlines()[1].strip().split("; ")[0].split(", "))
    for name, share in shares.items():
        # points are equally spaced along a curve
        length = sum(np.sum(curve.status == name) * curve.length / 64 for curve in line.curves)
        assert float(share) == pytest.approx(length / line.length, abs=0.02)
    assert f"singular distance {twisted_fan.line.singular_distance:.3g}" in repr(twisted_fan.line)


def test_the_text_of_a_fan(twisted_fan):
    assert f"{int((twisted_fan.status == 1).sum())} DETACHED" in repr(twisted_fan)
    for status in cr.RayStatus:
        count = int(np.sum(twisted_fan.status == status))
        assert (f"{count} {status.name}" in repr(twisted_fan)) == (count > 0)
    assert float(repr(twisted_fan).split("max ")[1].split()[0]) == pytest.approx(twisted_fan.error.max, rel=0.06)


def test_the_table_holds_shapes_ranges_and_counts(ball_cut, small_map):
    rows = table(ball_cut).rows
    assert rows["directions"].startswith("45 x 3, ")
    assert rows["total"] == f"45 complex, size up to {np.abs(ball_cut.total).max():.6g}"
    assert sum(int(part.rstrip(")").split(" (")[1]) for part in rows["method"].split(", ")) == 45
    assert f"False ({np.sum(~ball_cut.unresolved)})" in rows["unresolved"]
    assert set(part.split(":")[0] for part in rows["parts"].split("; ")) == set(ball_cut.parts)
    growth = small_map.growth
    assert "T0 = 0.5" in repr(small_map)
    assert f"after {growth.lengths[-1]:g}: rms {growth.rms[-1]:.1e}" in repr(small_map)


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
        assert HOSTILE[:8] in found.text or any(HOSTILE[:8] in value for value in found.rows.values())
    # nor are they formulas
    replace(ball_cut, boundary=HOSTILE).plot().figure.draw_without_rendering()
    replace(small_map, body=body).plot().figure.draw_without_rendering()


def test_a_map_that_was_not_measured_says_so(small_map):
    blank = replace(small_map, growth=None, error=cr.ErrorEstimate(np.nan, np.nan, 0))
    assert "not measured" in repr(blank)
    with pytest.raises(cr.InvalidInputError, match="not been measured"):
        blank.plot()


def test_a_line_that_launches_nothing_is_shown(dark_fan):
    assert dark_fan.points.shape[0] == 0
    assert "no rays" in repr(dark_fan) and "not measured" in repr(dark_fan)
    for result in (dark_fan, dark_fan.line):
        assert table(result).text == repr(result)
        assert "shadow line, concave" in [one.get_label() for one in result.plot().collections]
        result.plot(kind="3d")
    assert "RayFan(0 rays" in repr(dark_fan) and "1 concave" in repr(dark_fan.line)


def test_a_line_without_curves_and_a_field_without_directions(twisted_fan):
    bare = replace(twisted_fan.line, curves=())
    assert len(repr(bare).splitlines()) == 3
    assert table(bare).text.startswith("ShadowLine(0 curves")
    far = far_of(np.zeros((0, 3)), np.zeros(0))
    assert table(far).rows["directions"] == "0 x 3"
    with pytest.raises(cr.InvalidInputError, match="0 directions make no cut"):
        far.plot()
