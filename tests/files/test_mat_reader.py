"""MATLAB files read: what scipy writes comes back, and what is damaged or lies is refused, cheaply."""

import struct
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io

import creeping as cr
from creeping.files import mat_reader, read_mat
from studies.fuzz.fields import same_values

HEAD = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"


def element(kind, data, order="<"):
    return struct.pack(f"{order}II", kind, len(data)) + data + bytes(-len(data) % 8)


def variable(name, kind, dims, *parts, flags=0, order="<"):
    """A variable as the format says, its sizes as they are given."""
    inside = element(6, struct.pack(f"{order}II", kind | flags, 0), order)
    inside += element(5, struct.pack(f"{order}{len(dims)}i", *dims), order) + element(1, name, order)
    return element(14, inside + b"".join(parts), order)


def read(folder, body, head=HEAD):
    (folder / "x.mat").write_bytes(head + body)
    return read_mat(folder / "x.mat")


@pytest.mark.parametrize("packed", [False, True])
def test_what_scipy_writes_comes_back(packed, tmp_path, rng):
    f = rng.normal(size=(2, 3, 4)) * (1 + 2j)
    f[0, 0, 0] = complex(np.inf, np.nan)
    content = {
        "f": f,
        "single": np.float32([[1.5, np.nan]]),
        "codes": np.array([[-1, 3]], dtype=np.int8),
        "large": np.array([[2**63]], dtype=np.uint64),
        "flags": np.array([[True, False]]),
        "none": np.zeros((0, 3)),
        "about": "caf\u00e9 \u221e",
        "rows": np.array(["VV ", "pec"]),
        "cell": np.array(["rays", 3.0, ""], dtype=object),
        "units": {"f": "m", "more": {"n": 1.0}},
        "records": np.array([(1, 2.5), (3, 4.5)], dtype=[("p", int), ("q", float)]),
    }
    scipy.io.savemat(tmp_path / "x.mat", content, do_compression=packed)
    back = read_mat(tmp_path / "x.mat")
    for name in ("f", "single", "codes", "large", "flags", "none"):
        np.testing.assert_array_equal(back[name], content[name])
        assert back[name].dtype == content[name].dtype and back[name].flags.writeable
    assert (back["about"], back["rows"], back["cell"][::2]) == ("caf\u00e9 \u221e", ["VV ", "pec"], ["rays", ""])
    assert back["units"]["f"] == "m" and back["units"]["more"]["n"].tolist() == [[1.0]]
    assert [row["q"].item() for row in back["records"]] == [2.5, 4.5]


def test_the_other_order_of_bytes_and_short_elements(tmp_path):
    """By hand, as the format says: numbers of whole value are stored in fewer bytes."""
    head = HEAD[:124] + struct.pack(">H", 0x0100) + b"MI"
    values = element(3, struct.pack(">4h", 1, 2, 3, -4), ">")
    back = read(tmp_path, variable(b"a", 6, (2, 2), values, order=">"), head)
    assert back["a"].dtype == np.float64 and back["a"].tolist() == [[1, 3], [2, -4]]
    short = struct.pack("<HH", 2, 3) + bytes([7, 8, 9, 0])
    assert read(tmp_path, variable(b"b", 9, (1, 3), short))["b"].tolist() == [[7, 8, 9]]


GIANT = 2**31 - 1
ONE = element(9, struct.pack("<d", 1.0))
NAMES = element(5, struct.pack("<i", 4)) + element(1, b"a\0\0\0")
LIES = {
    "numbers": (variable(b"a", 6, (GIANT, GIANT), ONE), "1 values of 'a'"),
    "complex": (variable(b"a", 6, (1, 1), ONE, flags=0x0800), "cut off"),
    "text": (variable(b"a", 4, (1, GIANT), element(16, b"abc")), "3 characters of 'a'"),
    "cell": (variable(b"a", 1, (GIANT, GIANT), element(14, b"")), "8 bytes of 'a'"),
    "struct": (variable(b"a", 2, (GIANT, 1), NAMES, element(14, b"")), "8 bytes of 'a'"),
    "no fields": (variable(b"a", 2, (GIANT, 1), NAMES[:16] + element(1, b"")), "0 bytes of 'a'"),
    "no values": (variable(b"a", 6, (0, GIANT, GIANT, GIANT), element(9, b"")), "of dimensions"),
    "negative": (variable(b"a", 6, (-1, -1), ONE), "dimensions"),
    "names": (variable(b"a", 2, (1, 1), element(5, struct.pack("<i", GIANT)) + element(1, b"abcd")), "names of 2147"),
    "size": (struct.pack("<II", 14, GIANT) + b"abc", "states 2147483647 bytes of an element where 3 are left"),
    "short": (struct.pack("<HH", 14, 200) + bytes(4), "short element of 200 bytes"),
    "bytes over": (variable(b"a", 6, (1, 1), ONE, ONE), "16 bytes after the values"),
    "halves": (variable(b"a", 6, (1, 1), element(9, b"abc")), "3 bytes of numbers of 8 bytes"),
    "narrow": (variable(b"a", 8, (1, 1), ONE), "'a' of i1 in numbers of float64"),
    "sparse": (variable(b"a", 5, (1, 1)), "'a', a sparse array; save numbers"),
    "object": (variable(b"a", 17, (1, 1)), "'a', an object; save"),
    "function": (variable(b"a", 16, (1, 1)), "'a', a function; save"),
    "twice": (2 * variable(b"a", 6, (1, 1), ONE), "named twice: 'a'"),
    "no name": (variable(b"", 6, (1, 1), ONE), "without a name"),
    "no text": (variable(b"\xff", 6, (1, 1), ONE), "name that is no text"),
    "no unicode": (variable(b"a", 4, (1, 1), element(16, b"\xff")), "no utf-8"),
    "another": (element(9, ONE), "type 9 before byte 152, where a variable should be"),
    "not packed": (struct.pack("<II", 15, 4) + b"abcd", "packed variable that is damaged"),
    "cut": (struct.pack("<II", 15, 12) + zlib.compress(ONE)[:12], "cut off, or larger"),
    "packed over": (
        struct.pack("<II", 15, len(zlib.compress(variable(b"a", 6, (1, 1), ONE) + ONE)))
        + zlib.compress(variable(b"a", 6, (1, 1), ONE) + ONE),
        "bytes after a packed variable",
    ),
}


