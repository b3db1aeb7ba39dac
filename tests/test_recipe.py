"""The conda recipe says what pyproject.toml says."""

import re
import tomllib
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
