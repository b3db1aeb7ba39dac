"""Rays until they have faded, iso-phase curves where these have detached, the room that the parameter plane takes."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.plotting._strokes import FADED, curve_pieces, drawn_curves, drawn_ends


@pytest.mark.parametrize("of", ["travel_time", "eikonal"])
def test_curves_part_where_rays_have_detached(torus_fan, of):
    known = torus_fan.detachment[np.isfinite(torus_fan.detachment)]
    assert len(known)
    level = float(np.median(known)) if of == "travel_time" else 0.5
    curves = cr.iso_phase_curves(torus_fan, level, of=of)
    bound_curves = cr.iso_phase_curves(torus_fan, level, of=of, beyond_detachment=False)
    bound = sum(sum(len(piece) for piece in curve_pieces(c, torus_fan, c.points)[0]) for c in curves)
    # points that are shed with the rays still bound, by the other option of the curves themselves
    kept = np.concatenate([c.points for c in bound_curves]) if bound_curves else np.zeros((0, 3))
    found = np.concatenate([p for c in curves for p in curve_pieces(c, torus_fan, c.points)[0]] or [np.zeros((0, 3))])
    assert bound == len(found)
    assert {tuple(p) for p in found.round(9).tolist()} <= {tuple(p) for p in kept.round(9).tolist()}
    # without its fan a curve is one
    assert [len(curve_pieces(c, None, c.points)[1]) for c in curves] == [0] * len(curves)


def test_pictures_show_detached_curves_pale(torus_fan):
    level = float(np.max(torus_fan.detachment[np.isfinite(torus_fan.detachment)]))
    curves = cr.iso_phase_curves(torus_fan, min(level + 0.05, torus_fan.length))
    ax = torus_fan.plot(curves=curves)
    assert any(one.get_alpha() == FADED for one in ax.collections)


@pytest.mark.parametrize("which", ["twisted_fan", "torus_fan"])
def test_the_plane_fills_its_page(which, request):
    shown = request.getfixturevalue(which)
    figure = shown.plot().figure
    figure.draw_without_rendering()
    box = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    # a quarter of the height was blank above and below
    assert box.height / height > 0.85 and box.width / width > 0.85


@pytest.mark.parametrize(("boundary", "root"), [("hard", 1.0187929716), ("soft", 2.3381074105), ("pec", 1.0187929716)])
def test_rays_are_drawn_until_they_have_faded_by_30_db(boundary, root):
    """On a ball of radius a the wave falls as exp{-(ka/2)^(1/3) |root| sin(60 deg) s/a}, roots of Ai' and Ai."""
    ball, k = sc.Sphere(radius=2.0), 200.0
    line = cr.shadow_line(ball, (0.3, 0.5, 0.81), n_points=64)
    fan = cr.launch(cr.DirectFlow(ball), line, length=6.0, n_rays=6, n_steps=64, max_gap=np.inf)
    rate = np.cbrt(k * 2.0 / 2) * root * np.sin(np.pi / 3) / 2.0
    expected = np.array([10.0, 20.0, 30.0]) * np.log(10) / 20 / rate
    np.testing.assert_allclose(drawn_ends(fan, None, k, boundary).T, np.tile(expected, (6, 1)), rtol=1e-4)
    curves = cr.iso_phase_curves(fan, [0.9 * expected[-1], 1.1 * expected[-1]])
    assert drawn_curves(curves, fan, drawn_ends(fan, None, k, boundary)) == curves[:1]


def test_rays_end_where_they_cross_a_second_time():
    """On a ball they do so at pi a/2 and 3 pi a/2; a wave of so low a frequency has not faded there."""
    ball = sc.Sphere()
    line = cr.shadow_line(ball, (0.3, 0.5, 0.81), n_points=64)
    fan = cr.launch(cr.DirectFlow(ball), line, length=6.0, n_rays=6, n_steps=600, max_gap=np.inf)
    np.testing.assert_allclose(drawn_ends(fan, None, 0.05)[-1], 1.5 * np.pi, atol=0.011)
    assert np.all(np.isinf(drawn_ends(fan, np.inf)))