@pytest.mark.parametrize("name", LIES)
def test_lies_are_refused_before_memory_is_taken(name, tmp_path):
    body, match = LIES[name]
    tracemalloc.start()
    with pytest.raises(cr.InvalidInputError, match=match):
        read(tmp_path, body)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1_000_000


def test_what_is_packed_is_unpacked_no_further_than_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(mat_reader, "MOST_BYTES", 2_000_000)
    bomb = zlib.compress(bytes(50_000_000))
    tracemalloc.start()
    with pytest.raises(cr.InvalidInputError, match="larger than is read"):
        read(tmp_path, struct.pack("<II", 15, len(bomb)) + bomb)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 10_000_000
    # many small ones, each harmless: bytes that become doubles, and empty cells
    small = variable(b"a", 6, (1, 300_000), element(2, bytes(300_000)))
    with pytest.raises(cr.InvalidInputError, match="more than 2 MB when read, in a"):
        read(tmp_path, small)
    with pytest.raises(cr.InvalidInputError, match="more than 2 MB when read, in a"):
        read(tmp_path, variable(b"a", 1, (1, 100_000), 100_000 * element(14, b"")))
    (tmp_path / "x.mat").write_bytes(bytes(2_000_001))
    with pytest.raises(cr.InvalidInputError, match="2 are the most"):
        read_mat(tmp_path / "x.mat")


def test_cells_in_cells_have_a_bottom(tmp_path):
    def nested(depth):
        inner = variable(b"", 6, (1, 1), ONE)
        for _ in range(depth):
            inner = variable(b"", 1, (1, 1), inner)
        return variable(b"a", 1, (1, 1), inner)

    found = read(tmp_path, nested(20))["a"]
    for _ in range(20):
        (found,) = found
    assert found[0].tolist() == [[1.0]]
    with pytest.raises(cr.InvalidInputError, match="more than 32 cells or structs in each other"):
        read(tmp_path, nested(5000))


@pytest.mark.parametrize(
    ("head", "match"),
    [
        (HEAD[:124] + b"\x00\x02IM", r"version 7\.3; save it with -v7"),
        (HEAD[:124] + b"\x07\x00IM", "version 0x7"),
        (HEAD[:126] + b"XX", "no MATLAB file"),
        (b"\0" + HEAD[1:], "no MATLAB file"),
        (b"", "no MATLAB file"),
    ],
)
def test_other_files(head, match, tmp_path):
    with pytest.raises(cr.InvalidInputError, match=match):
        read(tmp_path, b"", head)
    with pytest.raises(cr.InvalidInputError, match="cannot read"):
        read_mat(tmp_path / "none.mat")


def test_a_file_that_is_cut_off_anywhere_is_refused(tmp_path):
    scipy.io.savemat(tmp_path / "whole.mat", {"a": {"b": "text", "c": np.arange(3.0)}})
    whole = (tmp_path / "whole.mat").read_bytes()
    for end in range(len(HEAD) + 1, len(whole)):
        with pytest.raises(cr.InvalidInputError):
            read(tmp_path, whole[len(HEAD) : end], whole[: len(HEAD)])


def test_files_of_matlab_itself(recwarn):
    """Those of many of its versions that scipy is tested with, where it has brought them along; read by scipy too."""
    files = sorted(Path(scipy.io.matlab.__file__).parent.glob("tests/data/*.mat"))
    if not files:
        pytest.skip("scipy is installed without its tests")
    agreed = 0
    for file in files:
        try:
            found = read_mat(file)
        except cr.InvalidInputError:
            continue
        expected = scipy.io.loadmat(file)
        # of a struct without fields scipy makes None
        assert all(
            (isinstance(value, dict) and not value) or same_values(value, expected[name])
            for name, value in found.items()
        ), file.name
        agreed += 1
    assert agreed > 50
