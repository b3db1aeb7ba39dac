"""The pages speak of what there is, the gallery is made from its studies, and the site needs no network."""

import html
import importlib
import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import creeping
import scatterers
import studies
from creeping.commands.main import app
from creeping.sweeping.study import parse_study
from studies import __main__ as command
from studies.gallery import __main__ as building
from studies.gallery.__main__ import TASKS

ROOT = Path(__file__).parents[2]
PAGES = sorted(building.PAGES.glob("*.md"))
CHEAP = "fig2-grid"
"""With equations and references in its docstring."""
_FENCE = re.compile(r"^( *)```(\S*)\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
_LOADED = re.compile(
    r"<(?:script|link|img|iframe|object|source|video)\b[^>]*(?:src|href|data)=\"(?:https?:)?//[^\"]*\""
)


def text_of(path):
    return path.read_text(encoding="utf-8")


def blocks(path, language):
    return [body for _, kind, body in _FENCE.findall(text_of(path)) if kind == language]


def inline(path):
    return [code for line in _FENCE.sub("", text_of(path)).splitlines() for code in re.findall(r"`([^`]+)`", line)]


def squeezed(text):
    return " ".join(text.split())


def by_name(path):
    return path.stem


def test_there_are_the_pages():
    expected = "accuracy benchmarks conventions derivations_bodies derivations_field derivations_rays echoes index"
    more = "limitations notebooks own_body performance sweeps theory"
    assert [page.stem for page in PAGES] == [*expected.split(), *more.split()]


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_dotted_names_are_there(page):
    names = {code for code in inline(page) if re.fullmatch(r"(creeping|scatterers|studies|tests)(\.\w+)+", code)}
    names |= set(re.findall(r"\b(?:creeping|scatterers|studies|tests)(?:\.\w+)+", "\n".join(blocks(page, "text"))))
    for name in sorted(names):
        parts = name.split(".")
        found, depth = importlib.import_module(parts[0]), 1
        while depth < len(parts):
            part = parts[depth]
            if not hasattr(found, part):
                importlib.import_module(".".join(parts[: depth + 1]))
            found, depth = getattr(found, part), depth + 1
        assert found is not None, name
    for alias, package in (("cr", creeping), ("sc", scatterers)):
        codes = [*inline(page), *blocks(page, "python")]
        names = {name for code in codes for name in re.findall(rf"(?<![\w.]){alias}\.(\w+)", code)}
        assert names <= set(package.__all__), page.name


@pytest.mark.parametrize("package", [creeping, scatterers], ids=lambda package: package.__name__)
def test_every_public_name_is_in_some_page(package):
    code = "\n".join(code for page in PAGES for code in [*inline(page), *blocks(page, "python")])
    unsaid = [name for name in package.__all__ if not name.startswith("_") and not re.search(rf"\b{name}\b", code)]
    assert not unsaid, f"no page speaks of {unsaid}"


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_cited_keys_are_in_the_bibliography(page):
    known = set(re.findall(r"@\w+\{(\w+),", text_of(ROOT / "creeping" / "references.bib")))
    cited = set(re.findall(r"\[([A-Z]{1,4}\d{2}[a-z]?)(?:, [^\]]*)?\]", text_of(page)))
    assert cited <= known
    assert cited or page.stem != "theory"


def commands(line):
    """Commands of a line of a shell block, as words."""
    for part in line.split("&&"):
        words = shlex.split(part, comments=True)
        while words and re.fullmatch(r"\w+=\S*", words[0]):
            words = words[1:]
        if words:
            words = words[: words.index(">")] if ">" in words else words
            yield [Path(words[0]).name, *words[1:]]


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_commands_and_studies_are_understood(page):
    lines = [line for block in blocks(page, "sh") for line in block.splitlines()]
    for words in [words for line in lines for words in commands(line)]:
        if words[0] == "creeping":
            app.parse_args(words[1:], exit_on_error=False, print_error=False)
            if words[1] == "figure":
                assert words[2].startswith("-") or words[2] in studies.FIGURES, words
        elif words[:2] == ["python", "-m"]:
            study_is_there(words[2:])
        else:
            assert words[0] in ("python3", "pip"), f"{words[0]} is not checked"
    for code in inline(page):
        words = code.split()
        if words[:2] == ["python", "-m"]:
            study_is_there(words[2:])
        elif words[0] == "creeping" and len(words) > 1 and not words[1].startswith("-"):
            app[words[1]]
    for text in blocks(page, "toml"):
        assert parse_study(text, folder=Path(".")).flow == "auto"


def study_is_there(words):
    """Assert that ``studies NAME``, the gallery or the fuzzing can be run, with these options and tables."""
    if words[0] in ("studies.gallery", "tests.fuzz"):
        known = text_of(ROOT.joinpath(*words[0].split("."), "__main__.py"))
    elif len(words) == 1:
        return
    else:
        known = text_of(command.sources()[words[1]])
        for table in words[words.index("--tables") + 1 :] if "--tables" in words else ():
            assert f"def {table}(" in known, words
        known += text_of(Path(studies.__file__))
    assert all(f'"{word}"' in known for word in words[1:] if word.startswith("-")), words


@pytest.mark.parametrize("package", [creeping, scatterers], ids=lambda package: package.__name__)
def test_every_public_name_is_in_the_reference_once(package):
    listed = [name for _, names in TASKS.values() for name in names.get(package.__name__, "").split()]
    assert sorted(listed) == sorted(name for name in package.__all__ if name != "__version__")


def test_all_studies_are_listed():
    done = subprocess.run([sys.executable, "-m", "studies"], cwd=ROOT, capture_output=True, text=True, check=True)
    rows = dict(line.split(maxsplit=1) for line in done.stdout.split("\n\n")[0].splitlines())
    folder = Path(studies.__file__).parent
    texts = {path: text_of(path) for part in ("accuracy", "cost", "figures") for path in (folder / part).glob("*.py")}
    runs = {path.stem for path, text in texts.items() if "\n    main(" in text or "\n        main(" in text}
    assert len(runs) > 8
    assert set(rows) == set(studies.FIGURES) | runs | {"gallery"}
    assert {name: rows[name] for name in studies.FIGURES} == studies.titles()


def test_a_study_gets_its_options(monkeypatch):
    seen = []
    monkeypatch.setattr(command.runpy, "run_module", lambda name, **_: seen.append((name, sys.argv[1:])))
    before = sys.argv
    command.main(["flow_speed", "--quick", "--tables", "sizes"])
    command.main(["gallery", "-o", "site"])
    assert seen == [
        ("studies.cost.flow_speed", ["--quick", "--tables", "sizes"]),
        ("studies.gallery.__main__", ["-o", "site"]),
    ]
    assert sys.argv is before


def test_tables_are_printed_as_they_are_asked_for(capsys):
    def numbers(count=3):
        """Numbers and their squares."""
        return ({"number": f"{k}", "square": float(k * k)} for k in range(count))

    def others():
        """Others."""
        raise AssertionError("not asked for")

    studies.main((numbers, others), {"numbers": {"count": 2}}, arguments=["--tables", "numbers", "--quick"])
    lines = [line.split() for line in capsys.readouterr().out.splitlines() if line]
    assert lines == [["Numbers", "and", "their", "squares."], ["number", "square"], ["0", "0"], ["1", "1"]]
    with pytest.raises(SystemExit):
        studies.main((numbers,), arguments=["--tables", "cubes"])


@pytest.mark.slow
def test_site_of_one_figure(tmp_path):
    """Built by its command, quickly: it loads nothing from a network, and shows what study and sidecar tell."""
    for package in ("sphinx", "myst_nb", "furo"):
        pytest.importorskip(package)
    words = [sys.executable, "-m", "studies.gallery", "-o", str(tmp_path / "site"), "--quick", CHEAP]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    folder = Path(done.stdout.strip()).parent
    for page in folder.rglob("*.html"):
        assert not _LOADED.findall(text_of(page)), f"{page.name} loads from a network"
    for style in folder.rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*[\"']?(https?:)?//", text_of(style)), f"{style.name} does"
    page, card = (text_of(folder / name) for name in (f"gallery/{CHEAP}.html", f"figures/{CHEAP}.json"))
    source = re.search(rf'<img [^>]*src="\.\./(_images/{CHEAP}[^"]*\.png)"', page)
    assert source and (folder / source[1]).exists()
    read, card = squeezed(html.unescape(re.sub(r"<[^>]+>", "", page))), json.loads(card)
    function = studies.drawer(CHEAP)
    below = function.__doc__.partition("\n")[2].replace("`", "")
    source = text_of(Path(sys.modules[function.__module__].__file__))
    for told in (card["headline"], card["title"].rstrip("."), source, below):
        assert squeezed(told) in read
    assert f"Drawn in {card['seconds']:g} s." in read
    assert all(parameter.replace("_", " ") in read for parameter in card["parameters"])
    assert f'href="{CHEAP}.html"' in text_of(folder / "gallery" / "index.html")
    assert (folder / "objects.inv").exists()
    assert 'id="creeping.far_field"' in text_of(folder / "reference" / "fields.html")
    for page in PAGES:
        title = re.match(r"# (.*)\n", text_of(page))[1]
        assert title in html.unescape(text_of(folder / f"{page.stem}.html"))
