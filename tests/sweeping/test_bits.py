"""Equal bits, whether a process compiles its kernels or loads them."""

import os
import subprocess
import sys

import pytest

SWEEPS = """
import hashlib
import creeping as cr
import scatterers as sc
directions = cr.fibonacci_directions(5)
body = sc.TwistedEllipsoid()
asked = {"rays": {"n_steps": 2}, "monostatic": {"wavenumbers": [20.0], "boundary": ["soft", "pec"]}}
for flow in (cr.DirectFlow(body, rtol=1e-7), cr.build_phase_map(body, horizon=0.5, grid=(20, 28), cache=False)):
    for quantity, more in asked.items():
        ds = cr.sweep_directions(flow, directions, quantity=quantity, length=2.0, n_rays=64, **more)
        for name in sorted(ds):
            print(type(flow).__name__, quantity, name, hashlib.sha256(ds[name].values.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_a_process_that_compiles_gives_what_one_that_loads_gives(tmp_path):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    results = []
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", SWEEPS], env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        results.append(done.stdout.splitlines())
    compiles, loads = results
    assert len(loads) > 40
    assert compiles == loads
