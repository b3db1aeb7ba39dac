"""The rules of the house that no tool checks: sizes, names, a closed root, a light import."""

import ast
import re
import subprocess
import sys
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("creeping", "scatterers", "studies", "tests")
MODULES = sorted(path for folder in FOLDERS for path in (ROOT / folder).rglob("*.py"))
CAP = 400
AT_ROOT = (
    "pyproject.toml",
    "creeping",
    "scatterers",
    "tests",
    "studies",
    "README.md",
    "LICENSE",
    "CHANGELOG.md",
    "CITATION.cff",
    "constraints*.txt",
    ".*",
)


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def test_there_are_modules():
    assert len(MODULES) > 20


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_file_is_short(path):
    lines = len(path.read_text(encoding="utf-8").splitlines())
    assert lines <= CAP, f"{name_of(path)} has {lines} lines, {CAP} are allowed; split it by subject"


def test_no_module_is_a_drawer_for_everything():
    assert not [name_of(path) for path in MODULES if path.stem.strip("_") in ("utils", "util", "helpers", "misc")]


@pytest.mark.parametrize("path", [p for p in MODULES if p.read_text(encoding="utf-8").strip()], ids=name_of)
def test_module_says_what_it_is(path):
    assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))), f"{name_of(path)} has no docstring"


def test_root_is_closed():
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    entries = {line.split("/")[0].strip('"') for line in listed.stdout.splitlines()}
    strangers = sorted(entry for entry in entries if not any(fnmatch(entry, pattern) for pattern in AT_ROOT))
    assert not strangers, f"at the root, where there is no place for them: {strangers}"


@pytest.mark.parametrize("module", ["creeping", "creeping.plotting"])
def test_import_is_light(module):
    heavy = ("numba", "matplotlib", "pyvista", "vtkmodules", "scipy", "trimesh", "sympy", "xarray")
    code = f"import sys, {module}; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]", f"import {module} drags in {done.stdout.strip()}"


def test_public_names_grow_on_purpose():
    import creeping

    assert creeping.__all__ == [
        "BodyError",
        "CreepingError",
        "DirectFlow",
        "FarField",
        "Growth",
        "Impedance",
        "IntegrationError",
        "InvalidInputError",
        "IsoPhaseCurve",
        "MapError",
        "PhaseMap",
        "RayFan",
        "RayStatus",
        "ShadowLine",
        "SingularIncidenceError",
        "StoredMapError",
        "SurfaceError",
        "ToleranceError",
        "__version__",
        "body_error",
        "build_phase_map",
        "check_surface",
        "choose_flow",
        "far_field",
        "far_field_uncertainty",
        "fibonacci_directions",
        "iso_phase_curves",
        "launch",
        "load_phase_map",
        "near_field",
        "shadow_line",
        "surface_field",
        "sweep_directions",
        "trace",
    ]
    assert all(getattr(creeping, name) is not None for name in creeping.__all__)


@pytest.mark.parametrize("path", MODULES, ids=name_of)
def test_cited_keys_are_in_the_bibliography(path):
    known = set(re.findall(r"@\w+\{(\w+),", (ROOT / "creeping" / "references.bib").read_text(encoding="utf-8")))
    cited = set(re.findall(r"\[([A-Z]{1,4}\d{2}[a-z]?)(?:, [^\]]*)?\]", path.read_text(encoding="utf-8")))
    assert cited <= known, f"{name_of(path)} cites {sorted(cited - known)}, which creeping/references.bib lacks"
