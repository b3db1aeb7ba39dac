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
from creeping import InvalidInputError
from creeping.commands.main import app
from creeping.sweeping.studyfile.study import parse_study
from studies import __main__ as command
from studies import field_sphere
from studies.gallery import building
from studies.gallery.figure_page import flattened, from_docstring, gallery_page

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
    more = "limitations notation notebooks own_body performance sweeps theory"
    assert [page.stem for page in PAGES] == [*expected.split(), *more.split()]


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_fences_are_paired_and_of_known_kinds(page):
    kinds = [kind for _, kind, _ in _FENCE.findall(text_of(page))]
    assert set(kinds) <= {"python", "sh", "text", "toml", "{toctree}"}
    assert text_of(page).count("```") == 2 * len(kinds)
    # or the fence would become expected output
    assert all(body.endswith("\n\n") for body in blocks(page, "python"))
    assert all(body.startswith(">>> ") for body in blocks(page, "python"))


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_dotted_names_are_there(page):
    names = {code for code in inline(page) if re.fullmatch(r"(creeping|scatterers|studies)(\.\w+)+", code)}
    names |= set(re.findall(r"\b(?:creeping|scatterers|studies)(?:\.\w+)+", "\n".join(blocks(page, "text"))))
    for name in sorted(names):
        parts = name.split(".")
        found, depth = importlib.import_module(parts[0]), 1
        while depth < len(parts):
            part = parts[depth]
            if not hasattr(found, part):
                importlib.import_module(".".join(parts[: depth + 1]))
            found, depth = getattr(found, part), depth + 1
        assert found is not None, name


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_title_ofs_are_public(page):
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
def test_commands_of_shell_blocks_are_understood(page):
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


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_commands_in_the_text_are_there(page):
    for code in inline(page):
        words = code.split()
        if words[:2] == ["python", "-m"]:
            study_is_there(words[2:])
        elif words[0] == "creeping" and len(words) > 1 and not words[1].startswith("-"):
            app[words[1]]


@pytest.mark.parametrize("page", PAGES, ids=by_name)
def test_study_files_are_understood(page):
    for text in blocks(page, "toml"):
        assert parse_study(text, folder=Path(".")).asked["flow"] == "auto"


def study_is_there(words):
    """Assert that ``studies...`` can be run, with these options."""
    name = words[0].removeprefix("studies").removeprefix(".")
    if not name:
        assert len(words) == 1 or words[1] in command.sources(), words
        return
    source = command.sources()[name]
    text = text_of(source if source.stem == name else source.with_name("__main__.py"))
    assert all(f'"{word}"' in text for word in words[1:] if word.startswith("-")), words


def test_all_studies_are_listed():
    done = subprocess.run([sys.executable, "-m", "studies"], cwd=ROOT, capture_output=True, text=True, check=True)
    rows = dict(line.split(maxsplit=1) for line in done.stdout.split("\n\n")[0].splitlines())
    folder = Path(studies.__file__).parent
    modules = {path.stem for path in folder.glob("*.py") if not path.stem.startswith("_")}
    assert set(rows) == set(studies.FIGURES) | modules - set(studies.FIGURES.values()) | {"gallery", "fuzz"}
    assert {name: rows[name] for name in studies.FIGURES} == studies.titles()
    assert {"field_sphere", "flow_speed", "sweep_lines", "sweep_speed", "map_accuracy", "fitted_bodies"} <= set(rows)


def test_every_study_runs_by_its_name():
    for name, source in command.sources().items():
        runs = source if source.stem != "__init__" else source.with_name("__main__.py")
        assert name in studies.FIGURES or 'if __name__ == "__main__":' in text_of(runs), name


def test_a_study_gets_its_options(monkeypatch):
    seen = []
    monkeypatch.setattr(command.runpy, "run_module", lambda name, **_: seen.append((name, sys.argv[1:])))
    before = sys.argv
    command.main(["flow_speed", "--quick", "--tables", "1"])
    command.main(["gallery", "-o", "site"])
    assert seen == [("studies.flow_speed", ["--quick", "--tables", "1"]), ("studies.gallery", ["-o", "site"])]
    assert sys.argv is before


