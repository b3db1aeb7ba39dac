"""Work that is ended at random moments and begun again until it is done; what was stored is never stored anew."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from tests.patience import HANGS

ROOT = Path(__file__).parents[1]


@contextmanager
def ending_at(owner, name, number, with_signal=signal.SIGINT):
    """Send this process a signal before a function is called for the number-th time; SIGTERM interrupts too.

    At any moment at all only a process of its own can be ended: compilers and event loops that are interrupted are of
    no use after that. Yields the number of calls so far, in a list.
    """

    def interrupt(*_):
        raise KeyboardInterrupt

    calls, real = [0], getattr(owner, name)

    def counted(*arguments, **options):
        calls[0] += 1
        if calls[0] == number:
            signal.raise_signal(with_signal)
        return real(*arguments, **options)

    before = {one: signal.signal(one, interrupt) for one in (signal.SIGINT, signal.SIGTERM)}
    setattr(owner, name, counted)
    try:
        yield calls
    except KeyboardInterrupt:
        pass
    finally:
        setattr(owner, name, real)
        for one, handler in before.items():
            signal.signal(one, handler)


def killed(code, after, is_begun=lambda: True):
    """Run Python code and kill -9 it some seconds after it has begun; whether it was done before."""
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'tests'}"},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    end = time.monotonic() + HANGS
    while not is_begun() and process.poll() is None:
        assert time.monotonic() < end
        time.sleep(0.002)
    try:
        process.wait(timeout=after)
    except subprocess.TimeoutExpired:
        process.kill()
    _, err = process.communicate()
    assert process.returncode in (0, -signal.SIGKILL), err
    return process.returncode == 0


def stamps(folder, pattern):
    """Times at which files of a folder were written, by their paths."""
    return {path: path.stat().st_mtime_ns for path in folder.glob(pattern)}
