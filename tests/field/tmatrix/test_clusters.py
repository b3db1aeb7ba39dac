"""Clusters by treams and acoustotreams, as the page of sweeps shows them, against two bodies solved directly."""

import re
from pathlib import Path

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.field.results.far_result import spherical_frame

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default::DeprecationWarning")]
PAGE = Path(__file__).parents[3] / "studies" / "gallery" / "pages" / "sweeps.md"


def shown(package):
    """Names that the page's example with a package leaves."""
    pytest.importorskip(package, exc_type=ImportError)
    (code,) = re.findall(rf"```python\n(import {package}\b.*?)```", PAGE.read_text(), re.DOTALL)
    names = {}
    exec(code, names)
    return names


def solved(names, boundary):
    bodies = sc.Bodies(names["bodies"], at=names["places"])
    return cr.solve(bodies, names["d"], wavenumber=names["k"], boundary=boundary).far_field(names["r"]).total


def test_sound_of_two_bodies():
    names = shown("acoustotreams")
    f, want = np.array(names["f"]), solved(names, "hard")
    assert np.abs(f - want).max() < 1e-4 * np.abs(want).max()


def test_two_conductors(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = shown("treams")
    E, E0 = np.array(names["f"]).reshape(-1, 3), np.array(names["E0"]).ravel()
    seen = np.einsum("nox,noi->nxi", spherical_frame(names["r"]), solved(names, "pec"))
    want = seen @ (spherical_frame(names["d"]) @ E0)
    assert np.abs(E - want).max() < 1e-4 * np.abs(want).max()
