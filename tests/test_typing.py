"""Type checkers find the installed package: README's example is without errors, wrong arguments are found."""

import doctest
import re
import subprocess
import sys
from pathlib import Path

import pytest

README = Path(__file__).parents[1] / "README.md"
PAIR = """
from typing import Any, assert_type
found = cr.coupling(body, [(0, 0, 1), (0.5, 0, 0)], wavenumber=30.0)
assert_type(found[0, 1], np.complex128)
assert_type(found[0][1], Any)
assert_type(cr.coupling(body, [(0, 0, 1), (0.5, 0, 0)], wavenumber=[30.0, 31.0]), list[cr.Coupling])
"""
WRONG = {
    'cr.launch(flow, line, wavenumber="40")': "arg-type",
    'cr.surface_field(fan, wavenumber="40", boundary="hard")': "arg-type",
    'cr.far_field(fan, [(0, 0, 1)], wavenumber=40.0, boundary="hrad")': "arg-type",
    'cr.solve(body, (1, 0, 0), wavenumber=3.0, boundary="hrad")': "arg-type",
    'cr.sweep_directions(flow, [(0, 0, 1)], quantity="ray")': "arg-type",
    'sc.Sphere(radius="1")': "arg-type",
    "cr.shadowline": "attr-defined",
}


@pytest.mark.slow
def test_users_code_is_checked(tmp_path):
    # compiled kernels and numpy are read once, for what is right and what is wrong: some twenty seconds
    example = "".join(one.source for one in doctest.DocTestParser().get_examples(README.read_text(encoding="utf-8")))
    right = example + PAIR
    script = tmp_path / "first_day.py"
    script.write_text(right + "\n".join(WRONG) + "\n", encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", tmp_path / "cache", script.name]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False)
    found = re.findall(r"^first_day.py:(\d+): error: .*\[([a-z-]+)\]$", done.stdout, re.MULTILINE)
    begin = right.count("\n") + 1
    assert found == [(str(begin + k), code) for k, code in enumerate(WRONG.values())], done.stdout + done.stderr
