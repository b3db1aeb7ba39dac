"""Says once that kernels are compiled, which the first call on a machine waits for. Part of the command line."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any


@contextmanager
def told_of_compilation(progress: Callable[[str], None]) -> Iterator[None]:
    """Call ``progress`` when the first kernel is compiled in the block; loading compiled ones is not told."""
    from numba.core import event as events

    class Listener(events.Listener):  # type: ignore[misc]
        told = False

        def on_start(self, event: Any) -> None:
            if not self.told:
                self.told = True
                progress("compiling kernels, once for this machine: up to a minute")

        def on_end(self, event: Any) -> None:
            pass

    with events.install_listener("numba:compile", Listener()):
        yield
