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
    """Parts of the job, those that the parent comes to last first."""
    import numpy as np

    import creeping as cr
    import scatterers as sc
    from creeping.shadow.many import shadow_lines

    body = sc.Sphere()
    directions = cr.fibonacci_directions(2)
    waves: dict[str, Any] = {"wavenumbers": [20.0], "boundary": ["hard"]}

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
        return [maps, sweeps, one_incidence]
    return [lines, sweeps, one_incidence, maps]
