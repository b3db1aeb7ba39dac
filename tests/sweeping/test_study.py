"""Study files: every kind of directions, all mistakes at once, and a digest of what changes results."""

import re

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping import InvalidInputError
from creeping.geometry.directions import angles_of, azimuth_elevation_of
from creeping.rays.reach import ray_length
from creeping.sweeping import study_tables as study_directions
from creeping.sweeping.study import EXAMPLE, parse_study, read_study
from creeping.sweeping.study_tables import KINDS

HEAD = '[study]\nbody = "sphere"\nquantity = "rays"\n'


def directions(tmp_path, *lines):
    return parse_study("\n".join([HEAD, "[incidences]", *lines]), folder=tmp_path).incidences


def mistakes(text, tmp_path):
    with pytest.raises(InvalidInputError) as caught:
        parse_study(text, folder=tmp_path)
    return caught.value.mistakes


def test_the_example_says_what_it_means(tmp_path):
    (tmp_path / "a.toml").write_text(EXAMPLE)
    study = read_study(tmp_path / "a.toml")
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    request = study.request_for(body)
    assert request.boundaries == ("soft", "hard") and request.wavenumbers == (20.0, 40.0) and request.n_rays == 256
    lengths = [ray_length(cr.shadow_line(body, d), wavenumber=20.0) for d in cr.fibonacci_directions(12)]
    assert request.length == max(lengths) > min(lengths)
    assert (study.output, study.workers, study.text, study.folder) == ("sweep.zarr", None, EXAMPLE, tmp_path)
    study = parse_study(EXAMPLE.replace("[20.0, 40.0]", "{ first = 5.0, last = 8.0, count = 4 }"), folder=tmp_path)
    assert study.request.wavenumbers == (5.0, 6.0, 7.0, 8.0)
    with pytest.raises(InvalidInputError, match=r"none.toml: there is no such file.*creeping sweep --example > study"):
        read_study(tmp_path / "none.toml")
    with pytest.raises(InvalidInputError, match="the study is empty; start from what 'creeping sweep --example'"):
        parse_study("# nothing yet\n", folder=tmp_path)


def test_kinds_of_directions(tmp_path):
    turns = ("phi_deg_min = 0", "phi_deg_max = 360", "phi_count = 4")
    level = ("elevation_deg_min = 10", "elevation_deg_max = 10", "elevation_count = 1")
    counts = {
        "fibonacci": ("count = 7",),
        "lebedev": ("order = 5",),
        "grid": ("theta_count = 3", "phi_count = 4"),
        "theta-phi": ("theta_deg_min = 0", "theta_deg_max = 90", "theta_count = 4", *turns),
        "azimuth-elevation": ("azimuth_deg_min = -30", "azimuth_deg_max = 30", "azimuth_count = 3", *level),
        "great-circle": ("first = [0, 0, 1]", "through = [2, 0, 1]", "count = 8"),
        "list": ("directions = [[0, 0, 2], [1, 1, 0]]",),
        "file": ('path = "d.csv"',),
    }
    assert set(counts) == set(KINDS)
    (tmp_path / "d.csv").write_text("# x, y, z\n1, 2, 3\n0, 0, -1\n")
    found = {kind: directions(tmp_path, f'kind = "{kind}"', *lines) for kind, lines in counts.items()}
    assert [len(d) for d in found.values()] == [7, 14, 12, 16, 3, 8, 2, 2]
    theta, phi = angles_of(found["theta-phi"][4:8])
    # a whole circle does not repeat its start
    assert np.degrees(theta) == pytest.approx(30) and np.degrees(phi) == pytest.approx([0, 90, 180, -90])
    azimuth, elevation = azimuth_elevation_of(found["azimuth-elevation"])
    assert np.degrees(azimuth) == pytest.approx([-30, 0, 30]) and np.degrees(elevation) == pytest.approx(10)
    assert found["great-circle"][2] == pytest.approx([1, 0, 0])
    assert found["file"][0] == pytest.approx(np.array([1, 2, 3]) / np.sqrt(14))
    np.save(tmp_path / "d.npy", found["fibonacci"])
    assert np.array_equal(directions(tmp_path, 'kind = "file"', 'path = "d.npy"'), found["fibonacci"])


