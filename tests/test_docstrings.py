"""What docstrings must tell: sources of formulas, and of the public interface shapes, units and an example."""

import inspect
import re
from pathlib import Path

import creeping
import scatterers

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "studies" / "gallery" / "pages"
MODULES = sorted(path for folder in ("creeping", "scatterers") for path in (ROOT / folder).rglob("*.py"))
PUBLIC = {
    f"{package.__name__}.{name}": getattr(package, name)
    for package in (creeping, scatterers)
    for name in package.__all__
    if not name.startswith("_") and hasattr(package, name)
}
NO_SOURCE_NEEDED = {"creeping/files/ffe.py"}
"""Modules whose equations are conversions of units, or conventions of a file format."""
_KEY = re.compile(r"\[[A-Z]{1,4}\d{2}[a-z]?(?:, [^\]]*)?\]")
_SECTIONS = re.compile(r"[Dd]erivations?(?:,|:) ((?:[RFB]\d+(?:, | and | to )?)+)")
_EQUATION = re.compile(r"^ {4,}.*(?:=|<-|<=)", re.MULTILINE)
_SHAPE = re.compile(r"\((?:\.\.\.|\d|[a-z]\w*)(?:[^()]*,[^()]*)?\)")
_UNIT = re.compile(r"(?<![\w.])(?:1/)?L(?:\^\d)?(?!\w)|\bradians\b|\bunit|\btime\b|\bdirections?\b|\bmetres\b")


def head(path):
    """What a module says of itself: read, as parsing all of them takes seconds."""
    found = re.match(r'r?"""(.*?)"""', path.read_text(encoding="utf-8"), re.DOTALL)
    return inspect.cleandoc(found[1]) if found else ""


def name_of(path):
    return path.relative_to(ROOT).as_posix()


def public_functions():
    """Functions of the public interface, methods and constructors of its classes among them, by name."""
    for name, thing in PUBLIC.items():
        if inspect.isfunction(thing):
            yield name, thing, inspect.getdoc(thing) or ""
        elif inspect.isclass(thing):
            for attribute, member in vars(thing).items():
                function = getattr(member, "__func__", member)
                if not inspect.isfunction(function):
                    continue
                if attribute in ("__init__", "__post_init__"):
                    yield name, function, inspect.getdoc(thing) or ""
                elif not attribute.startswith("_"):
                    yield f"{name}.{attribute}", function, inspect.getdoc(function) or ""


def takes_arrays(function):
    annotations = [parameter.annotation for parameter in inspect.signature(function).parameters.values()]
    text = " ".join(map(str, annotations))
    return "ndarray" in text or "ArrayLike" in text or "_SupportsArray" in text


def is_special_error(thing):
    return inspect.isclass(thing) and issubclass(thing, creeping.CreepingError) and thing is not creeping.CreepingError


def test_modules_with_equations_name_their_source():
    bare = []
    for path in MODULES:
        text = head(path)
        if _EQUATION.search(text) and not (_KEY.search(text) or _SECTIONS.search(text)):
            bare.append(name_of(path))
    bare = sorted(set(bare) - NO_SOURCE_NEEDED)
    assert not bare, f"give a [KEY] or 'Derivations, R1' below the equations of {bare}"


def test_cited_derivations_are_there():
    there = {
        section
        for page in PAGES.glob("derivations_*.md")
        for section in re.findall(r"^## ([RFB]\d+)\. ", page.read_text(encoding="utf-8"), re.MULTILINE)
    }
    wrong = []
    for path in [*MODULES, *PAGES.glob("*.md")]:
        for cited in _SECTIONS.findall(path.read_text(encoding="utf-8")):
            wrong += [f"{name_of(path)}: {number}" for number in re.findall(r"[RFB]\d+", cited) if number not in there]
    assert len(there) > 30
    assert not wrong, f"no section of the derivations: {wrong}"


def test_every_derivation_is_cited_by_the_code():
    text = " ".join(" ".join(_SECTIONS.findall(path.read_text(encoding="utf-8"))) for path in MODULES)
    cited = set(re.findall(r"[RFB]\d+", text))
    for letter, first, last in re.findall(r"([RFB])(\d+) to [RFB](\d+)", text):
        cited |= {f"{letter}{k}" for k in range(int(first), int(last) + 1)}
    for page in PAGES.glob("derivations_*.md"):
        sections = set(re.findall(r"^## ([RFB]\d+)\. ", page.read_text(encoding="utf-8"), re.MULTILINE))
        assert sections <= cited, f"no module cites {sorted(sections - cited)} of {page.name}"


def test_public_objects_have_an_example():
    # errors show themselves by the example of their base
    shown = {name: thing for name, thing in PUBLIC.items() if not is_special_error(thing)}
    bare = {name for name, thing in shown.items() if ">>> " not in (inspect.getdoc(thing) or "")}
    assert len(PUBLIC) > 30 and not bare, f"without an example: {sorted(bare)}"


def test_public_functions_of_arrays_state_shapes_and_units():
    bare = [
        f"{name} ({what})"
        for name, function, text in public_functions()
        if takes_arrays(function)
        for what, pattern in (("shape", _SHAPE), ("unit", _UNIT))
        if not pattern.search(text)
    ]
    assert not bare, f"say shapes and units of {bare}"


def test_public_functions_state_their_errors():
    bare = [
        name
        for name, function, text in public_functions()
        if function.__code__.co_filename.endswith(".py")
        and "raise " in inspect.getsource(function)
        and "Raises" not in text
    ]
    assert not bare, f"say what {bare} raise"
