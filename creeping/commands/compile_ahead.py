"""The process that `creeping.kernels.first_use` starts: a small job compiles the kernels that its parent needs later.

Which these are is nowhere written down: the job is that of most users, on a sphere.
"""

import gc
import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any


def main(first: str, folder: str, digest: str) -> None:
    """Compile what a process needs that began with a kernel of the module ``first``; end when standard input does.

    One process at a time does so for a ``folder`` of compiled kernels; it notes there for which sources it is done.
    """
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # there is much of a compiler's, and it does not live long enough to be worth it
    gc.disable()
    from filelock import FileLock, Timeout

    from creeping.kernels.first_use import STAMP, is_done

    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    try:
        with FileLock(place / "ahead.lock", blocking=False):
            if not is_done(place, digest):
                for step in steps(first):
                    step()
                (place / STAMP).write_text(digest)
    except Timeout:
        return


def _end_with_parent() -> None:
    sys.stdin.buffer.read()
    # at once: a thread that compiles does not hear of anything gentler
    os._exit(0)


def steps(first: str) -> list[Callable[[], object]]:
    """Parts of the job, those that the parent comes to last first.

    But for rays, and the second half of their line: from its first half the parent comes to them whatever it does, and
    not so soon that they would be compiled twice.
    """
    import numpy as np

    import creeping as cr
    import scatterers as sc
    from creeping.geodesics.states import pack
    from creeping.shadow.many import shadow_lines
    from creeping.shadow.nodes import Breaks, LineNodes, shared

    body = sc.Sphere()
    directions = cr.fibonacci_directions(2)
    waves: dict[str, Any] = {"wavenumbers": [20.0], "boundary": ["hard"]}

    def rays() -> None:
        start = pack(np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]), lanes=12)
        cr.DirectFlow(body).transport(start, np.linspace(0.0, 1.0, 9))

    def arcs() -> None:
        turn = np.linspace(0.0, 2 * np.pi, 65)[:-1]
        x, T = np.array([np.cos(turn), np.sin(turn), 0 * turn]), np.array([-np.sin(turn), np.cos(turn), 0 * turn])
        circle = LineNodes(x, T, np.ones(64), np.array([0, 64]), np.array([2 * np.pi / 64]), 0.0)
        none = Breaks(np.empty(1), np.empty(1, np.int64), 0, (32, 0, 48, 16), True)
        shared(body, np.array([0.0, 0.0, 1.0]), circle, none, 16)

    def lines() -> None:
        shadow_lines(body, np.asarray(directions), 8)

    def sweeps() -> None:
        cr.sweep_directions(cr.DirectFlow(body), directions, **waves)
        cr.sweep_directions(cr.DirectFlow(body), directions, quantity="rays", n_rays=16)

    def one_incidence() -> None:
        fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, directions[0]), wavenumber=20.0, n_rays=16)
        cr.far_field(fan, directions, wavenumber=20.0, boundary="hard")

    def maps() -> None:
        cr.sweep_directions(cr.build_phase_map(body, tolerance=1e-3, cache=False), directions, **waves)

    if first.startswith("creeping.shadow"):
        return [rays, arcs, maps, sweeps, one_incidence]
    return [lines, sweeps, one_incidence, maps]
