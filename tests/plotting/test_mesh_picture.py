"""Pictures of meshes: their sizes, what is coloured, and files that cannot be written."""

from dataclasses import replace

import numpy as np
import pytest

from creeping.plotting.pictures import MeshValues, mesh_picture
from tests.exact_meshes import geodesic_sphere


def pixels(path):
    from matplotlib.image import imread

    return np.asarray(imread(path))[..., :3]


@pytest.fixture
def ball():
    vertices, triangles = geodesic_sphere(500)
    values = np.full(len(vertices), 1e-5)
    return MeshValues(vertices, triangles, values, np.zeros(len(vertices), dtype=bool), "a ball")


@pytest.mark.parametrize("count, dpi", [(1, 60), (2, 50)])
def test_sizes(tmp_path, ball, count, dpi):
    mesh_picture(tmp_path / "a.png", *count * [ball], dpi=dpi)
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG\r\n")
    shape = pixels(tmp_path / "a.png").shape
    # the figure may be cut by a pixel
    np.testing.assert_allclose(shape[:2], (round(3.4 * dpi) * count, round(7.2 * dpi)), atol=1)


def share(image, low, high):
    """Of the pixels whose colour lies in a box."""
    return np.mean(np.all((image > low) & (image < high), axis=-1))


def test_colours_and_dots_are_those_of_the_values(tmp_path, ball):
    mesh_picture(tmp_path / "good.png", ball, dpi=60)
    high = replace(ball, values=np.ones(len(ball.values)))
    mesh_picture(tmp_path / "high.png", high, dpi=60)
    bad = replace(ball, bad=ball.vertices[:, 2] > 0.5)
    mesh_picture(tmp_path / "bad.png", bad, dpi=60)
    good, high, bad = (pixels(tmp_path / f"{name}.png") for name in ("good", "high", "bad"))
    # the ends of viridis: violet is low, yellow high, shaded
    yellow, violet = ((0.5, 0.45, 0.0), (1, 1, 0.3)), ((0.1, 0, 0.2), (0.4, 0.3, 0.6))
    red = (0.5, 0, 0), (0.9, 0.4, 0.4)
    assert share(high, *yellow) > 0.2 > 0.05 > share(good, *yellow)
    assert share(good, *violet) > 0.2 > 0.05 > share(high, *violet)
    # a line of text is of the colour of the dots
    assert share(bad, *red) > 3 * share(good, *red)
