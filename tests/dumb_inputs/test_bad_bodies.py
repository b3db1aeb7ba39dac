"""Bodies that are none: each its own clear error, from check_surface and from whatever is built on it."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr

SPHERE = sc.Sphere()
BOX = np.array([[-1.0, -1, -1], [1, 1, 1]])


class Changed:
    """The unit sphere with some members replaced."""

    def __init__(self, **members):
        for name in ("level", "gradient", "hessian", "bounds", "atlas", "parameters"):
            setattr(self, name, members.get(name, getattr(SPHERE, name)))


def squared(x):
    return np.sum(x * x, axis=-1)


def cubed_slope(x):
    return 6 * ((squared(x) - 1) ** 2)[..., None] * x


def balls(x):
    """Two of radius 1 about (2, 0, 0) and (-2, 0, 0)."""
    return squared(np.stack([np.abs(x[..., 0]) - 2, x[..., 1], x[..., 2]], axis=-1)) - 1


def no_triangulation():
    return {
        "empty": (Changed(level=lambda x: squared(x) + 1), "no negative value"),
        "inverted": (Changed(level=lambda x: 1 - squared(x)), "faces of its box"),
        "larger than its bounds": (Changed(bounds=0.4 * BOX), "faces of its box"),
        "not finite": (Changed(level=lambda x: np.where(x[..., 0] > 0, np.nan, squared(x) - 1)), "not finite"),
        "zero gradient on F = 0": (Changed(level=lambda x: (squared(x) - 1) ** 3, gradient=cubed_slope), "not smooth"),
        "bounds with NaN": (Changed(bounds=BOX * np.nan), "not two corners"),
    }


def slope(x):
    return 2 * (x - np.sign(x[..., :1]) * [2.0, 0, 0])


def failing_checks():
    hessian = SPHERE.hessian

    class Rotated:
        """Charts that do not belong to their locator."""

        charts = SPHERE.atlas.charts[::-1]
        locate = SPHERE.atlas.locate

    return {
        "wrong gradient": (Changed(gradient=lambda x: 2.01 * x), "gradient against differences"),
        "wrong Hessian": (Changed(hessian=lambda x: 1.1 * hessian(x)), "Hessian against differences"),
        "two bodies": (Changed(level=balls, gradient=slope, bounds=BOX * [3, 1, 1]), "components beyond one"),
        "charts of another order": (Changed(atlas=Rotated()), "chart inverse"),
    }


@pytest.mark.parametrize("which", no_triangulation())
def test_level_sets_that_are_no_body(which):
    body, match = no_triangulation()[which]
    with pytest.raises(cr.CreepingError, match=match):
        cr.check_surface(body)
    with pytest.raises(cr.CreepingError, match=match):
        cr.shadow_line(body, (1, 2, 3))
    with pytest.raises(cr.CreepingError, match=match):
        cr.build_phase_map(body, horizon=0.5, grid=(12, 12), cache=False)


@pytest.mark.filterwarnings("ignore:invalid value encountered", "ignore:divide by zero")
@pytest.mark.parametrize("which", failing_checks())
def test_members_that_contradict_each_other(which):
    body, match = failing_checks()[which]
    report = cr.check_surface(body)
    assert not report.ok
    assert match in " ".join(check.name for check in report.checks if not check.ok)
    with pytest.raises(cr.CreepingError, match=match):
        report.require()
    with pytest.raises(cr.CreepingError, match=match):
        cr.build_phase_map(body, horizon=0.5, grid=(12, 12), cache=False)


def test_report_lists_every_check_that_failed():
    report = cr.check_surface(Changed(gradient=lambda x: 2.01 * x))
    assert "BAD gradient against differences of F" in repr(report) and "; mend gradient()" in repr(report)
    failed, count = sum(not check.ok for check in report.checks), len(report.checks)
    assert repr(report).count("BAD") == failed and f"ok  {count - failed} of {count} checks" in repr(report)


@pytest.mark.parametrize("radius", [1e-150, 1e150])
def test_a_body_of_no_size_or_every_size_is_refused(radius):
    with pytest.raises(cr.CreepingError, match="take a unit of length"):
        cr.shadow_line(sc.Sphere(radius), (0, 0, 1))
