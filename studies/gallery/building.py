"""The site: figures drawn, sources of all pages gathered, HTML made by Sphinx, every warning an error.

HTML loads nothing from a network: a built-in theme, fonts of the reader's machine, equations as text.
"""

import inspect
import shutil
import tempfile
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import Any

import studies
from creeping import CreepingError, InvalidInputError
from creeping._version import __version__
from studies.gallery.figure_page import figure_page, gallery_page

PAGES = Path(__file__).parent / "pages"
THUMBNAIL = 480
"""Pixels of the width of a thumbnail."""
STYLE = """\
div.body { min-width: 0; max-width: none; }
div.body table.docutils { font-size: 0.9em; margin-left: 0; }
div.body table.thumbnails { border: 0; font-size: 0.85em; }
div.body table.thumbnails td { border: 0; vertical-align: top; width: 33%; }
div.highlight pre { font-size: 0.74em; overflow-x: auto; padding: 7px 12px; margin: 15px 0; }
img { max-width: 100%; height: auto; background: white; }
"""
CONFIGURATION: dict[str, Any] = {
    "project": "creeping",
    "copyright": "the creeping developers",
    "version": __version__,
    "release": __version__,
    "extensions": ["myst_parser"],
    "myst_heading_anchors": 3,
    "smartquotes": False,
    "html_theme": "alabaster",
    "html_theme_options": {
        "description": "Creeping rays and the diffracted field on smooth bodies",
        "page_width": "1280px",
        "sidebar_width": "230px",
        "fixed_sidebar": True,
        "show_powered_by": False,
    },
    "html_sidebars": {"**": ["about.html", "searchfield.html", "navigation.html"]},
    "html_static_path": ["style"],
    "html_copy_source": False,
    "html_show_sourcelink": False,
    "html_scaled_image_link": False,
}


def build_site(
    folder: str | Path,
    names: Sequence[str] = (),
    *,
    quick: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> Path:
    """Draw figures and build the site of pages and gallery.

    Parameters
    ----------
    folder : path
        Gets ``index.html`` with all that belongs to it, and ``figures`` with pictures and sidecars.
    names : sequence of str
        Figures; all of `studies.FIGURES` if there are none.
    quick : bool
        Coarser figures, drawn faster.
    progress : callable
        Called with a line of text for each figure and before Sphinx starts.

    Returns
    -------
    Path
        The first page.

    Raises
    ------
    InvalidInputError
        If there is no such figure, or the folder cannot be made.
    CreepingError
        If Sphinx is missing or warns, with its warnings.
    """
    missing = [package for package in ("sphinx", "myst_parser") if find_spec(package) is None]
    if missing:
        raise CreepingError(f"the site needs {' and '.join(missing)}: pip install 'creeping[docs]'")
    unknown = [name for name in names if name not in studies.FIGURES]
    if unknown:
        raise InvalidInputError(f"unknown figures {', '.join(unknown)}; figures are {', '.join(studies.FIGURES)}")
    folder = Path(folder).absolute()
    cards = []
    for name in dict.fromkeys(names) or studies.FIGURES:
        cards.append(studies.draw(name, folder / "figures", quick=quick))
        progress(f"{name}  {cards[-1]['seconds']:.1f} s  {cards[-1]['headline']}")
    progress("pages")
    with tempfile.TemporaryDirectory(prefix="creeping-site-") as work:
        sources = Path(work) / "sources"
        gather(sources, cards, folder / "figures")
        make_html(sources, folder, Path(work) / "doctrees")
    return folder / "index.html"


def gather(sources: Path, cards: list[dict[str, Any]], figures: Path) -> None:
    """Write what Sphinx reads: pages, gallery, pictures, thumbnails and the style."""
    shutil.copytree(PAGES, sources)
    for name in ("gallery/thumbs", "figures", "style"):
        (sources / name).mkdir(parents=True)
    (sources / "style" / "custom.css").write_text(STYLE, encoding="utf-8")
    for card in cards:
        module = import_module(f"studies.{studies.FIGURES[card['name']]}")
        shutil.copy(figures / card["file"], sources / "figures")
        thumbnail(figures / card["file"], sources / "gallery" / "thumbs" / card["file"])
        path = f"studies/{studies.FIGURES[card['name']]}.py"
        page = figure_page(card, module.__doc__ or "", path, inspect.getsource(module))
        (sources / "gallery" / f"{card['name']}.md").write_text(page, encoding="utf-8")
    (sources / "gallery" / "index.md").write_text(gallery_page(cards), encoding="utf-8")


def thumbnail(picture: Path, target: Path) -> None:
    """Write a smaller picture."""
    from PIL import Image

    with Image.open(picture) as image:
        small = image.convert("RGB")
        small.thumbnail((THUMBNAIL, THUMBNAIL))
        small.save(target)


def make_html(sources: Path, folder: Path, doctrees: Path) -> None:
    """Run Sphinx.

    Raises
    ------
    CreepingError
        If it warns or fails.
    """
    from sphinx.application import Sphinx
    from sphinx.errors import SphinxError
    from sphinx.util.docutils import docutils_namespace, patch_docutils

    warnings = StringIO()
    try:
        with patch_docutils(), docutils_namespace():
            app = Sphinx(
                sources, None, folder, doctrees, "html", CONFIGURATION, status=None, warning=warnings, freshenv=True
            )
            app.build(force_all=True)
    except SphinxError as error:
        raise CreepingError(f"the pages cannot be built: {error}") from error
    lines = [line for line in warnings.getvalue().splitlines() if line.strip()]
    if lines or app.statuscode:
        raise CreepingError(f"{len(lines)} warnings of the pages, which must have none:\n  " + "\n  ".join(lines))
