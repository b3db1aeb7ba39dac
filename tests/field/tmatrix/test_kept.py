"""T-matrices with a store: ended at any moment, they go on, and come to the same bits."""

import numpy as np
import pytest
import shared_bodies as sc
from ended import ending_at, killed, stamps

import creeping as cr
from creeping.field.tmatrix import computing, solved_waves
from creeping.storage import folder as folders
from creeping.storage.parts import Parts

ASKED = {"wavenumber": 2.0, "boundary": "soft"}


def small(monkeypatch):
    """Many blocks of columns of a small matrix."""
    monkeypatch.setattr(solved_waves, "COLUMNS", 2)
    return sc.Ellipsoid(0.5, 0.6, 1.0)


@pytest.mark.parametrize("direct", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_interrupted_at_random_moments_it_comes_to_the_same_bits(tmp_path, monkeypatch, direct):
    body, rng = small(monkeypatch), np.random.default_rng(5)
    if not direct:
        monkeypatch.setattr(computing, "DENSE", 0.0)
        monkeypatch.setattr("creeping.field.equation.columns.TOGETHER", 5e6)
    asked = ASKED | {"order": 3}
    expected = cr.t_matrix(body, **asked)
    # called of each array that is written, before its part is there, and of each that is read
    with ending_at(folders, "_digest", 0) as calls:
        cr.t_matrix(body, store=tmp_path / "whole", **asked)
    ends = begun = 0
    while ends < 4:
        folder, found = tmp_path / str(begun), None
        begun += 1
        while found is None:
            before = stamps(folder, "*/*/manifest.json")
            with ending_at(folders, "_digest", rng.integers(1, calls[0]) if ends < 4 else 0):
                found = cr.t_matrix(body, store=folder, **asked)
            if found is None:
                ends += 1
                assert before.items() <= stamps(folder, "*/*/manifest.json").items()
        assert found.matrix.tobytes() == expected.matrix.tobytes() and found.extinction == expected.extinction
        # parts of what is whole are removed
        assert [path.parent.name for path in folder.glob("*/*/manifest.json")] == ["matrix"]


def test_what_is_stored_is_not_computed_again(tmp_path, monkeypatch):
    body = sc.Sphere()
    first = cr.t_matrix(body, store=tmp_path, **ASKED)
    monkeypatch.setattr(computing, "_computed", None)
    again = cr.t_matrix(body, store=tmp_path, **ASKED)
    assert np.array_equal(first.matrix, again.matrix) and repr(first) == repr(again)
    # another body, wavenumber, boundary or order is another matrix
    for other in (ASKED | {"wavenumber": 2.1}, ASKED | {"boundary": "hard"}, ASKED | {"order": 4}):
        with pytest.raises(TypeError):
            cr.t_matrix(body, store=tmp_path, **other)
    with pytest.raises(TypeError):
        cr.t_matrix(sc.Sphere(1.1), store=tmp_path, **ASKED)


def test_damaged_parts_are_computed_anew(tmp_path):
    parts = Parts(tmp_path, {"of": "a test"})
    values = np.arange(3.0) + 1j
    assert parts("a", lambda: {"x": values})["x"] is values
    assert np.array_equal(parts("a", lambda: {})["x"], values)
    for name in ("x.npy", "manifest.json"):
        file = parts.folder / "a" / name
        file.write_bytes(file.read_bytes()[:-3])
        assert np.array_equal(parts("a", lambda: {"x": values})["x"], values)
        assert np.array_equal(parts("a", lambda: {})["x"], values)


def test_a_boundary_that_varies_has_no_store(tmp_path):
    coating = cr.ImpedanceBoundary(sc.Coating("0.5 + 0.1*z"))
    with pytest.raises(cr.InvalidInputError, match="varies"):
        cr.t_matrix(sc.Sphere(), wavenumber=2.0, boundary=coating, store=tmp_path)


CODE = """
import creeping as cr, scatterers as sc
from creeping.field.tmatrix import solved_waves
solved_waves.COLUMNS = 8
cr.t_matrix(sc.Ellipsoid(0.5, 0.6, 1.0), wavenumber=6.0, boundary="pec", store={folder!r})
"""


@pytest.mark.slow
def test_killed_20_times_it_loses_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(solved_waves, "COLUMNS", 8)
    body, rng = sc.Ellipsoid(0.5, 0.6, 1.0), np.random.default_rng(11)
    expected = cr.t_matrix(body, wavenumber=6.0, boundary="pec")
    kills, begun = 0, 0
    while kills < 20:
        folder = tmp_path / str(begun)
        begun += 1
        done = False
        while not done and kills < 20:
            before = stamps(folder, "*/*/manifest.json")
            done = killed(CODE.format(folder=str(folder)), rng.uniform(0.0, 1.0), lambda: any(folder.glob("*/*")))  # noqa: B023
            kills += not done
            assert done or before.items() <= stamps(folder, "*/*/manifest.json").items()
        found = cr.t_matrix(body, wavenumber=6.0, boundary="pec", store=folder)
        assert found.matrix.tobytes() == expected.matrix.tobytes()
