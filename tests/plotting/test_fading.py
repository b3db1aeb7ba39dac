"""Iso-phase curves where rays have detached, the room that the parameter plane takes, legends of parts."""

import numpy as np
import pytest

import creeping as cr
from creeping.plotting._strokes import FADED, curve_pieces


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
