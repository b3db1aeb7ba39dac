"""Pictures of the coupling of a port with the rest of a body, and wave fronts on bodies."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.geometry.piecewise import drawn_mesh
from creeping.plotting import coupling_picture
from creeping.plotting.coloured_body import front_strokes
from creeping.plotting.coupling_pictures import coupling_levels

BALL = sc.Sphere()


def test_levels_are_masked_by_status():
    # on a torus nothing is known where rays have come to the inner side
    points = np.array([[1.5, 0, 0], [1.5 * np.cos(0.3), 1.5 * np.sin(0.3), 0], [-0.5, 0, 0]])
    field = cr.port_field(sc.Torus(), points[0], points, wavenumber=20.0)
    levels = coupling_levels(field)
    assert np.isposinf(levels[0]) and np.isnan(levels[2]) and not field.ok[2]
    assert levels[1] == pytest.approx(20 * np.log10(abs(field[1])))


@pytest.mark.parametrize("backend", ["matplotlib", "pyvista"])
def test_picture(tmp_path, backend, request):
    from matplotlib.image import imread

    if backend == "pyvista":
        request.getfixturevalue("opengl")
    options = {"wavenumber": 12.0, "backend": backend, "dpi": 50, "cells": 20, "fronts": True}
    assert coupling_picture(tmp_path / "a.png", BALL, (0, 0, 1), **options) == backend
    image = imread(tmp_path / "a.png")[..., :3]
    assert np.mean(np.ptp(image, axis=-1) > 0.2) > 0.1
    with pytest.raises(cr.InvalidInputError, match=r"edges a wavelength; 4.5 are the least: give .* times the cells"):
        coupling_picture(tmp_path / "b.png", BALL, (0, 0, 1), **options | {"wavenumber": 60.0})


def test_fronts_of_a_plane_wave_are_circles():
    mesh, _ = drawn_mesh(BALL, 40)
    k, phase = 8.0, 0.4
    wave = np.exp(1j * k * mesh.vertices[:, 2])
    known = np.ones(len(wave), dtype=bool)
    (stroke,) = front_strokes(BALL, mesh, wave, known, wavenumber=k, phase=phase)
    # cos(kz - phase) = 0 within the sphere
    orders = np.arange(-10, 10)
    heights = (phase + np.pi * (orders + 0.5)) / k
    heights = heights[np.abs(heights) < 0.97]
    mean = np.sort([line[:, 2].mean() for line in stroke.lines])
    np.testing.assert_allclose(mean[np.abs(mean) < 0.97], heights, atol=0.01)
    for line in stroke.lines:
        np.testing.assert_allclose(np.linalg.norm(line, axis=1), 1.0, atol=1e-9)
        np.testing.assert_allclose(line[0], line[-1])
        assert np.ptp(line[:, 2]) < 0.03


def test_fronts_end_where_the_field_is_not_known():
    mesh, _ = drawn_mesh(BALL, 40)
    known = mesh.vertices[:, 0] > 0
    wave = np.where(known, np.exp(8j * mesh.vertices[:, 2]), np.nan)
    (stroke,) = front_strokes(BALL, mesh, wave, known, wavenumber=8.0)
    assert min(line[:, 0].min() for line in stroke.lines) > -1e-9
    assert front_strokes(BALL, mesh, wave, np.zeros(len(wave), dtype=bool), wavenumber=8.0) == []
