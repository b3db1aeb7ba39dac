"""Controls of what the colours show, the field's level or its wave, and the thread that lets the wave run.

The phase is omega t of Re(u e^{-i omega t}), as in the pictures of `creeping.plotting`.
"""

import time
from collections.abc import Callable
from threading import Event, Thread

import numpy as np

from creeping._typing import Any

SHOWS = ("level", "wave")
STEP = 30
"""Degrees between two pictures of a running wave."""
PACE = 0.15
"""Seconds between them at least; they take as long a rest as their making took."""


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
            "show", SHOWS, initial_value=SHOWS[0], hint="20 log10 |u|, or Re(u e^(-i omega t))"
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
        while self._playing.wait() and not self._closed.wait(max(PACE, took)):
            if not self._playing.is_set():
                continue
            began = time.perf_counter()
            self.slider.value = (self.slider.value + STEP) % 360
            self._recolour()
            took = time.perf_counter() - began
