"""Waiting for what happens elsewhere: how long is no figure of any test, only that nothing waits for ever."""

import time

HANGS = 600.0
"""Seconds after which what has not happened never will, on the slowest machine with all kernels to compile."""


def until(condition, said=lambda: "", pause=0.05):
    """Wait for a condition; ``said()`` tells what stood there instead."""
    end = time.monotonic() + HANGS
    while not condition():
        assert time.monotonic() < end, said()
        time.sleep(pause)
