"""Axes of revolution: what bodies declare, and what becomes of declarations that are wrong."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.geometry.revolution import axis_of_revolution, charted_axis, rotations
from creeping.phaseflow.coordinates import model_of

X, _, Z = np.eye(3)


@pytest.mark.parametrize(
    "body, axis",
    [
        (sc.Torus(), Z),
        (sc.Sphere(), Z),
        (sc.Ellipsoid(1.2, 0.8, 0.8), X),
        (sc.Ellipsoid(0.8, 0.8, 1.2), Z),
        (sc.Ellipsoid(1.0, 0.8, 0.6), None),
        (sc.TwistedEllipsoid(), None),
        (sc.Cylinder(1.0, 2.0), Z),
        (sc.Torus(speed="1 + x/9"), None),
    ],
    ids=repr,
)
def test_axes_of_bodies(body, axis):
    found = axis_of_revolution(body)
    assert (found is None) == (axis is None)
    if axis is not None:
        np.testing.assert_array_equal(found, axis)
        # the level is that of a turned point
        x = np.random.default_rng(1).normal(size=(20, 3))
        turned = x @ rotations(axis, 0.7).T
        np.testing.assert_allclose(body.level(turned), body.level(x), rtol=1e-12, atol=1e-12)
        normals = body.gradient(x) @ rotations(axis, 0.7).T
        np.testing.assert_allclose(body.gradient(turned), normals, rtol=1e-11, atol=1e-11)


def test_turns_are_about_the_axis():
    axis = np.array([1.0, 2.0, 2.0]) / 3
    turn = rotations(axis, [0.3, -2.0])
    np.testing.assert_allclose(turn @ axis, [axis, axis], atol=1e-15)
    np.testing.assert_allclose(np.trace(turn, axis1=1, axis2=2), 1 + 2 * np.cos([0.3, -2.0]), atol=1e-15)
    np.testing.assert_allclose(turn @ np.swapaxes(turn, 1, 2), [np.eye(3)] * 2, atol=1e-15)
    np.testing.assert_allclose(np.linalg.det(turn), 1, atol=1e-15)
    # right-handed
    assert np.cross(X, rotations(Z, 0.1) @ X) @ Z > 0


def test_a_wrong_axis_costs_speed_only():
    class Boasting(sc.Ellipsoid):
        """Says that it is one of revolution, and is not."""

        @property
        def axis_of_revolution(self):
            return (0.0, 0.0, 1.0)

    body = Boasting(1.0, 0.8, 0.6)
    np.testing.assert_array_equal(axis_of_revolution(body), Z)
    assert charted_axis(body) is None
    assert model_of(body).name == "octant"


@pytest.mark.parametrize("axis", [(0, 0, 2.0), (0, 1.0), "z"], ids=repr)
def test_an_axis_that_is_no_unit_vector_is_refused(axis):
    class Careless(sc.Sphere):
        """Declares something."""

        axis_of_revolution = axis

    with pytest.raises(cr.CreepingError, match="is no unit vector; give three numbers of length 1"):
        axis_of_revolution(Careless())
