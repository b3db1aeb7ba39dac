"""Bodies, speeds and coatings go to other processes and are copied: numbers stay, to the last bit."""

import copy
import multiprocessing
import pickle
from functools import cache

import numpy as np
import pytest

import scatterers as sc

POINTS = np.array([[0.1, 0.2, 0.3], [0.9, -0.4, 0.2], [1.3, 0.2, -0.7]])
ANOTHER = {
    "pickled": lambda one: pickle.loads(pickle.dumps(one)),
    "copied": copy.copy,
    "deep copied": copy.deepcopy,
}
another = pytest.mark.parametrize("again", ANOTHER.values(), ids=ANOTHER)
MADE = {
    "smooth": lambda: sc.Implicit("x**2/1.21 + y**2 + z**4 - 1"),
    "with a spine": lambda: sc.Implicit("(x - 0.3*z**2)**2 + y**2 + z**2/4 - 1"),
    "with an edge": lambda: sc.Implicit("max(x**2 + y**2 + z**2 - 1, z - 0.6, -z - 0.6)"),
    "with a speed": lambda: sc.Sphere(speed="1 + x/3"),
}


@cache
def made(name):
    """A body, looked at before: what has been made of it goes along or is made again."""
    body = MADE[name]()
    body.level(POINTS)
    assert body.fingerprint
    return body


@another
@pytest.mark.parametrize("name", MADE)
def test_a_body_stays_what_it_is(name, again):
    body = made(name)
    same = again(body)
    assert type(same) is type(body) and same is not body
    assert same.fingerprint == body.fingerprint
    for quantity in ("level", "gradient", "hessian"):
        np.testing.assert_array_equal(getattr(same, quantity)(POINTS), getattr(body, quantity)(POINTS))


@another
def test_several_bodies_stay_where_they_are(again):
    bodies = sc.Bodies([made("smooth"), made("with an edge")], at=[(0, 0, 0), (4, 0, 0)])
    same = again(bodies)
    np.testing.assert_array_equal(same.bounds, bodies.bounds)
    assert [part.fingerprint for part in same.parts] == [part.fingerprint for part in bodies.parts]


@another
def test_pieces_keep_their_numbers_and_their_shapes(again):
    body = made("with an edge")
    same = again(body)
    places = POINTS * [1, 1, 2]
    np.testing.assert_array_equal(same.piece(places), body.piece(places))
    for one, other in zip(body.pieces, same.pieces, strict=True):
        np.testing.assert_array_equal(other.hessian(POINTS), one.hessian(POINTS))
        # a piece by itself, too
        np.testing.assert_array_equal(again(one).gradient(POINTS), one.gradient(POINTS))
    assert [str(crease) for crease in same.creases] == [str(crease) for crease in body.creases]


@another
def test_charts_that_were_used_find_the_same_points(again):
    body = made("with a spine")
    on = body.atlas.charts[2].point(np.array([[0.2, 0.7], [0.5, 0.1]]))
    same = again(body)
    np.testing.assert_array_equal(same.atlas.charts[2].point(np.array([[0.2, 0.7], [0.5, 0.1]])), on)
    np.testing.assert_array_equal(same.atlas.locate(on)[1], body.atlas.locate(on)[1])


@another
@pytest.mark.parametrize(
    "one", [sc.ExpressionSpeed("2 + sin(x*y)/3"), sc.Coating("0.3 + 0.1*z", "x*y/5")], ids=["speed", "coating"]
)
def test_speeds_and_coatings_are_equal_and_give_the_same_values(one, again):
    same = again(one)
    assert same == one
    np.testing.assert_array_equal(same.value(POINTS), one.value(POINTS))


def test_what_is_no_expression_is_refused_when_unpickled():
    written = pickle.dumps(sc.ExpressionSpeed("1 + x")).replace(b"1 + x", b"x + a")
    with pytest.raises(ValueError, match="contains 'a'"):
        pickle.loads(written)


@pytest.mark.slow
def test_a_process_that_is_started_anew_computes_the_same():
    body = made("with an edge")
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        (found,) = pool.map(body.gradient, [POINTS])
    np.testing.assert_array_equal(found, body.gradient(POINTS))
