"""Commands that are ended before all is done: rows are on disk, marked, and ``--resume`` comes to the same bytes."""

import json
import signal

import numpy as np
import pytest
from command_line import creeping, ran, table
from ended import ending_at, killed, stamps

from creeping.commands import resuming
from creeping.field import far, routes
from creeping.storage.parts import Parts
from creeping.sweeping import blocks
from creeping.sweeping.store import SweepStore

TS = ["ts", "sphere:radius=0.1", "--sound-speed", 1500, "--frequency", "3:4:1kHz", "--monostatic", "az:0:4:1"]
TS += ["--method", "t-matrix", "--boundary", "hard", "--no-pictures", "--no-cache"]
RCS = ["rcs", "sphere:radius=0.15", "--frequency", "9GHz", "--monostatic", "az:0:11:1", "--method", "rays"]
RCS += ["--no-pictures", "--no-cache"]


def files(folder):
    """Bytes of files by name."""
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def undisturbed(words, folder):
    """Files of a run that nothing ends."""
    assert ran(*words, "-o", folder / "whole") == 0
    return files(folder / "whole")


@pytest.mark.parametrize(
    ("words", "number"),
    [(TS, signal.SIGTERM), (RCS, signal.SIGINT)],
    ids=["a matrix a frequency", "tasks of angles"],
)
@pytest.mark.slow
def test_ended_at_random_moments_it_comes_to_the_same_bytes(tmp_path, monkeypatch, capsys, words, number):
    monkeypatch.setattr(blocks, "TASK", 4)
    with ending_at(SweepStore, "put", 0) as calls:
        expected = undisturbed(words, tmp_path)
    rng, out, told = np.random.default_rng(3), tmp_path / "out", []
    values = 10 if words is TS else 12
    for moment in rng.integers(calls[0] // 8, calls[0] // 2, 2):
        before = stamps(out, "*.parts/*/task_status/c/*")
        code = 0
        with ending_at(SweepStore, "put", moment, number):
            code = ran(*words, "-o", out, "--resume")
        assert code in (0, 130)
        summary = json.loads((out / "summary.json").read_text()) if (out / "summary.json").exists() else {}
        if not summary.get("complete", True):
            # no task is done twice, and rows of those that are done stand in the table
            assert before.items() <= stamps(out, "*.parts/*/task_status/c/*").items()
            told.append(summary["values_done"])
            text = (out / f"{words[0]}.csv").read_text()
            assert text.startswith(f"# incomplete: {told[-1]} of {values} values; to go on: creeping {words[0]} ")
            assert len(table(out / f"{words[0]}.csv")) == told[-1] * (1 if words is TS else 2)
    assert told == sorted(told)
    assert ran(*words, "-o", out, "--resume") == 0
    assert files(out) == expected
    capsys.readouterr()
    assert ran(*words, "-o", out, "--resume") == 0 and "nothing is missing" in capsys.readouterr().out


@pytest.mark.slow
def test_one_that_is_ended_tells_how_to_go_on(tmp_path, monkeypatch, capsys):
    real, calls = blocks.sweep_directions, []

    def ended(*arguments, **options):
        calls.append(options["wavenumbers"])
        if len(calls) == 2:
            signal.raise_signal(signal.SIGTERM)
        return real(*arguments, **options)

    monkeypatch.setattr(blocks, "sweep_directions", ended)
    code, said, err = creeping(*TS, "-o", tmp_path, capsys=capsys)
    assert code == 130 and not said
    assert "what is done is kept; to go on: creeping ts sphere:radius=0.1 --sound-speed 1500" in err
    assert json.loads((tmp_path / "summary.json").read_text())["values_done"] == 5
    assert {row["frequency_hz"] for row in table(tmp_path / "ts.csv")} == {"3000.0"}
    # what is there is not thrown away, and goes with what it was asked for alone
    code, _, err = creeping(*TS, "-o", tmp_path, capsys=capsys)
    assert code == 3 and "give --resume to go on" in err
    for index, other, name in [(5, "3:6:1kHz", "--frequency"), (1, "sphere:radius=0.11", "body"), (11, "soft", "ary")]:
        words = [*TS]
        words[index] = other
        code, _, err = creeping(*words, "-o", tmp_path, "--resume", capsys=capsys)
        assert code == 3 and f"{name} (stored {TS[index]}, now {other})" in err
    monkeypatch.setattr(resuming, "__version__", "9")
    code, _, err = creeping(*TS, "-o", tmp_path, "--resume", capsys=capsys)
    assert code == 3 and "version (stored 0" in err and "now 9" in err
    monkeypatch.undo()
    assert ran(*TS, "-o", tmp_path, "--resume") == 0
    assert len(table(tmp_path / "ts.csv")) == 10 and not (tmp_path / "ts.parts").exists()


@pytest.mark.slow
@pytest.mark.parametrize("words", [TS, RCS], ids=["a matrix a frequency", "tasks of angles"])
def test_killed_20_times_it_comes_to_the_same_bytes(tmp_path, monkeypatch, words):
    # the summary's digest is that of the tasks
    monkeypatch.setattr(blocks, "TASK", 4)
    rng, expected = np.random.default_rng(7), undisturbed(words, tmp_path)
    kills = begun = 0
    while kills < 20:
        out, done = tmp_path / str(begun), False
        begun += 1
        code = "from creeping.sweeping import blocks; blocks.TASK = 4; from creeping.commands.main import main; "
        code += f"main({[*map(str, words), '-o', str(out), '--resume']!r})"
        while not done and kills < 20:
            before = stamps(out, "*.parts/*/task_status/c/*")
            done = killed(code, rng.uniform(0.0, 1.5), lambda: (out / f"{words[0]}.parts").exists())  # noqa: B023
            kills += not done
            assert done or before.items() <= stamps(out, "*.parts/*/task_status/c/*").items()
        assert ran(*words, "-o", out, "--resume") == 0
        assert files(out) == expected


@pytest.mark.slow
@pytest.mark.parametrize("by", ["rays", "currents"])
def test_a_grid_of_directions_goes_on(tmp_path, monkeypatch, capsys, by):
    words = ["run", "sphere", "--direction", 1, 0, 0, "--wavenumber", 30, "--observe", "grid:30", "--no-pictures"]
    words += ["--rays", 16, "--no-cache"]
    if by == "rays":
        monkeypatch.setattr(routes, "affordable", lambda *_, **__: False)
        monkeypatch.setattr(far, "measured_level", lambda *_: None)
    monkeypatch.setattr(far, "TOGETHER", 40)
    assert ran(*words, "-o", tmp_path / "whole") == 0
    made, real = [], Parts.__call__

    def ended(parts, name, make):
        if len(made) == 2:
            signal.raise_signal(signal.SIGTERM)
        return real(parts, name, lambda: made.append(name) or make())

    monkeypatch.setattr(Parts, "__call__", ended)
    out = tmp_path / "out"
    code, _, err = creeping(*words, "-o", out, capsys=capsys)
    assert code == 130 and "to go on: creeping run sphere --direction 1 0 0" in err
    if by == "rays":
        summary = json.loads((out / "summary.json").read_text())
        assert summary["complete"] is False and (summary["directions_done"], summary["directions"]) == (80, 91)
        assert (out / "far.csv").read_text().startswith("# incomplete: 80 of 91 directions; to go on: creeping run")
        assert len(table(out / "far.csv")) == 80
    code, _, err = creeping(*words[:-1], "-o", out, "--resume", capsys=capsys)
    assert code == 3 and "--cache (stored False, now True)" in err
    first, made[2:] = made[:2], [""]
    assert ran(*words, "-o", out, "--resume") == 0
    assert not set(first) & set(made[3:]) and len(made) > 3
    assert files(out) == files(tmp_path / "whole")
