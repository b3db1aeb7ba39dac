"""Pictures of the field on a plane: what is drawn where, and what is said of points that are not to be trusted."""

from dataclasses import replace

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.plotting import field_cut_picture, plane_pictures

K = 10.0


def of_length(length):
    body = sc.Sphere()
    return cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, (0, 0, 1)), length=length, n_rays=24)


@pytest.fixture(scope="module")
def fan():
    return of_length(3.2)


@pytest.fixture(scope="module")
def total(fan):
    return cr.field_cut(fan, wavenumber=K, boundary="hard", extent=(3.0, 3.0), step=0.12)


@pytest.fixture(scope="module")
def rays():
    return cr.field_cut(of_length(1.2), wavenumber=K, boundary="soft", extent=(4.0, 4.0), step=0.12, method="rays")


def test_levels_stand_where_the_points_are(total):
    ax = total.plot()
    (image,) = ax.images
    shown = image.get_array()
    np.testing.assert_allclose(shown[total.outside], 20 * np.log10(np.abs(total.wave()[total.outside])))
    left, right, bottom, top = image.get_extent()
    half = 0.5 * (total.across[1] - total.across[0])
    assert (left, right, bottom, top) == pytest.approx((-1.5 - half, 1.5 + half, -1.5 - half, 1.5 + half))
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("z (L)", "x (L)")
    marks = [line for line in ax.lines if line.get_marker() == "o"]
    np.testing.assert_allclose(np.sort(marks[0].get_xydata()[:, 1]), [-1, 1], atol=1e-4)


def test_wave_fronts_of_the_incident_wave_are_half_a_wavelength_apart(total):
    # far to the side of the body next to nothing but the wave passes: Re e^{ikz} = 0
    ax = total.plot(fronts=True, phase=0.3)
    curves = [one for one in ax.collections if list(getattr(one, "levels", ())) == [0.0]]
    (front,) = [one for one in curves if np.allclose(one.get_edgecolor()[:, :3], 1.0)]
    nodes = np.concatenate([path.vertices for path in front.get_paths()])
    top = nodes[np.abs(nodes[:, 1] - 1.5) < 1e-9, 0]
    wave = total.wave()[-1] * np.exp(-0.3j)
    # where the real part changes its sign between neighbours
    at = np.flatnonzero(wave.real[:-1] * wave.real[1:] < 0)
    assert len(top) == len(at) >= 8
    assert np.all((np.sort(top) >= total.across[at]) & (np.sort(top) <= total.across[at + 1]))


def test_what_is_missing_is_grey_and_named(rays):
    ax = rays.plot()
    cover = ax.images[1].get_array()
    missing = np.isin(rays.status, [s for s in cr.FieldStatus if s.name not in ("OK", "UNRESOLVED")])
    np.testing.assert_array_equal(cover[..., 3] == 1.0, missing)
    assert any(one.hatches == [plane_pictures.HATCH] for one in ax.collections if hasattr(one, "hatches"))
    words = [text.get_text() for legend in ax.figure.legends for text in legend.get_texts()]
    count = int(np.sum(rays.status == cr.FieldStatus.LIT))
    assert count > 100 and any(f"not OK: {count} LIT" in text for text in words)


def test_a_field_below_its_error_is_dotted(total):
    doubtful = replace(total.field, error=np.full(total.field.error.shape, 0.5))
    ax = replace(total, field=doubtful).plot(legend=False)
    assert any(one.hatches == [plane_pictures.DOTS] for one in ax.collections if hasattr(one, "hatches"))
    assert not ax.figure.legends
    certain = replace(total, field=replace(total.field, error=np.zeros(total.field.error.shape)))
    assert not any(getattr(one, "hatches", None) == [plane_pictures.DOTS] for one in certain.plot().collections)


@pytest.mark.parametrize(("show", "error"), [("level", False), ("magnitude", False), ("wave", True)])
def test_files(tmp_path, total, show, error):
    from matplotlib.image import imread

    field_cut_picture(tmp_path / "a.png", total, show=show, error=error, dpi=50)
    image = imread(tmp_path / "a.png")[..., :3]
    assert image.std() > 0.1
    assert (image.shape[0] > 1.4 * image.shape[1]) == error


def test_refusals(tmp_path, fan, total):
    coarse = cr.field_cut(fan, wavenumber=K, boundary="hard", extent=(3.0, 3.0), step=0.3, method="rays")
    with pytest.raises(cr.InvalidInputError, match=r"give a step of 0.14 or less, or fronts=False"):
        field_cut_picture(tmp_path / "a.png", coarse, fronts=True)
    with pytest.raises(cr.InvalidInputError, match="show = 'colours' is not one of level"):
        field_cut_picture(tmp_path / "a.png", total, show="colours")
    with pytest.raises(cr.InvalidInputError, match="span = 0"):
        field_cut_picture(tmp_path / "a.png", total, span=0.0)
    assert not list(tmp_path.iterdir())
