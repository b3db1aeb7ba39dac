"""Far fields as CSV and as FEKO text, read back."""

import csv

import numpy as np
import pytest

from creeping import InvalidInputError
from creeping.field.results.far_result import FarField
from creeping.files import read_ffe, write_csv, write_ffe
from creeping.files.ffe import grid_directions
from creeping.files.tables import angles_of

THETA, PHI = np.linspace(0, np.pi, 5), np.linspace(0, 2 * np.pi, 4)


def far_of(directions, vector, seed=3):
    """A FarField of random numbers."""
    rng = np.random.default_rng(seed)
    shape = (len(directions), 2, 2) if vector else (len(directions),)
    names = ("creeping", "reflected", "forward")
    parts = {name: rng.normal(size=shape) + 1j * rng.normal(size=shape) for name in names}
    total = sum(parts.values())
    method = np.array(["rays", "rays+fan"] * len(directions))[: len(directions)]
    lost = np.arange(len(directions)) == 1
    return FarField(directions, total, parts, method, lost, np.zeros(shape), "", 20.0, "pec" if vector else "hard", 2)


def test_csv_of_a_scalar_field(tmp_path):
    far = far_of(grid_directions(THETA, PHI), vector=False)
    write_csv(tmp_path / "far.csv", far=far)
    lines = (tmp_path / "far.csv").read_text(encoding="ascii").splitlines()
    notes = [line for line in lines if line.startswith("#")]
    rows = list(csv.DictReader(lines[len(notes) :]))
    assert len(notes) == len(rows[0])
    assert any("k = 20.0 1/L, hard boundary" in note for note in notes)
    column = {name: [row[name] for row in rows] for name in rows[0]}
    values = {n: np.array(v, dtype=float) for n, v in column.items() if n != "method"}
    np.testing.assert_array_equal(values["re"] + 1j * values["im"], far.total)
    np.testing.assert_array_equal(values["reflected_re"] + 1j * values["reflected_im"], far.reflected)
    np.testing.assert_allclose(10 ** (values["dB"] / 20), np.abs(far.total))
    np.testing.assert_array_equal(np.stack([values[n] for n in "xyz"], axis=-1), far.directions)
    np.testing.assert_allclose(values["theta"], np.repeat(np.degrees(THETA), 4), atol=1e-12)
    assert column["method"] == far.method.tolist()
    assert np.flatnonzero(values["unresolved"]).tolist() == [1]


def test_csv_of_a_vector_field(tmp_path):
    far = far_of(grid_directions(THETA, PHI), vector=True)
    write_csv(tmp_path / "far.csv", far=far)
    rows = list(csv.DictReader(x for x in (tmp_path / "far.csv").read_text().splitlines() if x[0] != "#"))
    for suffix, at in {"tt": (0, 0), "tp": (0, 1), "pt": (1, 0), "pp": (1, 1)}.items():
        read = [complex(float(row[f"re_{suffix}"]), float(row[f"im_{suffix}"])) for row in rows]
        np.testing.assert_array_equal(read, far.total[(slice(None), *at)])


def test_angles_stay_in_range():
    tiny = np.array([[1.0, -1e-18, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]])
    np.testing.assert_allclose(angles_of(tiny), [[np.pi / 2, 0], [np.pi, 0], [np.pi / 2, 1.5 * np.pi]])


def test_ffe_of_a_scalar_field_is_conjugated(tmp_path):
    far = far_of(grid_directions(THETA, PHI), vector=False)
    write_ffe(tmp_path / "far.ffe", far, THETA, PHI, direction=(1, 0, 0))
    text = (tmp_path / "far.ffe").read_text()
    assert text.startswith("##File Type: Far field\n##File Format: 8\n")
    assert "SCALAR" in text and "exp(+jwt)" in text and "unresolved in 1 of 20 directions" in text
    (block,) = read_ffe(tmp_path / "far.ffe")
    # where it comes from
    assert block.keys["Incident Wave Direction"] == "(90, 180)" and block.keys["Result Type"] == "RCS"
    assert block.wavenumber == pytest.approx(20.0)
    # theta runs first
    np.testing.assert_allclose(np.radians(block.theta), np.tile(THETA, 4))
    np.testing.assert_allclose(np.radians(block.phi), np.repeat(PHI, 5))
    np.testing.assert_array_equal(block.field[:, 0], far.total.reshape(5, 4).T.ravel())
    np.testing.assert_array_equal(block.field[:, 1], 0)
    # the numbers as they stand
    rows = np.loadtxt(tmp_path / "far.ffe", comments=("#", "*")).reshape(4, 5, 9).swapaxes(0, 1).reshape(20, 9)
    np.testing.assert_array_equal(rows[:, 2] + 1j * rows[:, 3], np.conj(far.total))
    np.testing.assert_allclose(rows[:, 8], far.cross_section)


@pytest.mark.parametrize(
    ("spoil", "match"),
    [
        (lambda far: (far, THETA[:-1], PHI), "the far field has 20 directions, a grid of 4 theta by 4 phi"),
        (lambda far: (far, THETA + 1e-3, PHI), "20 of 20 directions are not on it .worst: row"),
        (lambda far: (far, THETA * np.nan, PHI), "of finite radians"),
    ],
)
def test_ffe_wants_a_grid(tmp_path, spoil, match):
    far = far_of(grid_directions(THETA, PHI), vector=False)
    with pytest.raises(InvalidInputError, match=match):
        write_ffe(tmp_path / "far.ffe", *spoil(far))
    assert not list(tmp_path.iterdir())


def test_ffe_wants_finite_numbers(tmp_path):
    far = far_of(grid_directions(THETA, PHI), vector=False)
    far.total[7] = np.inf
    with pytest.raises(InvalidInputError, match=r"not finite in 1 of 20 directions \(first: row 7\)") as caught:
        write_ffe(tmp_path / "far.ffe", far, THETA, PHI)
    assert caught.value.rows.tolist() == [7]
