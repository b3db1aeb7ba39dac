"""The field on a sphere as a picture: its levels against the exact series and the rays' own field."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.plotting import coloured_body, currents_picture, decay_picture, surface_field_picture
from creeping.plotting.coloured_body import levels_of, surface_values
from tests.reference import sphere

K = 30.0


@pytest.fixture(scope="module")
def fan():
    body = sc.Sphere()
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (0, 0, 1)), length=2.2, n_rays=32)


def at(angle):
    """Points of the sphere by their angle from -z, the lit pole, in degrees."""
    t = np.radians(np.atleast_1d(angle))
    return np.stack([np.sin(t) * np.cos(0.3), np.sin(t) * np.sin(0.3), -np.cos(t)], axis=-1)


@pytest.mark.parametrize("boundary", ["hard", "soft", cr.ImpedanceBoundary(0.5 + 0.2j)])
def test_levels_are_those_of_the_exact_series(fan, boundary):
    angles = np.array([0.0, 20.0, 50.0, 70.0, 80.0, 89.0, 91.0, 100.0, 120.0])
    levels = levels_of(surface_values(fan, at(angles), wavenumber=K, boundary=boundary))
    cosine = -np.cos(np.radians(angles))
    if boundary == "soft":
        exact = sphere.surface_derivative(K, 1.0, cosine, "soft") / K
    else:
        exact = sphere.surface_field(K, 1.0, cosine, boundary if boundary == "hard" else boundary.admittance)
    error = np.abs(levels - 20 * np.log10(np.abs(exact)))
    # of second order on both sides
    assert error.max() < 0.06


@pytest.mark.parametrize("backend", ["matplotlib", "pyvista"])
def test_picture_of_the_body(tmp_path, fan, backend, request):
    from matplotlib.image import imread

    if backend == "pyvista":
        request.getfixturevalue("opengl")
    path = tmp_path / "field.png"
    options = {"wavenumber": K, "boundary": "hard", "cells": 16, "dpi": 50}
    assert surface_field_picture(path, fan, backend=backend, **options) == backend
    image = imread(path)[..., :3]
    # coloured, not grey
    assert np.mean(np.ptp(image, axis=-1) > 0.2) > 0.1
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("boundary", ["hard", "soft"])
def test_decay_picture(tmp_path, fan, boundary, monkeypatch):
    drawn = []
    draw = coloured_body._draw_decay

    def kept(ax, *rest):
        drawn.append(ax)
        draw(ax, *rest)

    monkeypatch.setattr(coloured_body, "_draw_decay", kept)
    decay_picture(tmp_path / "a.png", fan, wavenumber=K, boundary=boundary, rays=2, dpi=50)
    assert (tmp_path / "a.png").stat().st_size > 5000
    curves = [line for line in drawn[0].lines if str(line.get_label()).startswith("ray")]
    assert len(curves) == 2
    field = np.abs(cr.surface_field(fan, wavenumber=K, boundary=boundary))[0, 5] / (K if boundary == "soft" else 1)
    assert curves[0].get_ydata()[5] == pytest.approx(20 * np.log10(field))
    # on the sphere every ray passes its caustic after a quarter circle
    caustics = [line.get_xdata()[0] for line in drawn[0].lines if line not in curves]
    assert caustics == pytest.approx([np.pi / 2] * 2, abs=1e-3)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"boundary": "pec"}, "'pec' is no scalar"),
        ({"boundary": "firm"}, "'firm' is not"),
        ({"wavenumber": -1.0}, "wavenumber = -1.0"),
        ({"order": 3}, "order = 3"),
        ({"span": 0.0}, "span = 0.0"),
    ],
)
@pytest.mark.parametrize("draw", [surface_field_picture, decay_picture])
def test_bad_input_is_refused(tmp_path, fan, draw, change, match):
    options = {"wavenumber": K, **change}
    if draw is surface_field_picture:
        options["cells"] = 8
    with pytest.raises(cr.InvalidInputError, match=match):
        draw(tmp_path / "a.png", fan, **options)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("boundary", ["hard", "pec"])
def test_picture_of_the_currents(tmp_path, fan, boundary):
    from matplotlib.image import imread

    currents = cr.surface_currents(fan, wavenumber=8.0, boundary=boundary)
    assert currents_picture(tmp_path / "a.png", currents, backend="matplotlib", cells=24, dpi=40) == "matplotlib"
    assert imread(tmp_path / "a.png")[..., :3].std() > 0.03
    if boundary == "hard":
        with pytest.raises(InvalidInputError, match="of a conductor"):
            currents_picture(tmp_path / "b.png", currents, incident="theta", backend="matplotlib")


def test_currents_between_nodes(fan):
    # those of the sphere, 2 |n.d| h and the like, and none beyond the rays
    from creeping.plotting.coloured_body import current_levels

    currents = cr.surface_currents(fan, wavenumber=K, boundary="hard")
    found = 10 ** (current_levels(currents, at([5.0, 60.0, 95.0])) / 20)
    np.testing.assert_allclose(
        found, np.abs(sphere.surface_field(K, 1.0, -np.cos(np.radians([5.0, 60.0, 95.0])), "hard")), rtol=0.03
    )