def test_a_figure_is_drawn_into_out(monkeypatch, capsys):
    drawn = []
    card = {"file": "fig2-grid.png", "seconds": 1.0, "headline": "rms"}
    monkeypatch.setattr(studies, "draw", lambda name, folder, quick: drawn.append((name, str(folder), quick)) or card)
    with pytest.raises(SystemExit) as ended:
        command.main(["fig2-grid", "--quick"])
    assert ended.value.code == 0
    assert drawn == [("fig2-grid", "out", True)]
    assert "rms" in capsys.readouterr().out


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["field_spheres"], "did you mean field_sphere?"),
        (["nothing"], "python -m studies lists them"),
        (["field_cost", "--quick"], "takes no options"),
    ],
)
def test_what_there_is_not_is_refused(arguments, message, capsys):
    with pytest.raises(SystemExit) as ended:
        command.main(arguments)
    assert ended.value.code == 2
    assert message in capsys.readouterr().err


def test_help_of_a_study_without_options_is_its_docstring(capsys):
    command.main(["field_sphere", "--help"])
    assert squeezed(capsys.readouterr().out) == squeezed(field_sphere.__doc__)


def test_docstring_becomes_text():
    docstring = "Title.\n\nOf n*d and [YC06b] with ``a*b``:\n\n    x = |w|^2\n      + y\n\n- no list <b>\n"
    assert from_docstring(docstring) == (
        "Of n\\*d and \\[YC06b\\] with ``a*b``:\n\n```text\nx = |w|^2\n  + y\n```\n\n\\- no list \\<b\\>"
    )
    assert from_docstring("Title.") == ""


def test_sidecar_becomes_rows():
    card = {"map": {"rms": 1.23456e-7, "samples": 3}, "nodes_of": [16, 64.0], "fits": True, "none": None}
    assert flattened(card) == [
        ("map, rms", "1.235e-07"),
        ("map, samples", "3"),
        ("nodes of", "16, 64"),
        ("fits", "yes"),
        ("none", "none"),
    ]


def test_rows_of_the_gallery_are_full():
    page = gallery_page([{"name": f"n{k}", "file": f"n{k}.png", "title": f"Figure {k}: a."} for k in range(4)])
    assert len(re.findall(r"^\* -", page, re.MULTILINE)) == 2
    assert len(re.findall(r"^  -", page, re.MULTILINE)) == 4


def test_unknown_figure_leaves_nothing(tmp_path):
    pytest.importorskip("sphinx")
    pytest.importorskip("myst_parser")
    with pytest.raises(InvalidInputError, match="fig3-circles"):
        building.build_site(tmp_path / "site", ["fig7"])
    assert not (tmp_path / "site").exists()


def built(folder, *names):
    """Build a site by its command, quickly."""
    for package in ("sphinx", "myst_parser"):
        pytest.importorskip(package)
    words = [sys.executable, "-m", "studies.gallery", "-o", str(folder), "--quick", *names]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert Path(done.stdout.strip()) == folder / "index.html"
    for page in folder.rglob("*.html"):
        assert not _LOADED.findall(text_of(page)), f"{page.name} loads from a network"
    for style in folder.rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*[\"']?(https?:)?//", text_of(style)), f"{style.name} does"


def assert_shows(folder, name):
    """Assert that the page of a figure has all that its study and sidecar tell."""
    page = text_of(folder / "gallery" / f"{name}.html")
    card = json.loads(text_of(folder / "figures" / f"{name}.json"))
    source = re.search(rf'<img [^>]*src="\.\./(_images/{name}[^"]*\.png)"', page)
    assert source and (folder / source[1]).stat().st_size == (folder / "figures" / card["file"]).stat().st_size
    read = squeezed(html.unescape(re.sub(r"<[^>]+>", "", page)))
    module = importlib.import_module(f"studies.{studies.FIGURES[name]}")
    assert squeezed(card["headline"]) in read
    assert card["title"].rstrip(".") in read
    assert squeezed(text_of(Path(module.__file__))) in read
    below = module.__doc__.partition("\n")[2]
    assert squeezed(below.replace("`", "")) in read
    assert f"Drawn in {card['seconds']:g} s." in read
    for parameter in card["parameters"]:
        assert parameter.replace("_", " ") in read
    index = text_of(folder / "gallery" / "index.html")
    assert f'href="{name}.html"' in index and f"_images/{name}" in index


@pytest.mark.slow
def test_site_of_one_figure(tmp_path):
    built(tmp_path / "site", CHEAP)
    assert_shows(tmp_path / "site", CHEAP)
    for page in PAGES:
        title = re.match(r"# (.*)\n", text_of(page))[1]
        assert title in html.unescape(text_of(tmp_path / "site" / f"{page.stem}.html"))


@pytest.mark.slow
def test_site_of_all_figures(tmp_path):
    built(tmp_path / "site")
    for name in studies.FIGURES:
        assert_shows(tmp_path / "site", name)
