"""Notebooks of the site: read as text and run cell by cell, without Jupyter."""

import ast
import re

import pytest

import creeping
import scatterers
from studies.gallery.__main__ import NOTEBOOKS, PAGES

SOURCES = sorted(NOTEBOOKS.glob("*.md"))
_CELL = re.compile(r"^```\{code-cell\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)
pytestmark = pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)


def cells(source):
    return _CELL.findall(source.read_text(encoding="utf-8"))


def test_a_notebook_is_whole(source):
    """Title, link to its file, code that parses, public names, and a check."""
    text = source.read_text(encoding="utf-8")
    assert re.search(r"^---\n\n# \w.*\n\n\{nb-download\}`" + source.stem + r"\.ipynb`$", text, re.MULTILINE)
    assert len(cells(source)) == text.count("```{code-cell}") > 1
    nodes = [node for cell in cells(source) for node in ast.walk(ast.parse(cell))]
    assert any(isinstance(node, ast.Assert) for node in nodes)
    imported = {alias.name.split(".")[0] for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    imported |= {node.module.split(".")[0] for node in nodes if isinstance(node, ast.ImportFrom)}
    assert not imported & {"tests", "studies"}
    for alias, package in (("cr", creeping), ("sc", scatterers)):
        assert set(re.findall(rf"(?<![\w.]){alias}\.(\w+)", text)) <= set(package.__all__)
    for page in ("index", "notebooks"):
        assert f"(notebooks/{source.name})" in (PAGES / f"{page}.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_notebook_runs(source, tmp_path, monkeypatch):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    try:
        for number, cell in enumerate(cells(source)):
            exec(compile(cell, f"{source.name}, cell {number}", "exec"), names)
    finally:
        matplotlib.pyplot.close("all")
