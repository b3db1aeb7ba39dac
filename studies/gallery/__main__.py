"""The project's pages and its figures as a site: ``python -m studies.gallery -o DIR [--quick] [NAME ...]``.

Figures are drawn, sources of all pages gathered, HTML made by Sphinx, every warning an error. HTML loads nothing from
a network: a built-in theme, fonts of the reader's machine, equations as text.

Also here: markdown of the gallery: a page of each figure from its study and sidecar, and the page that shows them all;
and pages of the reference: every public name by what one wants to do with it, from the docstrings, by autodoc and
napoleon.
"""

import argparse
import inspect
import re
import shutil
import sys
import tempfile
from importlib import import_module
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import Any

import creeping
import studies
from creeping import CreepingError
from creeping._version import __version__
from studies import FIGURES

PAGES = Path(__file__).parent / "pages"
NOTEBOOKS = Path(__file__).parent / "notebooks"
STYLE = """\
table.docutils { display: block; overflow-x: auto; max-width: 100%; }
article table.thumbnails td { vertical-align: top; width: 33%; }
.highlight pre { overflow-x: auto; }
img { max-width: 100%; height: auto; background: white; }
"""
CONFIGURATION: dict[str, Any] = {
    "project": "creeping",
    "copyright": "the creeping developers",
    "version": __version__,
    "release": __version__,
    "extensions": ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"],
    "autodoc_default_options": {"members": True, "exclude-members": "__init__, __new__"},
    "autodoc_typehints": "none",
    "autodoc_class_signature": "mixed",
    "napoleon_google_docstring": False,
    "napoleon_use_ivar": True,
    "napoleon_use_rtype": False,
    # attributes of several results have one name
    "suppress_warnings": ["ref.python"],
    "myst_heading_anchors": 3,
    "nb_execution_in_temp": True,
    "nb_execution_raise_on_error": True,
    "nb_execution_timeout": 600,
    "nb_merge_streams": True,
    "smartquotes": False,
    "html_theme": "furo",
    "html_title": "creeping",
    "html_static_path": ["style"],
    "html_css_files": ["custom.css"],
    "html_copy_source": False,
    "html_show_sourcelink": False,
    "html_scaled_image_link": False,
}
"""The theme has its fonts, scripts and a dark palette with it."""

COLUMNS = 3
"""Thumbnails in a row."""
_CODE = re.compile(r"(``.*?``|`[^`]*`)", re.DOTALL)
TASKS: dict[str, tuple[str, dict[str, str]]] = {
    "bodies": (
        "Bodies",
        {
            "scatterers": "Sphere Ellipsoid TwistedEllipsoid Torus Cylinder Cone Capsule ConeSphere Ogive DoubleOgive "
            "Almond Revolution Implicit Gridded Mesh Cad Facets Bodies examined_mesh ExpressionSpeed Coating",
            "creeping": "check_surface body_uncertainty BodyUncertainty",
        },
    ),
    "waves": (
        "Waves and boundaries",
        {"creeping": "PlaneWave PointSource ImpedanceBoundary wavenumber fibonacci_directions"},
    ),
    "rays": (
        "Shadow lines and creeping rays",
        {
            "creeping": "shadow_line ShadowLine launch RayFan RayStatus iso_phase_curves IsoPhaseCurve trace "
            "ErrorEstimate"
        },
    ),
    "flows": (
        "Phase maps and other flows",
        {"creeping": "choose_flow build_phase_map PhaseMap ErrorGrowth load_phase_map DirectFlow"},
    ),
    "fields": (
        "Fields of one incidence",
        {
            "creeping": "solve Solution far_field FarField near_field NearField surface_field SurfaceField field_cut "
            "FieldCut conductor_field ConductorField Fields conductor_current ConductorCurrent surface_currents "
            "SurfaceCurrents FieldStatus validity Validity far_field_uncertainty compare Comparison"
        },
    ),
    "sweeps": (
        "Echoes, sweeps and T-matrices",
        {
            "creeping": "backscatter bistatic Echo sweep_directions t_matrix t_matrices "
            "orientation_averages TMatrix impulse_response ImpulseResponse range_profile RangeProfile"
        },
    ),
    "antennas": (
        "Sources and antennas",
        {
            "creeping": "source_pattern SourcePattern coupling Coupling CouplingPaths slot_coupling monopole_coupling "
            "antenna_coupling port_field PortField"
        },
    ),
    "errors": (
        "Errors that are raised",
        {
            "creeping": "CreepingError InvalidInputError SurfaceError IntegrationError ToleranceError "
            "SingularIncidenceError StoredMapError"
        },
    ),
}
"""Title of each page of the reference, and its names by package."""


