"""The stated errors of near and surface fields cover the true ones: the study's quick form."""

import pytest

from studies import near_coverage


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["hard", 0.7])
def test_errors_are_covered_on_the_sphere(boundary):
    found = near_coverage.row("sphere", 10.0, boundary, 10)
    for part in near_coverage.PARTS:
        assert found[part] > 95, part
        # in the shadow what is next to the body, where errors are largest, counts as close
        assert found[f"{part} ratio"] < (15 if part == "shadow" else 10), part
    assert found["off"] < 3 and found["on"] < 5


@pytest.mark.slow
def test_it_prints_a_row_for_each_case(capsys, monkeypatch):
    monkeypatch.setattr(near_coverage, "BOUNDARIES", ("hard",))
    near_coverage.main(["--quick"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("sphere    hard       10")
    assert [line.split(" covered")[0].strip() for line in lines[2:]] == list(near_coverage.PARTS)
