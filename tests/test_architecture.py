"""The rules of the house that no tool checks: sizes, names, a closed root, a light import, what a kernel may import."""

import ast
import gc
import re
import subprocess
import sys
import tomllib
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

import pytest

import creeping.files
import creeping.plotting
import scatterers

ROOT = Path(__file__).parents[1]
FOLDERS = ("creeping", "scatterers", "studies", "tests")


@cache
def texts():
    files = (path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py")))
    return {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in files}


@cache
def product():
    # the collector would look through all nodes again and again
    gc.disable()
    found = {name: ast.parse(text) for name, text in texts().items() if name.startswith(("creeping/", "scatterers/"))}
    gc.enable()
    return found


@cache
def kernels():
    return {name: tree for name, tree in product().items() if Path(name).parent.name == "kernels"}


PACKAGES = (creeping, creeping.files, creeping.plotting, scatterers)
COMPILERS = ("numba", "llvmlite")
CAP = 500
AT_ROOT = (*FOLDERS, "pyproject.toml", "README.md", "LICENSE", "CHANGELOG.md", "CITATION.cff", "constraints*.txt", ".*")


# modules outside `kernels` folders whose constants (names in capitals) kernels share; types and errors are not compiled
SHARED_CONSTANTS = (
    "creeping.geodesics.tableaus",
    "creeping.rays.quantities",
)
NOT_COMPILED = ("creeping._typing", "creeping.errors", "platformdirs")


def imports(tree, *, inside_functions=True):
    """Pairs (module, name or "") of all imports but those for type checkers alone."""
    for node in tree.body if isinstance(tree, ast.Module) else ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.module, alias.name) for alias in node.names)
        elif isinstance(node, ast.FunctionDef) and not inside_functions:
            continue
        elif not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            yield from imports(node, inside_functions=inside_functions)


def test_modules_are_short_and_say_what_they_are():
    assert len(texts()) > 20 and len(kernels()) > 5
    lengths = {name: len(text.splitlines()) for name, text in texts().items()}
    assert not {name: lines for name, lines in lengths.items() if lines > CAP}, "too long: split by subject"
    assert not [name for name in texts() if Path(name).stem.strip("_") in ("utils", "util", "helpers", "misc")]
    assert not [name for name, text in texts().items() if text.strip() and not re.match(r'r?"""\S', text)]


def test_no_module_has_the_name_of_a_public_function_of_its_own():
    # or importing the module replaces the function in the package's namespace
    public = {name for package in PACKAGES for name in package.__all__}
    assert not [
        name
        for name, tree in product().items()
        for node in tree.body
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == Path(name).stem and node.name in public
    ]


def test_only_kernels_import_a_compiler():
    assert not [
        name
        for name, tree in product().items()
        if name not in kernels()
        for module, _ in imports(tree, inside_functions=False)
        if module.split(".")[0] in COMPILERS
    ]


def test_kernels_import_what_their_cache_watches():
    """Kernels, numpy, the compiler and constants: what else a kernel takes would not make a cached one stale."""

    def allowed(module, name):
        if module.split(".")[0] in (*sys.stdlib_module_names, "numpy", *COMPILERS) or module in NOT_COMPILED:
            return True
        return "kernels" in module.split(".") or (module in SHARED_CONSTANTS and name.isupper())

    strangers = [(name, *found) for name, tree in kernels().items() for found in imports(tree) if not allowed(*found)]
    assert not strangers


def test_kernels_that_python_calls_are_not_inlined():
    """Into the wrapper that numba makes of them: they would be compiled twice."""
    called = {
        (module.replace(".", "/") + ".py", name)
        for file, tree in product().items()
        if file not in kernels()
        for module, name in imports(tree)
    }
    inlined = {
        (file, node.name)
        for file, tree in kernels().items()
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
        and "njit(**options)" in map(ast.unparse, node.decorator_list)
        and "strict_options as options" not in texts()[file]
    }
    # the integrators would compile no sooner, and are slower by some per cent
    integrators = {file for file in kernels() if Path(file).stem == "integrator"}
    assert not {(file, name) for file, name in called & inlined if file not in integrators}


def test_root_is_closed():
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    entries = {line.split("/")[0].strip('"') for line in listed.stdout.splitlines()}
    strangers = sorted(entry for entry in entries if not any(fnmatch(entry, pattern) for pattern in AT_ROOT))
    assert not strangers, f"at the root, where there is no place for them: {strangers}"


@pytest.mark.parametrize("module", ["creeping", "creeping.plotting", "studies"])
def test_import_is_light(module):
    heavy = ("numpy",) * (module != "creeping.plotting") + (
        "numba",
        "matplotlib",
        "pyvista",
        "vtkmodules",
        "scipy",
        "trimesh",
        "sympy",
        "xarray",
    )
    code = f"import sys, {module}; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]", f"import {module} drags in {done.stdout.strip()}"


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_public_names_are_there_and_say_what_they_are(package):
    # that a page speaks of each of them: tests/studies/test_gallery.py
    documents = {name: getattr(package, name).__doc__ or "" for name in package.__all__ if not name.startswith("_")}
    # a dataclass without a docstring is given its signature
    assert not [name for name, text in documents.items() if not text or text.startswith(f"{name}(")]


def test_cited_keys_are_in_the_bibliography():
    known = set(re.findall(r"@\w+\{(\w+),", (ROOT / "creeping" / "references.bib").read_text(encoding="utf-8")))
    cited = {name: set(re.findall(r"\[([A-Z]{1,4}\d{2}[a-z]?)(?:, [^\]]*)?\]", text)) for name, text in texts().items()}
    assert not {name: sorted(keys - known) for name, keys in cited.items() if keys - known}


def required(extra, known):
    """Names of the packages that an extra asks for, those of extras in it, too."""
    found = set()
    for line in known[extra]:
        inner = re.fullmatch(r"creeping\[(.*)\]", line)
        if inner:
            found |= {name for one in inner[1].split(",") for name in required(one, known)}
        else:
            found.add(re.match(r"[\w.-]+", line)[0].lower())
    return found


def test_all_can_be_had_without_the_gpl():
    known = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert required("all", known) == required("all-but-gpl", known) | {"gmsh"}
    assert "gmsh" not in required("all-but-gpl", known)


def test_the_whole_tree_is_pinned_for_one_python():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    assert re.match(r"# Python 3\.\d+:", lines[0])
    pins = [line.partition("==") for line in lines if not line.startswith("#")]
    assert all(equals and version for _, equals, version in pins)
    names = {name.lower().replace("_", "-") for name, _, _ in pins}
    asked = required("test", project["optional-dependencies"])
    asked |= {re.match(r"[\w.-]+", line)[0].lower() for line in project["dependencies"]}
    assert not asked - names, "not pinned: write constraints.txt anew by pip freeze --exclude-editable"
    # what those packages ask for themselves
    assert {"llvmlite", "vtk", "msgpack", "tornado"} <= names
