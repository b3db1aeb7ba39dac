"""Coupling of antennas from the command line: ports, tables, Touchstone, and what is refused."""

import json

import numpy as np
import pytest
from command_line import creeping, ran, table

import creeping as cr
import scatterers as sc
from creeping.commands.antennas import parse_ports
from creeping.errors import InvalidInputError

PORTS = ("--port", "a=0,0,1", "--port", "b=1,0,0", "--port", "0,-0.99,0")


def test_ports_are_slots_first_and_have_names():
    found = parse_ports(["a=0,0,1", "b = 1, 0, 0 / 0, 1, 0", "0,1,0"], "auto")
    assert found.names == ("b", "a", "3") and found.kinds == ("slot", "monopole", "monopole")
    np.testing.assert_array_equal(found.points, [[1, 0, 0], [0, 0, 1], [0, 1, 0]])
    np.testing.assert_array_equal(found.axes, [[0, 1, 0]])
    assert set(parse_ports(["0,0,1", "1,0,0"], "point").kinds) == {"point"}


@pytest.mark.parametrize(
    "texts, kind, words",
    [
        (["a=0,0,1"], "auto", "there is 1 port; give two or more"),
        (["a=0,0,1", "a=1,0,0"], "auto", "two ports have one name"),
        (["a=0,0", "b=1,0,0"], "auto", "give NAME=X,Y,Z"),
        (["a=0,0,nan", "b=1,0,0"], "auto", "give NAME=X,Y,Z"),
        (["a=0,0,1/0,1", "b=1,0,0"], "auto", "give NAME=X,Y,Z"),
        (["a=0,0,1", "b=1,0,0/0,1,0"], "slot", "a slot has an axis; give a=X,Y,Z/AX,AY,AZ"),
        (["a=0,0,1", "b=1,0,0/0,1,0"], "monopole", "a monopole has no axis"),
    ],
)
def test_bad_ports_are_refused(texts, kind, words):
    with pytest.raises(InvalidInputError, match=words):
        parse_ports(texts, kind)


@pytest.mark.slow
def test_tables_hold_what_the_library_gives(tmp_path, capsys):
    words = ["coupling", "sphere", *PORTS, "--frequency", "1:1.2:0.1GHz", "--size", 0.02, "-o", tmp_path]
    code, said, told = creeping(*words, capsys=capsys)
    assert code == 0 and "a to b: " in said and "ports moved onto the body, by 0.01 L" in told
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["ports"] == ["a", "b", "3"] and summary["frequencies"] == 3
    assert set(summary["files"]) == {"coupling.csv", "paths.csv", "coupling.s3p", "coupling.png", "summary.json"}
    k = cr.wavenumber("1.1GHz")
    found = cr.monopole_coupling(sc.Sphere(), [(0, 0, 1), (1, 0, 0), (0, -1, 0)], wavenumber=k)
    rows = [row for row in table(tmp_path / "coupling.csv") if row["frequency_hz"] == "1100000000.0"]
    assert [(row["source"], row["receiver"]) for row in rows[:2]] == [("a", "b"), ("a", "3")] and len(rows) == 6
    mine = complex(float(rows[0]["re"]), float(rows[0]["im"]))
    np.testing.assert_allclose(mine, found[0, 1], rtol=1e-9)
    np.testing.assert_allclose(float(rows[0]["level_db"]), found.db[0, 1], rtol=1e-9)
    paths = [row for row in table(tmp_path / "paths.csv") if row["frequency_hz"] == "1100000000.0"]
    of_pair = [row for row in paths if (row["source"], row["receiver"]) == ("a", "b")]
    whole = sum(complex(float(row["re"]), float(row["im"])) for row in of_pair)
    np.testing.assert_allclose(whole, found[0, 1], rtol=1e-6)
    # Z_ij = -Z_0 h^2 E_ij, conjugated
    lines = [line for line in (tmp_path / "coupling.s3p").read_text().splitlines() if not line.startswith("!")]
    assert lines[0] == "# HZ Z RI R 1"
    first = [float(word) for word in lines[4].split()]
    np.testing.assert_allclose(first[0], 1.1e9)
    np.testing.assert_allclose(complex(first[3], first[4]), np.conj(-376.730313668 * 0.02**2 * found[0, 1]), rtol=1e-9)


def test_what_cannot_be_is_refused(tmp_path, capsys):
    asked = {
        ("sphere", *PORTS, "--wavenumber", 20, "--size", 0.1): "Touchstone file, which is over frequency",
        ("sphere", *PORTS, "--frequency", "1GHz", "--size", -1): "--size -1.0 is not a positive",
        ("sphere", "--port", "0,0,1/1,0,0", *PORTS[2:], "--frequency", "1GHz", "--size", 1): "one kind of ports",
        ("sphere", "--port", "a=0,0,2", "--port", "b=1,0,0", "--wavenumber", 20): "--port a: off the body by up to 1",
        ("sphere", *PORTS): "no wave given",
        ("cylinder:radius=1,length=2", *PORTS, "--wavenumber", 20): "needs a smooth body",
    }
    for words, told in asked.items():
        code, _, said = creeping("coupling", *words, "-o", tmp_path, capsys=capsys)
        assert code == 3 and told in said, words
    assert (
        ran("coupling", "sphere", *PORTS, "--kind", "point", "--wavenumber", 20, "--no-pictures", "-o", tmp_path) == 0
    )
    assert {row["status"] for row in table(tmp_path / "coupling.csv")} <= {"OK", "CAUSTIC", "UNRESOLVED"}
