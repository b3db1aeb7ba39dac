"""The fuzzing study: small seeded parts of it, and that it sees what it looks for."""

import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests import fuzz
from tests.fuzz import child, readers, seeds, supervision
from tests.fuzz.calls import ACCEPTED, CRASH, REFUSED, SILENT, SLOW, WRONG, Verdict, generator
from tests.fuzz.mutation import mutated

GOOD = (REFUSED, ACCEPTED)
CHEAP = "stl-text stl-binary obj off ply glb 3mf study directions-csv directions-npy ffe map".split()


@pytest.mark.parametrize("name", [*CHEAP, *(pytest.param(one, marks=pytest.mark.slow) for one in ("body", "origin"))])
def test_bad_input_is_refused_or_taken_as_it_is(name, tmp_path):
    attack = fuzz.ATTACKS[name]()
    # fits take seconds
    attack.fitted = 0.0
    # of connections it is seen that the page's own messages do turn the incidence
    attack.prepare(tmp_path)
    verdicts = [child.tried(attack, name, 5, number, tmp_path / f"case-{number}") for number in range(12)]
    assert [found for found in verdicts if found.kind not in GOOD] == []
    assert any(found.kind == REFUSED for found in verdicts)
    if name == "origin":
        attack.page.close()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_bad_arguments_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    attack = fuzz.ATTACKS["call"]()
    attack.prepare(tmp_path)
    assert len(attack.values) > 170 and len(attack) > 20_000
    chosen = range(0, len(attack), len(attack) // 100)
    verdicts = [child.tried(attack, "call", 0, number, tmp_path / f"case-{number}") for number in chosen]
    assert [found for found in verdicts if found.kind not in GOOD] == []


def test_the_second_readers_read_what_was_written():
    vertices, triangles = seeds.body_mesh()
    files = {"stl": seeds.stl_binary(), "obj": seeds.obj(), "off": seeds.off(), "glb": seeds.glb()}
    files |= {"3mf": seeds.archive_3mf(), "ply": seeds.ply(binary=True)}
    assert all(mutated(files["off"], generator("off", 0, n), text=True) != files["off"] for n in range(60))
    for kind, data in files.items():
        np.testing.assert_allclose(readers.corners_of(kind, data), vertices[triangles], rtol=0, atol=1e-7)
    with pytest.raises(readers.UnclearError):
        readers.corners_of("off", seeds.off().replace(b"642", b"641"))


class Falling:
    """Cases that fail, one of each kind."""

    def prepare(self, folder):
        pass

    def attempt(self, number, rng, place):
        place.write_text(str(number))
        if number == 1:
            import ctypes

            ctypes.string_at(0)
        if number == 2:
            time.sleep(60)
        if number == 3:
            raise KeyError("x")
        if number == 4:
            return Verdict(SILENT, "another body")
        if number == 5:
            np.ones(10**9)
        return Verdict(ACCEPTED)


STAND_IN = """
import sys
from pathlib import Path
from tests import fuzz
from tests.fuzz import child
from test_fuzz import Falling
fuzz.ATTACKS["falling"] = Falling
name, seed, start, stop, step, folder, memory = sys.argv[1:]
child.main(name, int(seed), range(int(start), int(stop), int(step)), Path(folder), int(memory))
"""


@pytest.mark.slow
def test_crashes_hangs_and_wrong_errors_are_findings(tmp_path, monkeypatch):
    here, root = Path(__file__).parent, Path(__file__).parents[3]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(here), str(root), *sys.path]))
    (tmp_path / "stand_in.py").write_text(STAND_IN)
    started = supervision.subprocess.Popen

    def stand_in(words, **options):
        return started([words[0], str(tmp_path / "stand_in.py"), *words[3:]], **options)

    monkeypatch.setattr(supervision.subprocess, "Popen", stand_in)
    options = {"seconds": 60.0, "kept": tmp_path / "kept", "limit": 2.0, "memory": 10**9}
    tally = supervision.run_attack("falling", 9, range(7), **options)
    assert [f.number for f in tally.findings] == [1, 2, 3, 4, 5]
    assert [f.verdict for f in tally.findings] == [CRASH, SLOW, WRONG, SILENT, WRONG]
    assert tally.counts[ACCEPTED] == 2 and "SIGSEGV" in tally.findings[0].words and "Memory" in tally.findings[4].words
    assert "python -m tests.fuzz falling --seed 9 --case 3" in str(tally.findings[2])
    assert sorted(p.name for p in (tmp_path / "kept").iterdir()) == [f"falling-9-case-{n}" for n in (1, 2, 3, 4, 5)]
