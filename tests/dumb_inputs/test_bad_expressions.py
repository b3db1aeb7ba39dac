"""Expressions that are no body: each its own ValueError with what is wrong and what to do; nothing is executed."""

import builtins
import os

import numpy as np
import pytest

from scatterers.implicit import Implicit

SPHERE = "x**2 + y**2 + z**2 - 1"
ALLOWED = "allowed are numbers, x, y, z, pi"

HOSTILE = {
    "import": "__import__('os').system('touch {file}')",
    "attributes of a class": "().__class__.__bases__[0].__subclasses__()",
    "comprehension": "[open('{file}', 'w') for x in (1, 2)]",
    "lambda": "(lambda: open('{file}', 'w'))()",
    "two arguments": "log(x, 2)",
    "function without a call": "sin + x",
    "huge power": "x**65",
    "power of a variable": "2**x",
    "complex root": "sqrt(-1) + x",
    "long sum": "+".join(["x"] * 900),
    "comparison with a complex number": "where(sqrt(-1) < x, x, y)",
    "nested calls": "sin(" * 130 + "x" + ")" * 130,
}
NOT_VALID = {
    "statement": "x = y = 1",
    "deep brackets": "(" * 500 + "x" + ")" * 500,
    "caret in words": "x squared",
}
NO_TEXT = {"empty": "", "blank": "  \n", "number": 3, "array": np.ones(3)}


@pytest.mark.parametrize("which", HOSTILE)
def test_hostile_text_is_refused_and_not_executed(which, tmp_path, monkeypatch):
    file = tmp_path / "executed"
    called = []
    monkeypatch.setattr(os, "system", called.append)
    monkeypatch.setattr(builtins, "eval", lambda *a: called.append(a))
    text = HOSTILE[which].format(file=file) if "{" in HOSTILE[which] else HOSTILE[which]
    with pytest.raises(ValueError, match=ALLOWED):
        Implicit(text)
    assert not file.exists() and not called


@pytest.mark.parametrize("which", NOT_VALID)
def test_text_that_is_no_expression(which):
    with pytest.raises(ValueError, match="is not valid"):
        Implicit(NOT_VALID[which])


@pytest.mark.parametrize("which", NO_TEXT)
def test_nothing_to_parse(which):
    with pytest.raises(ValueError, match="write one in x, y, z such as"):
        Implicit(NO_TEXT[which])


def test_long_text():
    with pytest.raises(ValueError, match="3999 characters, more than 2000") as caught:
        Implicit("+".join(["x"] * 2000))
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize(
    "text, match",
    [
        ("sin(" * 110 + "x" + ")" * 110 + f" + {SPHERE}", "derivatives of .* about 7.... operations, more than 20000"),
        ("x*sin(y*" * 55 + "z" + ")" * 55 + f" + {SPHERE}", "operations, more than|nested too deeply"),
        ("*".join(["999999999999"] * 120) + f"*({SPHERE})", r"a number beyond 1e\+300"),
        ("((((x*999999999999)**64)**64)**64)**64", r"a number beyond 1e\+300"),
    ],
)
def test_what_would_take_long_or_cannot_be_held(text, match):
    with pytest.raises(ValueError, match=match):
        Implicit(text)


def test_absolute_values_have_no_second_derivative():
    with pytest.raises(ValueError, match=r"\|.*\|.*smooth"):
        Implicit("sqrt(x**2) + sqrt(y**2) + z**2 - 1")