def main(arguments: list[str] | None = None) -> None:
    """Build the site; exits with 3 if a figure cannot be drawn or the pages have mistakes."""
    parser = argparse.ArgumentParser(prog="python -m studies.gallery", description="Pages and gallery as HTML.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"figures, all if none is given: {', '.join(FIGURES)}")
    parser.add_argument(
        "-o", dest="folder", metavar="DIR", type=Path, default=Path("out/site"), help="folder (%(default)s)"
    )
    parser.add_argument("--quick", action="store_true", help="coarser figures, drawn faster")
    parser.add_argument("--pages-only", action="store_true", help="no figures")
    given = parser.parse_args(arguments)
    try:
        missing = [package for package in ("sphinx", "myst_nb", "furo") if find_spec(package) is None]
        if missing:
            raise CreepingError(f"the site needs {' and '.join(missing)}: pip install 'creeping[docs]'")
        names = [] if given.pages_only else list(dict.fromkeys(given.names)) or list(FIGURES)
        for name in names:
            studies.drawer(name)
        folder, cards = given.folder.absolute(), []
        for name in names:
            cards.append(studies.draw(name, folder / "figures", quick=given.quick))
            print(f"{name}  {cards[-1]['seconds']:.1f} s  {cards[-1]['headline']}", file=sys.stderr)
        print("pages", file=sys.stderr)
        with tempfile.TemporaryDirectory(prefix="creeping-site-") as work:
            sources = Path(work) / "sources"
            gather(sources, cards, folder / "figures")
            make_html(sources, folder, Path(work) / "doctrees", run_notebooks=not given.pages_only)
    except CreepingError as error:
        print(f"studies.gallery: {error}", file=sys.stderr)
        raise SystemExit(3) from None
    print(folder / "index.html")


def gather(sources: Path, cards: list[dict[str, Any]], figures: Path) -> None:
    """Write what Sphinx reads: pages, notebooks, gallery, pictures, thumbnails and the style."""
    shutil.copytree(PAGES, sources)
    shutil.copytree(NOTEBOOKS, sources / "notebooks")
    shutil.copy(Path(creeping.__file__).with_name("references.bib"), sources)
    for name in ("gallery/thumbs", "figures", "style"):
        (sources / name).mkdir(parents=True)
    (sources / "style" / "custom.css").write_text(STYLE, encoding="utf-8")
    for card in cards:
        function = studies.drawer(card["name"])
        module = import_module(function.__module__)
        shutil.copy(figures / card["file"], sources / "figures")
        thumbnail(figures / card["file"], sources / "gallery" / "thumbs" / card["file"])
        path = f"studies/figures/{Path(str(module.__file__)).name}"
        page = figure_page(card, inspect.getdoc(function) or "", path, inspect.getsource(module))
        (sources / "gallery" / f"{card['name']}.md").write_text(page, encoding="utf-8")
    (sources / "gallery" / "index.md").write_text(gallery_page(cards), encoding="utf-8")
    write_reference(sources / "reference")


def thumbnail(picture: Path, target: Path) -> None:
    """Write a smaller picture."""
    from PIL import Image

    with Image.open(picture) as image:
        small = image.convert("RGB")
        small.thumbnail((480, 480))
        small.save(target)


def make_html(sources: Path, folder: Path, doctrees: Path, *, run_notebooks: bool) -> None:
    """Run Sphinx.

    Raises
    ------
    CreepingError
        If it warns or fails, or a cell of a notebook does.
    """
    from sphinx.application import Sphinx
    from sphinx.errors import SphinxError
    from sphinx.util.docutils import docutils_namespace, patch_docutils

    warnings = StringIO()
    configuration = CONFIGURATION | {"nb_execution_mode": "force" if run_notebooks else "off"}
    try:
        with patch_docutils(), docutils_namespace():
            app = Sphinx(
                sources, None, folder, doctrees, "html", configuration, status=None, warning=warnings, freshenv=True
            )
            # before napoleon reads them
            app.connect("autodoc-process-docstring", _plain_lines, priority=400)
            app.connect("autodoc-process-signature", _signature)
            app.build(force_all=True)
    except SphinxError as error:
        raise CreepingError(f"the pages cannot be built: {error}") from error
    lines = [line for line in warnings.getvalue().splitlines() if line.strip()]
    if lines or app.statuscode:
        raise CreepingError(f"{len(lines)} warnings of the pages, which must have none:\n  " + "\n  ".join(lines))


def _plain_lines(_app: Any, _what: str, _name: str, _obj: Any, _options: Any, lines: list[str]) -> None:
    """Keep bars and stars of formulas in docstrings from being markup; examples stay as they are."""
    example = False
    for number, line in enumerate(lines):
        example = line.lstrip().startswith(">>>") or (example and bool(line.strip()))
        if not example:
            parts = _CODE.split(line)
            parts[::2] = [re.sub(r"([|*])", r"\\\1", part) for part in parts[::2]]
            lines[number] = "".join(parts)


def _signature(
    _app: Any, what: str, _name: str, obj: Any, _options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """No signature of a class that users are given, not make: its docstring has no parameters."""
    if what == "class" and "Parameters\n" not in (inspect.getdoc(obj) or ""):
        return "", None
    return signature, returned


def figure_page(card: dict[str, Any], docstring: str, path: str, source: str) -> str:
    """Page of a figure.

    Parameters
    ----------
    card : dict
        Sidecar of `studies.draw`.
    docstring, path, source : str
        Of the function that draws it: its docstring, the name of its file, what stands in that.

    Returns
    -------
    str
        Markdown; the picture is expected in ``../figures``.
    """
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", source)), default=0))
    quick = " --quick" if card["quick"] else ""
    return f"""\
# {escaped(card["title"].rstrip("."))}

{from_docstring(docstring)}

```{{image}} ../figures/{card["file"]}
:alt: {card["title"]}
:width: 100%
```

**Measured:** {escaped(card["headline"])}.

Drawn by `creeping figure {card["name"]}{quick} -o out`, version {card["version"]}.

{numbers(card)}

## Source

`{path}`:

{fence}python
{source.rstrip()}
{fence}
"""


def gallery_page(cards: list[dict[str, Any]]) -> str:
    """Page with a thumbnail, expected in ``thumbs``, of every figure."""
    if not cards:
        return "# Gallery\n\nNo figures were drawn: `python -m studies.gallery` without `--pages-only` draws them.\n"
    cells = [
        f"[![{escaped(card['title'])}](thumbs/{card['file']})]({card['name']}.md)\n\n"
        f"    [{escaped(card['title'].rstrip('.'))}]({card['name']}.md)"
        for card in cards
    ]
    cells += [""] * (-len(cells) % COLUMNS)
    rows = "\n".join(f"{'  -' if k % COLUMNS else '* -'} {cell}" for k, cell in enumerate(cells))
    pages = "\n".join(f"{short(card['title'])} <{card['name']}>" for card in cards)
    return f"""\
# Gallery

Each figure is drawn by a function of `studies.figures`, which measures what it shows. Its page gives the
question, the picture, the numbers of its sidecar, and the source.

```{{list-table}}
:class: thumbnails
:widths: {" ".join(["1"] * COLUMNS)}

{rows}
```

```{{toctree}}
:hidden:

{pages}
```
"""


def short(title: str) -> str:
    """Beginning of a title, for lists."""
    return re.split(r"[:?.]\s|\.$", title)[0]


def from_docstring(docstring: str) -> str:
    """Text of a docstring below its title: paragraphs as text, indented blocks as they stand."""
    blocks = re.split(r"\n(?:[ \t]*\n)+", inspect.cleandoc(docstring).partition("\n")[2].strip("\n"))
    found = []
    for block in filter(str.strip, blocks):
        lines = block.splitlines()
        if all(line.startswith(" ") for line in lines):
            found.append("\n".join(["```text", inspect.cleandoc("\n" + block), "```"]))
        else:
            found.append(escaped(block))
    return "\n\n".join(found)


def escaped(text: str) -> str:
    """Text that Markdown shows as it is, but for code in backticks."""
    parts = _CODE.split(text)
    for k in range(0, len(parts), 2):
        parts[k] = re.sub(r"([\\*_\[\]<>|#~{}$])", r"\\\1", parts[k])
    # what would begin a list
    return re.sub(r"^(\s*\d*)([-+.)])(?=\s)", r"\1\\\2", "".join(parts), flags=re.MULTILINE)


def numbers(card: dict[str, Any]) -> str:
    """Tables of the parameters and errors of a sidecar, and the seconds."""
    rows = ["## Numbers", ""]
    for title, value in (("Parameters", card["parameters"]), ("Errors", card["error"])):
        rows += [f"| {title} | |", "|---|---|"]
        rows += [f"| {escaped(name)} | {escaped(text)} |" for name, text in flattened(value)]
        rows.append("")
    return "\n".join([*rows, f"Drawn in {card['seconds']:g} s."])


def flattened(value: Any, name: str = "") -> list[tuple[str, str]]:
    """Names and texts of all values of a nest of dicts."""
    if isinstance(value, dict):
        return [row for key, inner in value.items() for row in flattened(inner, f"{name}, {key}" if name else str(key))]
    return [(name.replace("_", " "), _shown(value))]


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, (list, tuple)):
        # the sidecar has them all
        return ", ".join([*map(_shown, value[:12]), *["..."] * (len(value) > 12)])
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    return str(value)


def write_reference(folder: Path) -> None:
    """Write the pages, and one that lists them, as ``folder/*.md``."""
    folder.mkdir(parents=True)
    for name, (title, packages) in TASKS.items():
        blocks = [
            f".. {_directive(package, each)}:: {package}.{each}"
            for package, names in packages.items()
            for each in names.split()
        ]
        text = "\n".join(["```{eval-rst}", *blocks, "```"])
        (folder / f"{name}.md").write_text(f"# {title}\n\n{text}\n", encoding="utf-8")
    index = ["# Reference", "", "Every public name, by task.", "", "```{toctree}", *TASKS, "```", ""]
    (folder / "index.md").write_text("\n".join(index), encoding="utf-8")


def _directive(package: str, name: str) -> str:
    kind = getattr(__import__(package), name)
    if not isinstance(kind, type):
        return "autofunction"
    return "autoexception" if issubclass(kind, Exception) else "autoclass"


if __name__ == "__main__":
    main()
