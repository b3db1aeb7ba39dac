"""The page itself: controls, workers, and what the server lets in.

One worker follows the hand, from the latest request to the preview, another follows with the cut of the far field, and
a third follows up when no newer request has come. When the hand has rested a fourth makes the T-matrix of the wave, by
which the cut of every later incidence comes at once.
The server listens on the loopback address, behind `creeping.explorer.door`.

Also here: the latest request and nothing else: a queue of one place, so that work does not pile up behind a hand that
drags.

Also here: controls of what the colours show, the field's level or its wave, and the thread that lets the wave run.

The phase is omega t of Re(u e^{-i omega t}), as in the pictures of `creeping.plotting`.
"""

import html
import sys
import time
import traceback
from collections import deque
from collections.abc import Callable
from contextlib import redirect_stdout, suppress
from io import StringIO
from queue import SimpleQueue
from threading import Event, RLock, Thread
from typing import Generic, TypeVar

import numpy as np
import viser

from creeping._typing import Any
from creeping.errors import CreepingError
from creeping.explorer import frames
from creeping.explorer.door import Door
from creeping.explorer.frames import Preview, Refined
from creeping.explorer.panel import cut_svg, legend, plane_svg, preview_plane_svg, preview_text, refined_text, wave_note
from creeping.explorer.request import BOUNDARIES, RAYS, ViewRequest, angles, wave_scale
from creeping.explorer.scene import DrawnBody, Paint, Scene, Span, fitted_span, turned
from creeping.field.lit_ground import convex
from creeping.field.routes import expected_nodes
from creeping.geometry.evaluators import speed_of
from creeping.geometry.surface import size
from creeping.rays.transport import Flow

HOST = "127.0.0.1"
STEP = 30
"""Degrees between two pictures of a running wave."""
T = TypeVar("T")