NO_BODY = {
    "nowhere negative": ("x**2 + y**2 + z**2 + 1", None, "no body"),
    "everywhere negative": ("-1", None, "sign turned"),
    "inverted": ("1 - x**2 - y**2 - z**2", None, "sign turned"),
    "plane": ("x + y + z", None, "open"),
    "cylinder": ("x**2 + y**2 - 1", None, "unbounded"),
    "lattice": ("sin(x)*cos(y) + sin(y)*cos(z) + sin(z)*cos(x)", None, "unbounded"),
    "two": (
        "((x-2)**2+y**2+z**2-1)*((x+2)**2+y**2+z**2-1)",
        None,
        r"2 bodies \(3444 grid points about .*; give bounds around one",
    ),
    "a second one farther off": (
        "((x-.2)**2+y**2+z**2-1)*((x-9)**2+y**2+z**2-4)",
        None,
        "again beyond it: several bodies or an unbounded one; give bounds",
    ),
    "too far off": ("(x-1000)**2 + y**2 + z**2 - 1e-4", None, "too small or too far off; give bounds"),
    "cavity": ("(x**2+y**2+z**2-4)*(x**2+y**2+z**2-1)", None, "cavity inside the body; .* give F of the outer wall"),
    "not finite": ("log(x**2+y**2+z**2-.5)", None, r"not finite at \d+ of \d+ points .*without poles and roots"),
    "root of a negative number": ("sqrt(x) + y**2 + z**2 - 1", None, "not finite at"),
    "vanishing gradient": ("(x**2+y**2+z**2-1)**3", None, r"not smooth: grad F = 0 at .* of its points, first \("),
    "cusp": ("x**2+y**2-z**3*(1-z)", None, r"not smooth: grad F = 0 at 1 of its points, .* a cusp or a crossing"),
    "torus that touches itself": ("(sqrt(x**2+y**2) - 1)**2 + z**2 - 1", None, "F = 0 is not smooth: its"),
    "pole": ("x**2+y**2+z**2-1 + 1e-9/x", None, "an edge or a pole of F there"),
    "sheets that cross": ("((x**2+y**2)**2-x**2+y**2)**2+z**2-.0625", None, r"grad F = 0 at \d of its points"),
}


@pytest.mark.parametrize("which", NO_BODY)
def test_expressions_that_are_no_body(which):
    text, bounds, match = NO_BODY[which]
    with np.errstate(all="ignore"), pytest.raises(ValueError, match=match):
        Implicit(text, bounds)


@pytest.mark.parametrize(
    "text, match",
    [
        ("(x**2+y**2+z**2-1)**3", "grad F = 0 at .* more than the 8 tips .* write it otherwise"),
        ("sqrt(x**2+y**2) - (1-z**2)/2", r"it has 2 tips, first .* leave strict out to take them"),
        ("where(z < 0, z**2/2, z**3 - z**2) + x**2 + y**2", r"it has 1 tips, first \(0.0, 0.0, 0.0\)"),
        ("(sqrt(x**2+y**2) - .5)**2 + z**2 - 1", r"it has 2 tips, first \(.*0.866"),
        ("max(x**2 + y**2 + z**2 - 1, z - 0.3)", r"its normal jumps by up to \d+ degrees near .*round them off"),
    ],
)
def test_what_is_refused_as_strict(text, match):
    with pytest.raises(ValueError, match=match):
        Implicit(text, strict=True)


BAD_BOUNDS = {
    "NaN": ([[np.nan] * 3, [2] * 3], "no array of"),
    "shape": ([[-2, -2], [2, 2]], "no array of"),
    "text": ("all", "not numbers"),
    "cuts the body": ([[-0.5, -2, -2], [2, 2, 2]], "cut there; give wider bounds"),
    "beside the body": ([[3] * 3, [5] * 3], "nowhere negative at .* points of the bounds: no body"),
}


@pytest.mark.parametrize("which", BAD_BOUNDS)
def test_bad_bounds(which):
    bounds, match = BAD_BOUNDS[which]
    with pytest.raises(ValueError, match=match):
        Implicit(SPHERE, bounds)


@pytest.mark.parametrize(
    "text, centre, match",
    [
        (SPHERE, (2, 0, 0), "not inside the body; give a centre from which every point"),
        (SPHERE, (np.nan, 0, 0), "centre"),
        (SPHERE, "middle", "centre"),
        ("(sqrt(x**2 + y**2) - 1)**2 + z**2 - 0.25", (1, 0, 0), "not star-shaped about .* directions fail"),
    ],
)
def test_bad_centres(text, centre, match):
    with pytest.raises(ValueError, match=match):
        Implicit(text, centre=centre)


def test_bad_speeds():
    with pytest.raises(ValueError, match=ALLOWED):
        Implicit(SPHERE, speed="__import__('os')")
    with pytest.raises(TypeError, match="speed 3 is neither"):
        Implicit(SPHERE, speed=3)
