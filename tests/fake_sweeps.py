"""A sweeper that is quick and exact, and misbehaves on request: for tests of the machinery around it."""

import os
import time
from functools import partial
from pathlib import Path

import numpy as np
import shared_bodies as sc

import creeping as cr
from creeping.geometry.directions import fibonacci_directions
from creeping.shadow.status import LineStatus
from creeping.sweeping.plan import SweepPlan
from creeping.sweeping.request import sweep_request

REQUEST = sweep_request("monostatic", length=1.0, n_rays=4, wavenumbers=[10.0, 20.0], boundary="soft")
FLOW = cr.DirectFlow(sc.Sphere(), rtol=1e-6)


class FakeSweeper:
    """Fills the arrays with functions of the incidence; what it does besides is set by the environment.

    FAKE_DIARY names a folder in which each call leaves a file: the test counts them. FAKE_SECONDS is the time of an
    incidence. FAKE_RAISES and FAKE_DIES are values of d_z, to 1e-9, at which it raises or its process dies.
    """

    def __init__(self, flow, request):
        self.flow, self.request = flow, request
        self.passed, self.store = lambda _: None, None

    @property
    def body(self):
        return self.flow.body

    def __call__(self, incidences):
        diary = os.environ.get("FAKE_DIARY")
        if diary:
            name = f"{len(os.listdir(diary)):06d}-{os.getpid()}-{len(incidences)}-{incidences[0, 2]:.9f}"
            Path(diary, name).touch()
        time.sleep(float(os.environ.get("FAKE_SECONDS", "0")) * len(incidences))
        z = incidences[:, 2]
        if any(np.any(np.abs(z - float(v)) < 1e-9) for v in os.environ.get("FAKE_DIES", "").split()):
            os._exit(7)
        if any(np.any(np.abs(z - float(v)) < 1e-9) for v in os.environ.get("FAKE_RAISES", "").split()):
            raise ArithmeticError("a poisonous incidence")
        out = self.request.empty(len(incidences))
        out["incidence_status"][:] = LineStatus.OK
        out["line_length"][:] = 2 * np.pi + z
        k = np.array(self.request.wavenumbers)
        out["total"][:] = out["creeping"][:] = np.exp(1j * k * z[:, None, None])
        out["unresolved"][:] = False
        return out


def plan(count=40, chunk=4, **options):
    """A plan whose results are known: see `creeping_of`."""
    return SweepPlan(FLOW, REQUEST, fibonacci_directions(count), chunk, make=FakeSweeper, **options)


def creeping_of(count):
    """Expected values (count, boundary, wavenumber)."""
    return np.exp(1j * np.array([10.0, 20.0]) * fibonacci_directions(count)[:, 2][:, None, None])


def bytes_of(folder):
    """Bytes of all files of a store by path, but its lock."""
    files = (p for p in sorted(folder.rglob("*")) if p.is_file() and p.suffix != ".partial" and p.name != ".lock")
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in files}


def drive(folder, count, chunk, workers):
    """A driver for tests that kill it: fills a new store, or an old one, and prints as it goes."""
    from creeping.sweeping.run import fill, open_store

    work = plan(count, chunk)
    store = open_store(work, folder, resume=True)
    say = partial(print, flush=True)
    if not workers:
        fill(work, store, progress=say)
        return
    from creeping.sweeping.cluster import local_client

    with local_client(workers) as client:
        fill(work, store, client=client, progress=say)
