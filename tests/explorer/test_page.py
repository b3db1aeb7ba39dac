"""The page in a real browser: it loads, a slider moves the rays, nothing leaves the machine."""

from contextlib import ExitStack, contextmanager
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import urlsplit

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.explorer.frames import matrix_cut, preview_of
from creeping.explorer.panel import cut_svg
from creeping.explorer.request import ViewRequest
from tests.patience import HANGS, until

pytest.importorskip("viser")
BODY = sc.Ellipsoid(1.2, 0.8, 0.6)
REQUEST = ViewRequest(theta=50.0, phi=40.0, rays=64, length=2.0, spacing=0.25, wavenumber=10.0, boundary="hard")


@contextmanager
def explorer(body=BODY, request=REQUEST, port=8123, **more):
    from creeping.explorer.page import Explorer

    made = Explorer(cr.DirectFlow(body, rtol=1e-9), request, port=port, **more)
    try:
        yield made
    finally:
        made.close()


@pytest.fixture
def page(coarse):
    with explorer() as made:
        yield made


@pytest.fixture(scope="module")
def guarded():
    """A page that stays as it is: only its door is tried."""
    with explorer() as made:
        yield made


def rays_of(page, **values):
    """Segments of the rays by the engine, for the request with other values."""
    request = REQUEST.changed(**values)
    count = round(request.length / page.step)
    fan = preview_of(page.flow, request, page.step).fan
    assert len(fan.travel_time) == count + 1
    return np.stack([fan.points[:, :-1], fan.points[:, 1:]], axis=2).reshape(-1, 2, 3)


def refined_view(page):
    until(lambda: page.found.content, lambda: page.status.content)


@pytest.mark.slow
def test_rays_on_the_page_are_those_of_the_engine(page, browser):
    browser.open(page.address)
    first = rays_of(page)
    held = browser.segments(len(first))
    np.testing.assert_allclose(held, first, rtol=0, atol=1e-6)
    # a key on the slider of theta, as a hand would press it
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    slider = browser.driver.find_elements(By.CSS_SELECTOR, "[role=slider]")[0]
    slider.send_keys(Keys.ARROW_RIGHT * 5)
    until(lambda: page.request.theta != REQUEST.theta)

    def turned():
        held, theta = browser.segments(len(first)), page.request.theta
        return np.max(np.abs(held - first)) > 1e-3 and np.max(np.abs(held - rays_of(page, theta=theta))) < 1e-6

    until(turned, lambda: page.status.content)
    assert 50.0 < page.request.theta < 50.6
    page.player.show.value = "wave"
    until(lambda: "crest" in page.bar.content, lambda: page.status.content)
    wave = page._drawn[0].wave.segments
    np.testing.assert_allclose(browser.segments(len(wave)), wave, rtol=0, atol=1e-6)
    assert browser.errors() == []
    assert browser.requests_outside(urlsplit(page.address).netloc) == []


def test_the_wave_and_the_boundary_are_set_by_hand(page):
    def slide(name, value):
        page.sliders[name].value = value
        page._slid(name, SimpleNamespace(client=object(), target=page.sliders[name]))

    slide("boundary", "pec")
    assert page.request.boundary == "pec"
    slide("boundary", "impedance")
    assert page.request.boundary == "impedance:1"
    slide("eta", "0.5+0.2j")
    assert page.request.boundary == "impedance:0.5+0.2j"
    slide("eta", "wet")
    assert page.request.boundary == "impedance:0.5+0.2j" and page.sliders["eta"].value == "0.5+0.2j"
    slide("wavenumber", 42.0)
    assert page.request.wavenumber == 42.0


def test_the_arrow_turns_the_sliders_and_the_program_turns_nothing(page):
    event = SimpleNamespace(client=object(), target=page.scene.incidence)
    # a quarter turn about x takes +z to -y
    page.scene.incidence.wxyz = (np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0)
    page._dragged(event)
    assert (page.request.theta, page.request.phi) == pytest.approx((90.0, -90.0))
    assert (page.sliders["theta"].value, page.sliders["phi"].value) == pytest.approx((90.0, -90.0))
    event.client = None
    page.scene.incidence.wxyz = (1.0, 0.0, 0.0, 0.0)
    page._dragged(event)
    assert page.request.theta == pytest.approx(90.0)


def test_a_singular_incidence_is_named():
    with explorer(sc.Torus(), REQUEST.changed(theta=90.0, phi=0.0), 8140) as made:
        until(lambda: "crosses itself" in made.status.content, lambda: made.status.content)
    # nothing works on after the end
    assert not any(worker.is_alive() for worker in made._workers) and not made.player.is_alive()


def opened(page, *, origin=None, cookie=True, host=None):
    """Connection to the page as a browser makes it, or with what another would bring."""
    import viser
    from websockets.sync.client import connect

    port, token = page.server.get_port(), page.server.door.token
    headers = {"Cookie": f"creeping-{port}={token if cookie is True else cookie}"} if cookie else {}
    if host is not None:
        headers["Host"] = host
    protocol = [f"viser-v{viser.__version__}"]
    return connect(
        f"ws://127.0.0.1:{port}", origin=origin, subprotocols=protocol, max_size=None, additional_headers=headers
    )


STRANGERS = "http://a.example null http://[::1 http://127.0.0.1.a.example http://127.0.0.1:9999".split()