class LocalServer(viser.ViserServer):  # type: ignore[misc]
    """A quiet server for this machine alone."""

    def __init__(self, port: int, name: str = "creeping") -> None:
        self.door = Door(lambda: len(self._websock_server._live_connections), name)
        # the address is shown by whoever starts it
        try:
            with redirect_stdout(StringIO()), self.door.installed():
                super().__init__(HOST, port, label=name, verbose=False)
        except CreepingError:
            self.stop()
            raise

    def stop(self) -> None:
        """End the server and its threads."""
        with redirect_stdout(StringIO()):
            super().stop()

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Give no address: a page may ask for a tunnel to the world, and gets none."""
        return None


class Explorer:
    """A running page.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
    request : ViewRequest
        What is shown first.
    port : int
        The next free one is taken if it is in use.
    name : str
        Of the body, the page's title.

    Attributes
    ----------
    seconds, cut_seconds : deque of float
        What the last frames took, from the request to the message, plane and numbers included; and the cuts
        that follow.
    """

    def __init__(self, flow: Flow, request: ViewRequest, *, port: int = 8080, name: str = "creeping") -> None:
        self.flow, self.request = flow, request
        self.model = DrawnBody.of(flow.body)
        self.step = frames.step_of(flow.body)
        # meshes of the line are made and kernels loaded before anybody looks
        with suppress(CreepingError):
            frames.preview_of(flow, request, self.step)
        self.seconds: deque[float] = deque(maxlen=1000)
        self.cut_seconds: deque[float] = deque(maxlen=1000)
        self._span: Span | None = None
        self._refined = 0
        self._drawn: tuple[Preview, Span, str] | None = None
        self._found: Refined | None = None
        self._asking, self._drawing = RLock(), RLock()
        self._requests: Latest[ViewRequest] = Latest()
        self._frames: Latest[tuple[Preview, int]] = Latest()
        self._cuts: Latest[tuple[Preview, int]] = Latest()
        self._waves: Latest[tuple[Preview, int]] = Latest()
        self.server = LocalServer(port, name)
        try:
            self.scene = Scene(self.server, self.model)
            self._controls()
            self.scene.look(request.direction)
            self.scene.turn(request.direction)
        except BaseException:
            self.server.stop()
            raise
        jobs = self._preview, self._follow, self._refine, self._solve
        self._workers = [Thread(target=work, daemon=True) for work in jobs]
        for worker in self._workers:
            worker.start()
        self._requests.put(request)

    @property
    def address(self) -> str:
        """Where a browser finds the page, with the token that lets it in."""
        return f"http://{HOST}:{self.server.get_port()}/?token={self.server.door.token}"

    def ask(self, **values: Any) -> bool:
        """Change the request; what is out of range is named on the page and changes nothing."""
        with self._asking:
            try:
                self.request = self.request.changed(**values)
            except CreepingError as error:
                self.status.content = error_text(error)
                return False
            self._requests.put(self.request)
            return True

    def close(self) -> None:
        """Stop the workers and the server."""
        for queue in (self._requests, self._frames, self._cuts, self._waves):
            queue.close()
        for worker in self._workers:
            worker.join(timeout=5.0)
        self.player.close()
        self.server.stop()

    def _controls(self) -> None:
        gui, request, extent = self.server.gui, self.request, size(self.flow.body)
        gui.configure_theme(show_share_button=False, show_logo=False, control_width="large")
        kind, _, eta = request.boundary.partition(":")
        self._eta = eta or "1"
        self.scale = wave_scale(request)
        values = (5 / extent, 400 / extent, request.wavenumber)
        wave = _range(*(value / self.scale.per_unit for value in values))
        sliders = {
            "theta": gui.add_slider("theta (degrees)", 0.0, 180.0, 0.1, request.theta, hint="Where the wave travels"),
            "phi": gui.add_slider("phi (degrees)", -180.0, 180.0, 0.1, request.phi),
            "wavenumber": gui.add_slider(self.scale.name, *wave, request.wavenumber / self.scale.per_unit),
            "boundary": gui.add_dropdown("boundary", BOUNDARIES, initial_value=kind),
            "eta": gui.add_text("impedance: eta", self._eta, hint="du/dn + i k eta u = 0, e.g. 0.5+0.2j"),
            "length": gui.add_slider(
                "length of rays", *_range(0.2 * extent, 6 * extent, request.length), request.length
            ),
            "rays": gui.add_slider("rays", RAYS[0], RAYS[1], 16, request.rays),
            "spacing": gui.add_slider("iso-phase spacing", *_range(0.0, extent, request.spacing), request.spacing),
            "cut": gui.add_slider("far-field cut, phi (degrees)", -180.0, 180.0, 1.0, request.cut),
        }
        self.sliders = sliders
        for name, handle in sliders.items():
            handle.on_update(lambda event, name=name: self._slid(name, event))
        self.scene.incidence.on_update(self._dragged)
        self.player = Player(gui, self._redraw, self._recolour)
        self.status = gui.add_markdown("")
        self.found = gui.add_markdown("")
        self.bar = gui.add_html("")
        self.plane = gui.add_html("")
        self.cut = gui.add_html("")

    def _slid(self, name: str, event: Any) -> None:
        # a value that the program sets, after the arrow was turned, is no new request
        if event.client is None:
            return
        with self._asking:
            if not self._wished(name, event.target.value):
                event.target.value = self._shown(name)
            elif name in ("theta", "phi"):
                self.scene.turn(self.request.direction)

    def _wished(self, name: str, value: Any) -> bool:
        """Ask for the value of a control; whether it can be had."""
        if name == "eta":
            if self.request.boundary.startswith("impedance") and not self.ask(boundary=f"impedance:{value}"):
                return False
            self._eta = value
            return True
        if name == "boundary" and value == "impedance":
            value = f"impedance:{self._eta}"
        if name == "wavenumber":
            value = value * self.scale.per_unit
        return self.ask(**{name: int(value) if name == "rays" else value})

    def _shown(self, name: str) -> Any:
        """Value of a control for the request as it is."""
        if name == "eta":
            return self._eta
        if name == "boundary":
            return self.request.boundary.partition(":")[0]
        value = getattr(self.request, name)
        return value / self.scale.per_unit if name == "wavenumber" else value

    def _dragged(self, event: Any) -> None:
        if event.client is None:
            return
        with self._asking:
            wxyz = np.asarray(event.target.wxyz, dtype=float)
            if not (np.all(np.isfinite(wxyz)) and np.linalg.norm(wxyz) > 0.5):
                return
            theta, phi = angles(turned(wxyz / np.linalg.norm(wxyz)))
            if self.ask(theta=theta, phi=phi):
                self.sliders["theta"].value, self.sliders["phi"].value = theta, phi

    def _preview(self) -> None:
        """Follow the hand."""
        frame = None
        while (taken := self._requests.take()) is not None:
            request, number = taken
            began = time.perf_counter()
            try:
                frame = frames.preview_of(self.flow, request, self.step)
                self._span = span = fitted_span(frame.levels, self._span)
                plane, text = preview_plane_svg(frame), preview_text(frame, time.perf_counter() - began, span)
                with self._drawing:
                    self._drawn, self._found = (frame, span, text), None
                    self._draw()
                    self.found.content, self.plane.content = "", plane
                self.seconds.append(time.perf_counter() - began)
            except Exception as error:
                self.status.content = error_text(error)
            if frame is not None:
                # after a request that failed the last frame is still the one on the page, and may be refined
                self._frames.put((frame, number))
                self._cuts.put((frame, number))

    def _draw(self) -> None:
        """Draw the last frame as level or wave; where the wave cannot be had, the level, and say so."""
        assert self._drawn is not None
        frame, span, text = self._drawn
        asked = self.player.phase
        phase = asked if asked is not None and frame.wave is not None else None
        self.scene.show(frame, span, phase)
        bar = legend(frame, span, wave=phase is not None)
        # what has not changed is not sent again
        if bar != self.bar.content:
            self.bar.content = bar
        on_body = self.scene.shows_wave_on_body(frame.request.wavenumber)
        note = "" if asked is None else wave_note(frame, on_body)
        self.status.content = f"{text}\n\n**{note}**" if note else text

    def _redraw(self) -> None:
        """Draw the last frame and what has followed it once more, after level or wave was chosen."""
        with self._drawing:
            if self._drawn is None:
                return
            self._draw()
            if self._found is not None:
                self.scene.refine(self._found, self._body_paint(self._found))

    def _recolour(self) -> None:
        """Turn the wave to the phase of the moment."""
        with self._drawing:
            phase = self.player.phase
            if phase is not None:
                self.scene.recolour(phase)

    def _body_paint(self, found: Refined) -> Paint | None:
        """The body as the last frame is shown."""
        assert self._drawn is not None
        frame, span, _ = self._drawn
        return self.scene.painted_mesh(found, span, self.player.phase if frame.wave is not None else None)

    def _follow(self) -> None:
        """Let the far-field cut follow the frames, at a pace of its own: it takes longer than they do."""
        while (taken := self._cuts.take()) is not None:
            (frame, number), _ = taken
            request, began, pace = frame.request, time.perf_counter(), 0.25
            try:
                angles = np.arange(-180.0, 181.0, frames.CUT_STEP)
                if (exact := frames.matrix_cut(self.flow.body, request, angles)) is not None:
                    cut, pace = cut_svg(request, angles, exact), 0.0
                else:
                    # of more nodes a cut takes more than half a second, and waits until the hand rests
                    if speed_of(self.flow.body) is not None or not len(frame.fan.points):
                        continue
                    if expected_nodes(frame.fan, request.wavenumber) >= 60_000:
                        continue
                    # currents of a body that faces itself take seconds
                    method = "auto" if convex(frame.fan) else "rays"
                    # while the hand moves the step is coarser
                    angles = np.arange(-180.0, 181.0, 2 * frames.CUT_STEP)
                    cut = cut_svg(request, angles, frames.far_cut(frame.fan, request, angles, method))
                self.cut_seconds.append(time.perf_counter() - began)
                with self._drawing:
                    # the refined cut of this request, if it came first, is the better one
                    if self._refined < number:
                        self.cut.content = cut
            except CreepingError:
                # the refined view says what is wrong
                continue
            except Exception as error:
                self.status.content = error_text(error)
            # the hand comes first: as long a rest as the work took
            time.sleep(max(pace, time.perf_counter() - began))

    def _solve(self) -> None:
        """Make the T-matrix of the wave on which the hand has rested, and follow up once more by it."""
        while (taken := self._waves.take()) is not None:
            (frame, number), _ = taken
            with suppress(CreepingError):
                if frames.made_matrix(self.flow.body, frame.request):
                    self._frames.put((frame, number))

    def _refine(self) -> None:
        """Follow up when the hand rests."""
        while (taken := self._frames.take()) is not None:
            (frame, number), _ = taken

            def stale(number: int = number) -> bool:
                return self._requests.closed or self._requests.number != number

            # the hand rests before work begins that would hold up its next move
            time.sleep(0.4)
            try:
                found = None if stale() else frames.refined_view(self.flow, frame, self.model.mesh.vertices, stale)
                if found is None:
                    continue
                text, plane = refined_text(found), plane_svg(found)
                cut = cut_svg(found.request, found.cut_angles, found.far)
                with self._drawing:
                    # a frame that was shown meanwhile is newer than this
                    if not stale():
                        self._refined, self._found = number, found
                        self.scene.refine(found, self._body_paint(found))
                        self.found.content, self.plane.content, self.cut.content = text, plane, cut
                        self._waves.put((frame, number))
            except Exception as error:
                with self._drawing:
                    self.found.content, self.plane.content, self.cut.content = error_text(error), "", ""


def error_text(error: Exception) -> str:
    """Words of an error for the page; one that is not ours goes to the terminal in full, and the page lives on."""
    if not isinstance(error, CreepingError):
        traceback.print_exception(error, file=sys.stderr)
        return f"**this incidence failed: {html.escape(repr(error))}**"
    return f"**{html.escape(str(error))}**"


def _range(low: float, high: float, value: float) -> tuple[float, float, float]:
    """Least, most and step of a slider that reaches the value."""
    step = float(10.0 ** np.floor(np.log10((high - low) / 200)))
    low, high = min(low, value), max(high, value)
    return step * np.floor(low / step), step * np.ceil(high / step), step


class Latest(Generic[T]):
    """Hands the latest value put in to one reader; values it had no time for are dropped.

    Attributes
    ----------
    number : int
        Values put in so far.
    closed : bool
        Whether `close` was called.
    """

    def __init__(self) -> None:
        self.number, self.closed = 0, False
        self._waiting: SimpleQueue[tuple[T, int] | None] = SimpleQueue()

    def put(self, value: T) -> None:
        """Replace what is waiting."""
        self.number += 1
        self._waiting.put((value, self.number))

    def close(self) -> None:
        """Let the reader go."""
        self.closed = True
        self._waiting.put(None)

    def take(self) -> tuple[T, int] | None:
        """Wait for a value not yet taken, and its number; None once closed."""
        found = None if self.closed else self._waiting.get()
        while not self._waiting.empty():
            found = self._waiting.get()
        return None if self.closed else found


class Player:
    """The controls, and a thread that advances the phase while ``play`` is on.

    Parameters
    ----------
    gui : viser.GuiApi
    redraw : callable
        Called when level or wave was chosen.
    recolour : callable
        Called when the phase has changed.
    """

    def __init__(self, gui: Any, redraw: Callable[[], None], recolour: Callable[[], None]) -> None:
        self._redraw, self._recolour = redraw, recolour
        self.show = gui.add_dropdown(
            "show", ("level", "wave"), initial_value="level", hint="20 log10 |u|, or Re(u e^(-i omega t))"
        )
        self.slider = gui.add_slider("phase, omega t (degrees)", 0, 360, STEP // 6, 0, disabled=True)
        self.play = gui.add_checkbox("play", False, disabled=True, hint="Let the wave run")
        self._playing, self._closed = Event(), Event()
        self.show.on_update(lambda _: self._chosen())
        self.slider.on_update(self._slid)
        self.play.on_update(lambda _: self._switched())
        self._worker = Thread(target=self._run, daemon=True)
        self._worker.start()

    @property
    def phase(self) -> float | None:
        """omega t, radians; None while the level is shown."""
        return None if self.show.value == "level" else float(np.radians(self.slider.value))

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._playing.set()
        self._worker.join(timeout=5.0)

    def is_alive(self) -> bool:
        """Whether the thread works."""
        return self._worker.is_alive()

    def _chosen(self) -> None:
        level = self.show.value == "level"
        self.slider.disabled = self.play.disabled = level
        self._switched()
        self._redraw()

    def _slid(self, event: Any) -> None:
        # the thread sets the slider, too
        if event.client is not None and self.phase is not None:
            self._recolour()

    def _switched(self) -> None:
        if self.play.value and self.phase is not None:
            self._playing.set()
        else:
            self._playing.clear()

    def _run(self) -> None:
        took = 0.0
        # 0.15 s between two pictures at least, and as long a rest as their making took
        while self._playing.wait() and not self._closed.wait(max(0.15, took)):
            if not self._playing.is_set():
                continue
            began = time.perf_counter()
            self.slider.value = (self.slider.value + STEP) % 360
            self._recolour()
            took = time.perf_counter() - began