def test_all_mistakes_at_once_with_what_was_meant(tmp_path):
    text = """
quantty = "rays"
[study]
bodi = "sphere"
quantity = "monostatik"
boundary = 3
wavenumbers_per_length = [1.0, -2.0]
rays = 2.5
length = inf
[incidence]
kind = "fibonacci"
[incidences]
kind = "fibonaci"
[flow]
tolerance = 1.0
kind = "best"
[run]
wokers = 2
workers = true
"""
    found = mistakes(text, tmp_path)
    expected = [
        "quantty: a key outside of the tables",
        "incidence: unknown table; did you mean incidences?",
        "[study] bodi: unknown key; did you mean body?",
        '[study] quantity = "monostatik" is not "rays" or "monostatic" or "bistatic"',
        "[study] boundary = 3 is not a text in quotes, or a list of them",
        "[study] wavenumbers_per_length = [1.0, -2.0] is not a positive number from 1e-12 to 1e+12, a list",
        "[study] rays = 2.5 is not a whole number from 1 to 65536",
        "[study] length = inf is not a positive finite number",
        "[study] body is missing",
        '[flow] kind = "best" is not "auto" or "map" or "direct"',
        "[run] wokers: unknown key; did you mean workers?",
        "[run] workers = True is not a whole number from 1 to 10000",
        "[flow] tolerance = 1 is not between 1e-12 and 1e-1",
        "[incidences] kind = 'fibonaci' is unknown; did you mean fibonacci?",
    ]
    for start in expected:
        assert sum(mistake.startswith(start) for mistake in found) == 1, (start, found)
    assert len(found) == len(expected)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("1000", "0"), r"\[incidences\] count = 0 is not a whole number from 1 to 10000000"),
        (("count = 1000", ""), r"\[incidences\] count is missing: a whole number"),
        (('"soft", "hard"', '"soft", "rubber"'), "boundary 'rubber'"),
        (('"soft", "hard"', '"soft", "soft"'), "repeat themselves"),
        (("[flow]", '[observation]\nkind = "fibonacci"\ncount = 3\n[flow]'), 'observation. goes with "bistatic"'),
        (('"monostatic"  ', '"bistatic"  '), 'observation. is missing: quantity "bistatic" needs it'),
        (('length = "auto" ', "length_in_body_sizes = 2.0\nlength = 2.0 "), "both given"),
        (('length = "auto" ', 'length = "long" '), r'\[study\] length = "long" is not a positive .* or "auto"'),
        (("rays = 256", 'speed = "1 + x"'), 'speed goes with quantity "rays"'),
        (("wavenumbers_per_length = [20.0, 40.0]", ""), "needs wavenumbers_per_length"),
        (("[20.0, 40.0]", "{ first = 1, last = 1e300, count = 3 }"), "wavenumbers_per_length = .* is not"),
        (("rays = 256", "rays = 256\nsteps = 4"), r'steps goes with quantity "rays"'),
        (("tolerance = 1e-6", "tolerance = " + 400 * "9"), "tolerance = 9999.* is not a positive finite number"),
        (("[study]", "x = " + 9999 * "[" + "\n[study]"), "is not TOML"),
        (("[study]", "observation = [[0, 0, 1]]\n[study]"), r"observation is not a table: write \[observation\]"),
        (("rays = 256", "observation = [[0, 0, 1]]"), r"\[study\] observation is a table of its own: write"),
    ],
)
def test_one_mistake_is_one_mistake(change, words, tmp_path):
    text = EXAMPLE.replace(*change)
    assert text != EXAMPLE
    with pytest.raises(InvalidInputError, match=words) as caught:
        parse_study(text, folder=tmp_path)
    assert len(getattr(caught.value, "mistakes", [1])) == 1


