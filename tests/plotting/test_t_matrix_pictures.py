"""Pictures of a T-matrix: each pixel against the far field of its own incidence."""

from itertools import pairwise

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr


@pytest.fixture(name="T", scope="module", params=["hard", "pec"])
def of_an_ellipsoid(request):
    return cr.t_matrix(sc.Ellipsoid(0.5, 0.4, 0.3), wavenumber=3.0, boundary=request.param, center=(0.1, 0.0, 0.05))


def map_of(ax):
    """Levels (elevations, azimuths) of a map."""
    (mesh,) = ax.collections
    return mesh, np.asarray(mesh.get_array()).reshape(mesh.get_coordinates()[1:, 1:, 0].shape)


def test_a_pixel_is_the_backscatter_towards_its_radar(T):
    ax = T.plot(component="tp" if T.vector else None)
    _, levels = map_of(ax)
    elevation, azimuth = (np.linspace(-end, end, n) for end, n in zip((90, 180), levels.shape, strict=True))
    for row, column in ((len(elevation) // 4, len(azimuth) // 5), (len(elevation) - 3, 4)):
        up, turn = np.radians(elevation[row]), np.radians(azimuth[column])
        radar = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
        f = np.abs(T.far_field(-radar, radar).total[0])
        want = 10 * np.log10(4 * np.pi * f[0, 1] ** 2) if T.vector else 20 * np.log10(f)
        assert abs(levels[row, column] - want) < 1e-3
    assert ax.get_xlim() == (-180, 180) and ax.get_ylim() == (-90, 90)


def test_the_mean_has_the_average_over_orientation(T):
    _, levels = map_of(T.plot())
    weight = np.cos(np.linspace(-np.pi / 2, np.pi / 2, len(levels)))[:, None]
    size = 10 ** (levels / 10) if T.vector else 4 * np.pi * 10 ** (levels / 10)
    mean = np.sum(size[:, 1:] * weight) / np.sum(weight) / (levels.shape[1] - 1)
    assert mean == pytest.approx(T.orientation_average().backscattering, rel=2e-3)


def test_waves_are_drawn_by_degrees(T):
    mesh, levels = map_of(T.plot(kind="waves"))
    # of a conductor two waves for each order, from degree 1 on
    ends = [2 * (deg**2 - 1) if T.vector else deg**2 for deg in range(1 if T.vector else 0, T.order + 2)]
    at = [slice(*pair) for pair in pairwise(ends)]
    norms = np.array([[np.linalg.norm(T.matrix[out, into]) for into in at] for out in at])
    want = 20 * np.log10(np.maximum(norms / norms.max(), 1e-20))
    shown = np.maximum(want, mesh.norm.vmin)
    assert np.allclose(np.maximum(levels, mesh.norm.vmin), shown, atol=1e-6) and mesh.norm.vmax >= 0


def test_it_goes_on_given_axes_and_refuses_what_it_does_not_know(T):
    from matplotlib.figure import Figure

    ax = Figure().add_subplot()
    assert T.plot(ax, kind="waves", span=30) is ax and not ax.get_title()
    for bad in ({"kind": "polar"}, {"component": "xx"}):
        with pytest.raises(cr.InvalidInputError, match="unknown"):
            T.plot(**bad)


def test_its_table_has_what_it_scatters(T):
    table = T._repr_html_()
    assert all(word in table for word in ("Ellipsoid", "reciprocity", "unitarity", T.boundary))
