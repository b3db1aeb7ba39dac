"""Far fields as CSV and as FEKO text, read back; the latter by a reader written here from the format's description."""

import csv
import re

import numpy as np
import pytest

from creeping import InvalidInputError
from creeping.field.far_result import FarField
from creeping.files import write_csv, write_ffe
from creeping.files.far_table import angles_of
from creeping.files.ffe import grid_directions

THETA, PHI = np.linspace(0, np.pi, 5), np.linspace(0, 2 * np.pi, 4)


def far_of(directions, vector, seed=3):
    """A FarField of random numbers."""
    rng = np.random.default_rng(seed)
    shape = (len(directions), 2, 2) if vector else (len(directions),)
    parts = [rng.normal(size=shape) + 1j * rng.normal(size=shape) for _ in range(3)]
    method = np.array(["rays", "rays+fan"] * len(directions))[: len(directions)]
    lost = np.arange(len(directions)) == 1
    return FarField(
        directions, *parts, method, lost, np.zeros(parts[0].shape), "", 20.0, "pec" if vector else "hard", 2
    )


def read_ffe(path):
    """Blocks of a .ffe file: their keys and their rows (n, 9)."""
    blocks, comments = [], []
    for line in path.read_text(encoding="ascii").splitlines():
        key = re.fullmatch(r"#([^#:\"]+): (.*)", line)
        if line.startswith("**"):
            comments.append(line)
        elif key:
            if key[1] == "Configuration Name":
                blocks.append(({}, []))
            blocks[-1][0][key[1]] = key[2]
        elif line and not line.startswith("#"):
            blocks[-1][1].append([float(item) for item in line.split()])
    return [(keys, np.array(rows)) for keys, rows in blocks], comments


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


def test_csv_wants_exactly_one(tmp_path):
    far = far_of(grid_directions(THETA, PHI), vector=False)
    with pytest.raises(InvalidInputError, match="got curves and far; give exactly one of line, fan, curves, far, cut"):
        write_csv(tmp_path / "x.csv", curves=[], far=far)


def test_angles_stay_in_range():
    tiny = np.array([[1.0, -1e-18, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]])
    np.testing.assert_allclose(angles_of(tiny), [[np.pi / 2, 0], [np.pi, 0], [np.pi / 2, 1.5 * np.pi]])


def test_ffe_of_a_scalar_field_is_conjugated(tmp_path):
    far = far_of(grid_directions(THETA, PHI), vector=False)
    write_ffe(tmp_path / "far.ffe", far, THETA, PHI, direction=(1, 0, 0))
    text = (tmp_path / "far.ffe").read_text()
    assert text.startswith("##File Type: Far field\n##File Format: 8\n")
    ((keys, rows),), comments = read_ffe(tmp_path / "far.ffe")
    assert any("SCALAR" in line for line in comments)
    assert any("exp(+jwt)" in line for line in comments)
    assert any("unresolved in 1 of 20 directions" in line for line in comments)
    assert (keys["No. of Theta Samples"], keys["No. of Phi Samples"]) == ("5", "4")
    assert keys["Coordinate System"] == "Spherical"
    assert keys["Result Type"] == "RCS"
    # where it comes from
    assert keys["Incident Wave Direction"] == "(90, 180)"
    assert float(keys["Frequency"]) == pytest.approx(20 * 299792458 / (2 * np.pi))
    # theta runs first
    read = rows.reshape(4, 5, 9).swapaxes(0, 1).reshape(20, 9)
    np.testing.assert_allclose(np.radians(read[:, 0]), np.repeat(THETA, 4))
    np.testing.assert_allclose(np.radians(read[:, 1]), np.tile(PHI, 5))
    np.testing.assert_array_equal(read[:, 2] + 1j * read[:, 3], np.conj(far.total))
    np.testing.assert_array_equal(read[:, 4:6], 0)
    np.testing.assert_allclose(read[:, 8], far.cross_section)


def test_ffe_of_a_vector_field_has_a_block_for_each_polarisation(tmp_path):
    far = far_of(grid_directions(THETA, PHI), vector=True)
    write_ffe(tmp_path / "far.ffe", far, THETA, PHI)
    blocks, _ = read_ffe(tmp_path / "far.ffe")
    assert [keys["Configuration Name"] for keys, _ in blocks] == ["incident_theta", "incident_phi"]
    assert "Incident Wave Direction" not in blocks[0][0]
    for incident, (_, rows) in enumerate(blocks):
        read = rows.reshape(4, 5, 9).swapaxes(0, 1)[1:-1].reshape(12, 9)
        fields = np.stack([read[:, 2] + 1j * read[:, 3], read[:, 4] + 1j * read[:, 5]], axis=-1)
        np.testing.assert_allclose(fields, np.conj(far.total[4:-4, :, incident]))
        np.testing.assert_allclose(read[:, 6] + read[:, 7], read[:, 8])


def test_ffe_turns_the_components_at_the_poles(tmp_path):
    """One field vector E at each pole, whatever the row's phi."""
    far = far_of(grid_directions(THETA, PHI), vector=True)
    for rows in (slice(0, 4), slice(-4, None)):
        far.creeping[rows] = far.total[rows][:1] - far.reflected[rows] - far.forward[rows]
    write_ffe(tmp_path / "far.ffe", far, THETA, PHI)
    blocks, _ = read_ffe(tmp_path / "far.ffe")
    read = blocks[0][1].reshape(4, 5, 9)[:, [0, -1]]
    t, p = np.radians(read[..., 0]), np.radians(read[..., 1])
    theta_unit = np.stack([np.cos(t) * np.cos(p), np.cos(t) * np.sin(p), -np.sin(t)], axis=-1)
    phi_unit = np.stack([-np.sin(p), np.cos(p), 0 * p], axis=-1)
    field = (read[..., 2] + 1j * read[..., 3])[..., None] * theta_unit
    field += (read[..., 4] + 1j * read[..., 5])[..., None] * phi_unit
    np.testing.assert_allclose(field, np.broadcast_to(field[0], field.shape), atol=1e-12)


@pytest.mark.parametrize(
    ("spoil", "match"),
    [
        (
            lambda far: (far, THETA[:-1], PHI),
            "holds a grid: the far field has 20 directions, a grid of 4 theta by 4 phi",
        ),
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
    far.creeping[7] = np.inf
    with pytest.raises(InvalidInputError, match=r"not finite in 1 of 20 directions \(first: row 7\)") as caught:
        write_ffe(tmp_path / "far.ffe", far, THETA, PHI)
    assert caught.value.rows.tolist() == [7]
