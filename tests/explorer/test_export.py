"""The page that needs no server."""

import re
from dataclasses import replace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.commands import main as cli
from creeping.explorer.request import ViewRequest

pytest.importorskip("viser")
BODY = sc.Ellipsoid(1.2, 0.8, 0.6)
REQUEST = ViewRequest(theta=50.0, phi=40.0, rays=48, length=1.5, spacing=0.25, wavenumber=10.0, boundary="soft")


def written(path, body=BODY, request=REQUEST):
    from creeping.explorer.export import export_page

    return export_page(path, cr.DirectFlow(body, rtol=1e-9), request)


@pytest.mark.slow
def test_the_page_opens_from_its_file(tmp_path, browser):
    from creeping.explorer.preview import preview_of, step_of

    path = tmp_path / "page.html"
    written(path)
    browser.open(path.as_uri())
    frame = preview_of(cr.DirectFlow(BODY, rtol=1e-9), REQUEST, step_of(BODY))
    held = browser.segments(len(frame.ray_segments))
    np.testing.assert_allclose(held, frame.ray_segments, rtol=0, atol=1e-6)
    assert browser.driver.find_element("id", "plane").rect["height"] > 50
    assert "length 6.0202046 L" in browser.driver.find_element("id", "creeping").text
    assert browser.errors() == []
    assert browser.requests_outside() == []


def test_the_page_holds_its_numbers_and_loads_nothing(tmp_path):
    class Named(sc.Ellipsoid):
        def __repr__(self):
            return "<script>alert(1)</script>" + super().__repr__()

    found = written(tmp_path / "page.html", Named(1.2, 0.8, 0.6))
    page = (tmp_path / "page.html").read_text()
    assert f"length {found.line.length:.8g} L" in page and "(a=1.2, b=0.8, c=0.6" in page
    assert not re.search(r"<(script|link|img|iframe)[^>]+(src|href)=[\"']?https?:", page)
    assert "<script>alert(1)" not in page


def test_trouble_writes_nothing(tmp_path):
    with pytest.raises(cr.SingularIncidenceError):
        written(tmp_path / "page.html", sc.Torus(), REQUEST.changed(theta=90.0, phi=0.0))
    with pytest.raises(cr.CreepingError):
        written(tmp_path / "no" / "such" / "folder" / "page.html")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "arguments, code",
    [
        (["--rays", "8"], 3),
        (["--direction", "0", "0", "0"], 3),
        (["--port", "0"], 3),
        (["--boundary", "wet"], 3),
        (["--wavenumber", "20", "--frequency", "1GHz"], 3),
        (["--frequency", "1:2:1GHz"], 3),
        (["--frequency", "fast"], 3),
        (["--sound-speed", "-1", "--frequency", "38kHz"], 3),
        (["--length", "nan"], 3),
        (["--wavenumber", "0"], 3),
    ],
)
def test_the_command_refuses(arguments, code, tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(["explore", "sphere", *arguments, "--export", str(tmp_path / "page.html")])
    assert caught.value.code == code and list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_notebook_holds_the_page(tmp_path, browser):
    from creeping.explorer.notebook import page

    line = cr.shadow_line(BODY, direction=(1, 1, 1))
    fan = cr.launch(cr.DirectFlow(BODY), line, length=1.5, n_rays=32)
    made = page(fan, wavenumber=20.0, boundary=cr.ImpedanceBoundary(0.5))
    assert made.title.startswith("Ellipsoid(") and "impedance:0.5" in made.text and "MB)" in repr(made)
    (tmp_path / "notebook.html").write_text(f"<!doctype html><html><body>{made._repr_html_()}</body></html>")
    browser.open((tmp_path / "notebook.html").as_uri())
    browser.driver.switch_to.frame(0)
    assert browser.driver.find_element("id", "plane").rect["height"] > 50
    assert browser.driver.find_element("tag name", "canvas").rect["height"] > 50
    assert browser.errors() == []
    assert browser.requests_outside() == []
    made.save(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text() == made.text


def test_the_command_writes_it_and_names_are_titles(tmp_path, capsys):
    from creeping.commands.body import title_of

    assert [title_of(text) for text in ("torus", "some/where/hull.stl", "x**2 +\n y**2 + z**2 - 1")] == [
        "torus",
        "hull.stl",
        "x**2 + y**2 + z**2 - 1",
    ]
    assert len(title_of("x + " * 100)) == 60
    with pytest.raises(SystemExit) as caught:
        arguments = ["--rays", "16", "--frequency", "1GHz", "--boundary", "pec", "--export", str(tmp_path / "a.html")]
        cli.main(["explore", "sphere", *arguments])
    page = (tmp_path / "a.html").read_text()
    assert "rays, rms" in capsys.readouterr().out and len(page) > 1e6
    assert caught.value.code == 0 and "<title>sphere</title>" in page and "1 GHz" in page and "dBsm" in page


@pytest.mark.slow
def test_a_body_with_joints_has_rays_and_a_cut():
    """Its field at points of the body is not known; that of each ray, and the far field, are."""
    from creeping.explorer.preview import preview_of, step_of
    from creeping.explorer.refined import refined_view

    body = sc.Capsule(0.4, 1.8)
    flow, request = cr.DirectFlow(body, rtol=1e-8), REQUEST.changed(rays=16, length=0.8, wavenumber=10.0)
    frame = preview_of(flow, request, step_of(body))
    for boundary in ("soft", "pec"):
        found = refined_view(
            flow, replace(frame, request=request.changed(boundary=boundary)), np.array([[0.4, 0.0, 0.1]])
        )
        # a conductor's current goes by modes, which no joint knows
        assert (found.body_levels is None) == (boundary == "pec") and len(found.far.total) == len(found.cut_angles)
    assert np.isfinite(frame.ray_segments).all()
