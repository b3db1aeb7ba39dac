"""``python -m studies`` lists the studies; ``python -m studies NAME [options]`` runs one.

A figure is drawn as by ``creeping figure``: into the folder ``out``, or that of ``-o``. Any other study runs as by
``python -m studies.NAME``, with the options that follow its name.
"""

import ast
import difflib
import runpy
import sys
from pathlib import Path

from studies import FIGURES

HERE = Path(__file__).parent


def sources() -> dict[str, Path]:
    """File of each study by its name, figures first."""
    figures = {name: HERE / f"{module}.py" for name, module in FIGURES.items()}
    public = [path for path in sorted(HERE.iterdir()) if not path.name.startswith("_")]
    modules = {p.stem: p for p in public if p.suffix == ".py" and p.stem not in FIGURES.values()}
    packages = {p.name: p / "__init__.py" for p in public if (p / "__main__.py").exists()}
    return figures | modules | packages


def described(path: Path) -> str:
    """Docstring of a file, which is not imported."""
    return ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""


def listing() -> str:
    """Name and title of each study, a line each."""
    return "\n".join(f"{name:20} {described(path).splitlines()[0]}" for name, path in sources().items())


def main(arguments: list[str] | None = None) -> None:
    """List the studies or run one; exits with 2 on a name or an option that there is not."""
    given = sys.argv[1:] if arguments is None else arguments
    if not given or given[0] in ("-h", "--help"):
        print(f"{listing()}\n\nrun one with: python -m studies NAME [options]")
        return
    name, *options = given
    if name in FIGURES:
        from creeping.commands import main as cli

        cli.main(["figure", name, *options])
    known = sources()
    if name not in known:
        close = difflib.get_close_matches(name, known, 1)
        meant = f"did you mean {close[0]}?" if close else "python -m studies lists them"
        print(f"studies: there is no study {name!r}; {meant}", file=sys.stderr)
        raise SystemExit(2)
    run(name, known[name], options)


def run(name: str, path: Path, options: list[str]) -> None:
    """Run a study as by ``python -m studies.NAME``."""
    runs = path.with_name("__main__.py") if path.stem == "__init__" else path
    text = runs.read_text(encoding="utf-8")
    if "argparse" not in text:
        if {"-h", "--help"} & set(options):
            print(described(path))
            return
        if options and "sys.argv" not in text:
            print(f"studies: {name} takes no options, but was given {' '.join(options)}", file=sys.stderr)
            raise SystemExit(2)
    before = sys.argv
    sys.argv = [str(runs), *options]
    try:
        runpy.run_module(f"studies.{name}", run_name="__main__", alter_sys=True)
    finally:
        sys.argv = before


if __name__ == "__main__":
    main()
