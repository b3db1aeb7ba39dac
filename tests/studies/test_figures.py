"""Every figure of the paper is drawn, quickly, and its numbers hold."""

import json
import subprocess
import sys

import numpy as np
import pytest

import creeping as cr
import studies
from studies import figure3_circles, figure5_weighted

MAP = 1e-4
"""Rms of one g_T0: the tolerance of a quick map; Algorithm 1 on the grid of Figure 2 does better."""
GROWTH = 10.0
"""How much an error grows on the way, at most: neighbours part by e^2 in t = 1 on the torus' inner equator (K = -4),
where few rays stay; linearly on the other bodies. The worst measured is 2.6, Figure 4."""


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Cards and pictures, each drawn once: drawn(name) -> (card, pixels, folder)."""
    from matplotlib.image import imread

    folder = tmp_path_factory.mktemp("figures") / "made" / "on the way"
    kept = {}

    def get(name):
        if name not in kept:
            card = studies.draw(name, folder, quick=True)
            kept[name] = card, np.asarray(imread(folder / card["file"]))[..., :3], folder
        return kept[name]

    return get


QUICK = ("fig5-weighted", "field-cut")
"""Drawn by default; the site, which `.ci/run` makes, draws all."""


def figures(*begin):
    names = [name for name in studies.FIGURES if name.startswith(begin)]
    return [pytest.param(name, marks=[pytest.mark.slow] * (name not in QUICK)) for name in names]


@pytest.mark.parametrize("name", figures("field", "sweep"))
def test_field_figure_carries_its_error(name, drawn):
    card, pixels, folder = drawn(name)
    assert json.loads((folder / f"{name}.json").read_text()) == json.loads(json.dumps(card))
    paper = np.all(pixels > 0.99, axis=-1)
    assert 0.02 < np.mean(~paper) < 0.95
    assert np.mean(np.ptp(pixels, axis=-1) > 0.3) > 0.002
    assert card["error"]["field"]


def test_field_cut_lies_on_the_exact_curve(drawn):
    card, _, _ = drawn("field-cut")
    assert card["error"]["field"]["largest_over_largest"] < 0.02
    assert card["error"]["field"]["median_relative"] < 0.01


@pytest.mark.slow
def test_rays_of_sources_start_on_circles_of_closed_form(drawn):
    card, pixels, _ = drawn("source-rays")
    sphere, torus = card["error"]["sphere"], card["error"]["torus_axis"]
    # the horizon of a source half a radius up, as seamen know it, and of the far one nearly all of a quarter
    assert np.cos(np.radians(sphere["angle"])) == pytest.approx([1 / 1.05, 1 / 1.5, 1 / 3, 1 / 30])
    assert max(sphere["off"] + torus["off"]) < 1e-9 and max(sphere["front_off"]) < 1e-6
    # in the middle of the ring cos theta = -r/R
    assert [torus["outer"][0], torus["inner"][0]] == pytest.approx([120.0, 240.0])
    for name, case in card["parameters"]["cases"].items():
        assert card["error"][name]["largest_grazing_angle"] < 1e-9
        assert 0 < card["error"][name]["rays"]["rms"] <= GROWTH * 1.5 / case["T0"] * card["error"][name]["map"]["rms"]
    # the torus hides a part of its own line, and some of it is hollow
    assert min(card["parameters"]["cases"]["torus"]["shadow_line"].values()) > 0.1
    assert 0.1 < np.mean(~np.all(pixels > 0.99, axis=-1)) < 0.9
    assert np.mean(np.ptp(pixels, axis=-1) > 0.3) > 0.005


@pytest.mark.slow
def test_field_on_the_body_is_measured(drawn):
    card, _, _ = drawn("field-body")
    assert np.median(card["error"]["field"]["median_relative_by_arclength"]) < 10.5


@pytest.mark.slow
def test_creeping_wave_beats_in_step_on_the_conducting_sphere(drawn):
    card, _, _ = drawn("sweep-sphere-rcs")
    found = card["error"]["field"]
    assert card["parameters"]["ka"] == [5.0, 40.0]
    assert found["peaks"] == found["exact_peaks"] == 29
    # the wave goes half round and its rays 2a through the air: Δ(ka) (2 + π) = 2π, and a little less for its lag
    assert 1.18 < found["period_of_ka"] < 2 * np.pi / (2 + np.pi)
    assert found["largest_shift_degrees"] < 4
    assert found["median_shift_degrees"] < 1
    assert found["largest_error_of_swing"] < 0.03
    assert found["cross_section_largest_beyond_10"] < 0.04
    assert max(found["field_largest_beyond_10"], found["across_largest_beyond_10"]) < 0.025


@pytest.mark.slow
def test_cross_sections_of_a_sweep_are_those_of_one_incidence(drawn):
    card, _, _ = drawn("sweep-cross-section")
    twisted, ellipsoid = card["error"]["field"].values()
    for one in (twisted, ellipsoid):
        assert max(one["against_one_by_one_dB"].values()) < 0.1
        for boundary in ("soft", "hard", "pec"):
            # where the fan integral serves, the place of its rays matters a little
            assert one["mirrored"][boundary]["largest_dB"] < 1.5
            assert one["highest_dB"][boundary] > one["mean_dB"][boundary]
        # a soft wave is far weaker
        assert one["mean_dB"]["soft"] < one["mean_dB"]["hard"] - 30
    assert max(ellipsoid["unresolved"].values()) < 0.1 and max(ellipsoid["without_return"].values()) == 0
    # rays that leave concave regions have no field
    assert 0 < twisted["without_return"]["hard"] < 0.1


@pytest.mark.slow
def test_bistatic_maps_are_reciprocal(drawn):
    card, _, _ = drawn("sweep-bistatic")
    ellipsoid, twisted = card["error"]["field"].values()
    assert ellipsoid["pairs"] == 6 and ellipsoid["unresolved"] == 0
    assert ellipsoid["largest_over_largest"] < 0.01
    assert twisted["pairs"] >= 3 and twisted["median_relative"] < 0.03


@pytest.mark.parametrize("name", figures("fig"))
def test_figure_of_the_paper(name, drawn):
    """It is not blank, its sidecar says what was drawn, and errors are those of the map added up."""
    card, pixels, folder = drawn(name)
    paper = np.all(pixels > 0.99, axis=-1)
    # the bodies take a tenth of the page at least, and some of the page stays white
    assert 0.1 < np.mean(~paper) < 0.9
    # nothing runs off the page: its rim is white
    assert np.concatenate([paper[0], paper[-1], paper[:, 0], paper[:, -1]]).all()
    # lines in colour, not only the grey of the body
    assert np.mean(np.ptp(pixels, axis=-1) > 0.3) > 0.005
    assert json.loads((folder / f"{name}.json").read_text()) == json.loads(json.dumps(card))
    assert {"name", "title", "file", "parameters", "error", "headline", "seconds", "version", "quick"} == set(card)
    error, parameters = card["error"], card["parameters"]
    assert card["title"].startswith(f"Figure {name[3]}") and f"{error['rays']['rms']:.1e}" in card["headline"]
    assert 0 < error["map"]["rms"] <= MAP and error["rays"]["samples"] >= 16
    assert 0 < error["rays"]["rms"] <= GROWTH * parameters["time"] / parameters["T0"] * error["map"]["rms"]


def test_weighted_rays_are_exact(drawn):
    """Over all rays, not only the traced ones, and against no integrator."""
    card, _, _ = drawn("fig5-weighted")
    error = card["error"]
    assert error["exact"]["samples"] == card["parameters"]["rays"]
    assert error["exact"]["rms"] <= GROWTH * card["parameters"]["time"] / card["parameters"]["T0"] * error["map"]["rms"]


def test_exact_solution_is_one():
    """The formulas of Figure 5 satisfy the traced flow, without any map."""
    x, p = figure5_weighted.exact(np.array([0.3, 2.0, 4.5]), np.array([0.0, 0.7, 2.5]))
    traced = cr.trace(figure5_weighted.BODY, x[:, 0], p[:, 0], [0.0, 0.7, 2.5], rtol=1e-12)
    np.testing.assert_allclose(traced, (x, p), atol=1e-10)


def test_caustic_is_where_neighbours_meet():
    """On the conjugate locus x(t, alpha) stops moving with alpha; it moves by sin t or so elsewhere."""
    from creeping.geodesics.integrator import trace_states
    from creeping.geodesics.states import pack
    from studies._curves import directions_at

    body, source = figure3_circles.BODY, figure3_circles.SOURCE
    angles, step = np.linspace(0.2, 6.0, 12), 1e-4
    times = np.linspace(0.0, 4.0, 65)
    p = directions_at(body, source, angles)
    x = np.broadcast_to(source, p.shape)
    points, when = figure3_circles.first_caustic(trace_states(body, pack(x, p, jacobi=True), times, rtol=1e-12), times)
    for angle, point, time in zip(angles, points, when, strict=True):
        sides = directions_at(body, source, np.array([angle - step, angle + step]))
        ends, _ = cr.trace(body, np.stack([source] * 2), sides, time, rtol=1e-12)
        # cubics between times 1/16 apart: 1e-5
        assert np.linalg.norm(ends[1] - ends[0]) / (2 * step) < 1e-4
        np.testing.assert_allclose(ends.mean(axis=0), point, atol=1e-5)


def test_titles_are_one_line_each():
    titles = studies.titles()
    assert list(titles) == list(studies.FIGURES)
    assert all(title.endswith(".") for title in titles.values())
    assert all(titles[name].startswith("Figure ") for name in titles if name.startswith("fig"))


def test_unknown_figure_leaves_nothing(tmp_path):
    with pytest.raises(cr.InvalidInputError, match="fig3-circles"):
        studies.draw("fig7", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_failed_figure_leaves_nothing(tmp_path, monkeypatch):
    def fail(path, quick):
        path.write_bytes(b"half a picture")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(figure3_circles, "draw", fail)
    with pytest.raises(cr.CreepingError, match=r"fig3-circles\.png"):
        studies.draw("fig3-circles", tmp_path)
    assert not list(tmp_path.iterdir())


def test_folder_that_is_a_file_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(cr.InvalidInputError, match="file"):
        studies.draw("fig3-circles", tmp_path / "file")


def test_importing_studies_imports_no_library():
    code = (
        "import sys, studies; studies.FIGURES; "
        "assert not {'numpy', 'matplotlib', 'numba', 'scipy', 'trimesh'} & set(sys.modules); "
        "studies.titles(); assert not {'matplotlib', 'numba', 'pyvista'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