@pytest.mark.parametrize(
    "options",
    [*({"origin": one} for one in STRANGERS), {"host": "a.example"}, *({"cookie": c} for c in (None, "wrong", "ééé"))],
    ids=str,
)
def test_others_are_turned_away_before_the_upgrade(guarded, options):
    from websockets.exceptions import InvalidStatus

    with pytest.raises(InvalidStatus) as refused:
        opened(guarded, **options)
    assert refused.value.response.status_code == 403
    assert guarded.server.get_clients() == {}


@pytest.mark.parametrize("origin", ["http://127.0.0.1:8123", "http://localhost:8123", None])
def test_the_page_itself_is_let_in(guarded, origin):
    with opened(guarded, origin=origin) as socket:
        assert len(socket.recv(timeout=HANGS)) > 0


def test_the_files_of_the_page_ask_for_the_token(guarded):
    from urllib.error import HTTPError
    from urllib.request import Request, urlopen

    port, token = guarded.server.get_port(), guarded.server.door.token
    with pytest.raises(HTTPError, match="403"):
        urlopen(f"http://127.0.0.1:{port}/")
    with urlopen(guarded.address) as answer:
        cookie = answer.headers["Set-Cookie"]
    assert token in cookie and "HttpOnly" in cookie and "SameSite=Strict" in cookie
    with urlopen(Request(f"http://127.0.0.1:{port}/", headers={"Cookie": cookie.split(";")[0]})) as answer:
        assert answer.status == 200 and answer.headers["Set-Cookie"] is None


def test_no_command_line_has_the_token(monkeypatch):
    from creeping.commands import explore

    seen, closed = [], []

    class Page:
        def __init__(self, *_, **__):
            self.server, self.address = self, "http://127.0.0.1:8080/?token=secret&more"
            self.get_port, self.close = lambda: 8080, lambda: closed.append(True)

        def sleep_forever(self):
            file = Path(urlsplit(seen[0]).path)
            content = file.read_text()
            assert 'content="0; url=http://127.0.0.1:8080/?token=secret&amp;more"' in content
            assert (file.stat().st_mode & 0o777, file.parent.stat().st_mode & 0o777) == (0o600, 0o700)
            raise KeyboardInterrupt

    monkeypatch.setattr("creeping.explorer.page.Explorer", Page)
    monkeypatch.setattr("webbrowser.open", seen.append)
    assert explore._serve(None, None, 8080, "a body", True, print) == 0 and closed
    (asked,) = seen
    assert asked.startswith("file://") and "secret" not in asked and not Path(urlsplit(asked).path).exists()


@pytest.mark.slow
def test_only_so_many_pages_are_let_in(page):
    from websockets.exceptions import InvalidStatus

    from creeping.explorer.door import CLIENTS

    with ExitStack() as open_pages:
        for _ in range(CLIENTS):
            open_pages.enter_context(opened(page)).recv(timeout=HANGS)
        with pytest.raises(InvalidStatus):
            opened(page)


def test_nothing_is_shared_with_the_world(page, monkeypatch):
    import viser._tunnel

    asked = []
    monkeypatch.setattr(viser._tunnel.ViserTunnel, "__init__", lambda *a, **k: asked.append(a))
    assert page.server.get_host() == "127.0.0.1"
    assert page.server.request_share_url() is None and asked == []


@pytest.mark.slow
def test_a_refined_view_is_not_drawn_over_a_newer_frame(page, monkeypatch):
    from creeping.explorer import page as module

    refined_view(page)
    began, real = [], module.refined_text

    def late(found):
        # a newer request is drawn after the work was found good, and before it is drawn
        began.append(found.request.theta)
        if found.request.theta == 60.0:
            page.ask(theta=70.0)
            until(lambda: "theta 70.0" in page.status.content, lambda: page.status.content, pause=0.01)
        return real(found)

    monkeypatch.setattr(module, "refined_text", late)
    drawn = []
    monkeypatch.setattr(page.scene, "refine", lambda found, paint: drawn.append(found.request.theta))
    page.ask(theta=60.0)
    until(lambda: 70.0 in drawn)
    assert began[0] == 60.0 and 60.0 not in drawn


@pytest.mark.slow
def test_the_cut_follows_the_hand_by_the_t_matrix_once_it_is_made(page, monkeypatch):
    monkeypatch.setattr("creeping.explorer.frames.PATIENCE", 20.0)
    page.ask(wavenumber=3.0)
    until(lambda: "by the T-matrix" in page.cut.content, lambda: page.status.content)
    monkeypatch.setattr("creeping.explorer.frames.refined_view", lambda *_: None)
    before = page.cut.content
    page.ask(theta=77.0)
    angles = np.arange(-180.0, 181.0, 2.0)
    want = cut_svg(page.request, angles, matrix_cut(page.flow.body, page.request, angles))
    until(lambda: page.cut.content == want != before, lambda: page.status.content)


def test_iso_phase_curves_can_be_turned_off_and_a_refusal_resets_the_slider(page):
    slider = page.sliders["spacing"]
    assert slider.min == 0.0

    event = SimpleNamespace(client=object(), target=slider)
    slider.value = 1e-4
    page._slid("spacing", event)
    assert "curves" in page.status.content and slider.value == page.request.spacing == REQUEST.spacing
    slider.value = 0.0
    page._slid("spacing", event)
    assert page.request.spacing == 0.0
