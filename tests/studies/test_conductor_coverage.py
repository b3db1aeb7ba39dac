"""The stated errors of fields near conductors cover the true ones: the study's quick form."""

import pytest

from studies import conductor_coverage


@pytest.mark.slow
def test_errors_are_covered_on_the_sphere():
    found = conductor_coverage.row("sphere", 10.0, 10)
    for part in conductor_coverage.PARTS:
        assert found[part] > 95, part
        assert found[f"{part} ratio"] < 8, part
    assert found["off"] < 5 and found["on"] < 15


@pytest.mark.slow
def test_it_prints_a_row_for_each_case(capsys):
    conductor_coverage.main(["--quick"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[1].startswith("sphere      10")
    assert [line.split(" covered")[0].strip() for line in lines[2:]] == list(conductor_coverage.PARTS)