def test_what_gives_too_much_is_refused_before_it_is_made(tmp_path):
    span = "{0}_deg_min = 0\n{0}_deg_max = 9\n{0}_count = 1000000\n"
    for table, words in (
        ('kind = "fibonacci"\ncount = 10000001', "count = 10000001 is not a whole number from 1 to 10000000"),
        ('kind = "grid"\ntheta_count = 1000000\nphi_count = 1000000', "n_theta n_phi = 1000000000000"),
        ('kind = "theta-phi"\n' + span.format("theta") + span.format("phi"), "phi_count = 1000000000000 is not"),
    ):
        (found,) = mistakes(f"{HEAD}[incidences]\n{table}", tmp_path)
        assert words in found
    (found,) = mistakes(f'{HEAD}rays = 65536\nsteps = 4096\n[incidences]\nkind = "lebedev"\norder = 3', tmp_path)
    assert "one incidence gives 19.3 GB of results, more than 1 GB; ask for fewer rays or steps" in found


def test_a_header_of_names_is_left_out_and_another_is_told(tmp_path):
    (tmp_path / "d.csv").write_text("\ufeffx, y,Z\n0,0,2\n", encoding="utf-8")
    assert directions(tmp_path, 'kind = "file"', 'path = "d.csv"').tolist() == [[0, 0, 1]]
    (tmp_path / "d.csv").write_text("theta,phi,r\n0,0,2\n")
    (found,) = mistakes(f'{HEAD}[incidences]\nkind = "file"\npath = "d.csv"', tmp_path)
    assert "begins with 'theta,phi,r': remove the header line" in found


def test_a_header_that_promises_more_than_the_file_holds(tmp_path, monkeypatch):
    for shape in ((10**12, 3), (10**30, 3), (2, 3)):
        with (tmp_path / "bomb.npy").open("wb") as file:
            header = {"descr": "<f8", "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_1_0(file, header)
            file.write(bytes(24))
        (found,) = mistakes(f'{HEAD}[incidences]\nkind = "file"\npath = "bomb.npy"', tmp_path)
        assert "cannot read directions from" in found and "bomb.npy" in found
    # one that holds what it promises, but too much
    monkeypatch.setattr(study_directions, "MOST", 10)
    np.save(tmp_path / "large.npy", np.ones((100, 3)))
    (found,) = mistakes(f'{HEAD}[incidences]\nkind = "file"\npath = "large.npy"', tmp_path)
    assert "more than 10 directions" in found


def test_files_of_directions_are_only_read(tmp_path):
    np.save(tmp_path / "bad.npy", np.array([print, None], dtype=object), allow_pickle=True)
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "ragged.csv").write_text("1,2,3\n4,5\n")
    (tmp_path / "two.csv").write_text("1,2\n")
    (tmp_path / "zero.csv").write_text("1,2,3\n0,0,0\n")
    for name, words in (
        ("bad.npy", "cannot read"),
        ("empty.csv", "holds no directions"),
        ("ragged.csv", "cannot read"),
        ("two.csv", r"\(1, 2\), not numbers \(n, 3\)"),
        ("zero.csv", r"1 of 2 .* zero .rows 1"),
        ("none.csv", "cannot read"),
        ("d.txt", r"neither in .csv nor in .npy"),
    ):
        (found,) = mistakes(f'{HEAD}[incidences]\nkind = "file"\npath = "{name}"', tmp_path)
        assert re.search(words, found), found


def test_lengths_of_rays(tmp_path):
    body = sc.Sphere(radius=2.0)
    for given, wanted in ((" = 2.5", 2.5), ("_in_body_sizes = 2.0", 4 * np.sqrt(3)), (' = "auto"', "auto")):
        study = parse_study(EXAMPLE.replace(' = "auto" ', f"{given} ", 1), folder=tmp_path)
        # k a = 40 at the lowest wavenumber: the first hard mode falls by e^-7.5
        exact = 2 * 7.5 / (20 ** (1 / 3) * 1.01879297 * np.sin(np.pi / 3)) if wanted == "auto" else wanted
        assert study.request_for(body).length == pytest.approx(exact, rel=1e-2 if wanted == "auto" else 1e-12)
    without = EXAMPLE.replace('length = "auto"', "# nothing")
    assert parse_study(without, folder=tmp_path).request_for(body) == parse_study(EXAMPLE, folder=tmp_path).request_for(
        body
    )
