"""What is released: the wheel holds the package and works without its sources; recipes and notes agree with it."""

import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import yaml

from creeping._version import __version__

ROOT = Path(__file__).parents[1]
OTHERWISE = {"matplotlib": "matplotlib-base"}
"""Names on conda-forge that differ: that one leaves Qt out."""


def spaced(requirement):
    """A requirement as conda writes it: "numpy>=2.0" is "numpy >=2.0"."""
    name, bound = re.fullmatch(r"([\w.-]+)(.*)", requirement).groups()
    return f"{OTHERWISE.get(name, name)} {bound}"


def test_recipe_is_that_of_the_project():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    recipe = yaml.safe_load((ROOT / ".conda" / "recipe.yaml").read_text(encoding="utf-8"))
    told = project["project"]
    assert recipe["context"]["version"] == __version__
    assert set(recipe["requirements"]["run"]) == {
        f"python {told['requires-python']}",
        *(spaced(one) for one in told["dependencies"]),
    }
    assert set(map(spaced, project["build-system"]["requires"])) <= set(recipe["requirements"]["host"])
    assert recipe["build"]["python"]["entry_points"] == [f"{n} = {at}" for n, at in told["scripts"].items()]
    assert recipe["about"]["summary"] == told["description"] and recipe["about"]["license"] == told["license"]


def test_version_is_the_same_everywhere():
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["version"] == __version__
    assert f"\n## [{__version__}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_wheel_has_all_it_needs(tmp_path):
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path)
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    sources = (path for folder in ("creeping", "scatterers") for path in (ROOT / folder).rglob("*"))
    wanted = {
        path.relative_to(ROOT).as_posix()
        for path in sources
        if path.suffix in {".py", ".pyi", ".bib"} or path.name == "py.typed"
    }
    assert held == wanted
    # in front of the sources of an editable install, and not in their folder
    ask = [sys.executable, "-c", "import sys; from creeping.commands.main import main; main(sys.argv[1:])"]
    where = {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": str(tmp_path)}, "capture_output": True, "text": True}
    shown = subprocess.run([*ask, "--help"], check=False, **where)
    assert shown.returncode == 0 and "Radar cross section" in shown.stdout, shown.stderr
    refused = subprocess.run([*ask, "figure", "--list"], check=False, **where)
    assert refused.returncode == 3 and "not the installed package" in refused.stderr
