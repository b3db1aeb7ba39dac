"""``python -m studies.gallery``: draw the figures and build the site of pages and gallery."""

import argparse
import sys
from pathlib import Path

from creeping import CreepingError
from studies import FIGURES
from studies.gallery.building import build_site


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
        page = build_site(
            given.folder,
            given.names,
            quick=given.quick,
            pages_only=given.pages_only,
            progress=lambda text: print(text, file=sys.stderr),
        )
    except CreepingError as error:
        print(f"studies.gallery: {error}", file=sys.stderr)
        raise SystemExit(3) from None
    print(page)


if __name__ == "__main__":
    main()
