"""The page that needs no server."""

import re

import pytest
import trimesh

import creeping as cr
import scatterers as sc
from creeping.commands import main as cli
from creeping.commands.options import title_of
from creeping.explorer.request import ViewRequest

pytest.importorskip("viser")
BODY = sc.Ellipsoid(1.2, 0.8, 0.6)
REQUEST = ViewRequest(theta=50.0, phi=40.0, rays=16, length=1.0, spacing=0.25, wavenumber=30.0, boundary="soft")


def written(path, body=BODY, request=REQUEST):
    from creeping.explorer.notebook import Page, page_of

    text, found = page_of(cr.DirectFlow(body, rtol=1e-9), request, repr(body))
    Page(text, "").save(path)
    return found


@pytest.mark.slow
def test_the_page_holds_its_numbers_and_loads_nothing(tmp_path, coarse):
    class Named(sc.Ellipsoid):
        def __repr__(self):
            return "<script>alert(1)</script>" + super().__repr__()

    found = written(tmp_path / "page.html", Named(1.2, 0.8, 0.6))
    page = (tmp_path / "page.html").read_text()
    assert f"length {found.line.length:.8g} L" in page and "(a=1.2, b=0.8, c=0.6" in page
    assert not re.search(r"<(script|link|img|iframe)[^>]+(src|href)=[\"']?https?:", page)
    assert "<script>alert(1)" not in page


def test_trouble_writes_nothing(tmp_path, monkeypatch):
    with pytest.raises(cr.SingularIncidenceError):
        written(tmp_path / "page.html", sc.Torus(), REQUEST.changed(theta=90.0, phi=0.0))
    monkeypatch.setattr("creeping.explorer.notebook.page_of", lambda *_: ("page", None))
    with pytest.raises(cr.CreepingError):
        written(tmp_path / "no" / "such" / "folder" / "page.html")
    assert list(tmp_path.iterdir()) == []


BAD = "--rays 8,--direction 0 0 0,--boundary wet,--wavenumber 20 --frequency 1GHz,--frequency 1:2:1GHz"
BAD += ",--sound-speed -1 --frequency 38kHz,--length nan"


@pytest.mark.parametrize("arguments", BAD.split(","))
def test_the_command_refuses(arguments, tmp_path, capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(["explore", "sphere", *arguments.split(), "--export", str(tmp_path / "page.html")])
    assert caught.value.code == 3 and list(tmp_path.iterdir()) == []


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
    assert title_of("some/where/hull.stl") == "hull.stl" and len(title_of("x + " * 100)) == 40
    with pytest.raises(SystemExit) as caught:
        arguments = ["--rays", "16", "--frequency", "1GHz", "--boundary", "pec", "--export", str(tmp_path / "a.html")]
        cli.main(["explore", "sphere", *arguments])
    page = (tmp_path / "a.html").read_text()
    assert "rays, rms" in capsys.readouterr().out and len(page) > 1e6
    assert caught.value.code == 0 and "<title>sphere</title>" in page and "1 GHz" in page and "dBsm" in page


def test_a_body_of_facets_is_refused_in_words(tmp_path, capsys):
    trimesh.creation.box((1.0, 1.0, 2.0)).export(tmp_path / "box.stl")
    with pytest.raises(SystemExit) as end:
        cli.main(["explore", str(tmp_path / "box.stl"), "--units", "m", "--surface", "facets", "--wavenumber", "4"])
    assert end.value.code == 3 and "no creeping rays on this body" in capsys.readouterr().err
