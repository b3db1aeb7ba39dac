"""``python -m studies`` lists the studies; ``python -m studies NAME [options]`` runs one.

A figure is drawn as by ``creeping figure``: into the folder ``out``, or that of ``-o``. Any other study prints its
tables, with the options that follow its name; ``--help`` tells them.
"""

import ast
import difflib
import runpy
import sys
from pathlib import Path
from unittest.mock import patch

from studies import FIGURES

HERE = Path(__file__).parent


def sources() -> dict[str, Path]:
    """File of each study by its name, figures first; studies are the modules in folders that can be run."""
    figures = {name: HERE / "figures" / f"{place.split('.')[0]}.py" for name, place in FIGURES.items()}
    runs = [path for path in sorted(HERE.glob("*/*.py")) if 'if __name__ == "__main__":' in path.read_text("utf-8")]
    return figures | {path.parent.name if path.stem == "__main__" else path.stem: path for path in runs}


def listing() -> str:
    """Name and title of each study, a line each; nothing is imported."""
    lines = []
    for name, path in sources().items():
        told: ast.AST = ast.parse(path.read_text(encoding="utf-8"))
        if name in FIGURES:
            function = FIGURES[name].split(".")[1]
            told = next(node for node in ast.walk(told) if getattr(node, "name", "") == function)
        lines.append(f"{name:20} {(ast.get_docstring(told) or '').splitlines()[0]}")  # type: ignore[arg-type]
    return "\n".join(lines)


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
    module = ".".join(known[name].relative_to(HERE.parent).with_suffix("").parts)
    with patch.object(sys, "argv", [f"python -m studies {name}", *options]):
        runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
