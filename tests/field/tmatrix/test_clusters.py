"""Clusters by treams and acoustotreams against two bodies solved directly."""

import re
from pathlib import Path

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.results.far_result import spherical_frame

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default::DeprecationWarning")]
PAGE = Path(__file__).parents[3] / "studies" / "gallery" / "pages" / "sweeps.md"


def solved(names, boundary):
    bodies = sc.Bodies(names["bodies"], at=names["places"])
    return cr.solve(bodies, names["d"], wavenumber=names["k"], boundary=boundary).far_field(names["r"]).total


def test_sound_of_two_bodies():
    """By acoustotreams, as the page of sweeps has it."""
    pytest.importorskip("acoustotreams", exc_type=ImportError)
    (code,) = re.findall(r"```python\n(import acoustotreams\b.*?)```", PAGE.read_text(), re.DOTALL)
    names = {}
    exec(code, names)
    f, want = np.array(names["f"]), solved(names, "hard")
    assert np.abs(f - want).max() < 1e-4 * np.abs(want).max()


def test_two_conductors(tmp_path):
    """By treams, from files of T-matrices."""
    treams = pytest.importorskip("treams", exc_type=ImportError)
    io = pytest.importorskip("treams.io", exc_type=ImportError)
    k, d, r, R = 3.0, np.array([0.48, 0.6, 0.64]), cr.fibonacci_directions(20), 1e6
    bodies, places = [sc.Ellipsoid(0.5, 0.4, 0.3), sc.Cylinder(0.4, 0.6)], [[0, 0, -0.8], [0.1, 0, 0.9]]
    each = []
    for number, body in enumerate(bodies):
        path = tmp_path / f"{number}.tmat.h5"
        cr.t_matrix(body, wavenumber=k, boundary="pec", order=9).save(path)
        each.append(io.load_hdf5(path, lunit="m"))
    cluster = treams.TMatrix.cluster(each, places).interaction.solve()
    wave = treams.plane_wave(k * d, 1, k0=k, poltype="parity")
    scattered = cluster @ wave.expand(cluster.basis, "regular")
    E = np.array([R * np.exp(-1j * k * R) * scattered.efield(R * x) for x in r]).reshape(-1, 3)
    names = {"bodies": bodies, "places": places, "d": d, "k": k, "r": r}
    seen = np.einsum("nox,noi->nxi", spherical_frame(r), solved(names, "pec"))
    want = seen @ (spherical_frame(d) @ wave.efield([0, 0, 0]).ravel())
    assert np.abs(E - want).max() < 1e-4 * np.abs(want).max()
