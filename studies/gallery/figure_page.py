"""Markdown of the gallery: a page of each figure from its study and sidecar, and the page that shows them all."""

import inspect
import re
from typing import Any

COLUMNS = 3
"""Thumbnails in a row."""
LONGEST = 12
"""Numbers of a list that are shown; the sidecar has them all."""
_CODE = re.compile(r"(``.*?``|`[^`]*`)", re.DOTALL)


def figure_page(card: dict[str, Any], docstring: str, path: str, source: str) -> str:
    """Page of a figure.

    Parameters
    ----------
    card : dict
        Sidecar of `studies.draw`.
    docstring, path, source : str
        Of the study: its docstring, the name of its file, what stands in it.

    Returns
    -------
    str
        Markdown; the picture is expected in ``../figures``.
    """
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", source)), default=0))
    quick = " --quick" if card["quick"] else ""
    return "\n".join(
        [
            f"# {escaped(card['title'].rstrip('.'))}",
            "",
            from_docstring(docstring),
            "",
            f"```{{image}} ../figures/{card['file']}",
            f":alt: {card['title']}",
            ":width: 100%",
            "```",
            "",
            f"**Measured:** {escaped(card['headline'])}.",
            "",
            f"Drawn by `creeping figure {card['name']}{quick} -o out`, version {card['version']}.",
            "",
            *numbers(card),
            "",
            "## Source",
            "",
            f"`{path}`:",
            "",
            f"{fence}python",
            source.rstrip(),
            fence,
            "",
        ]
    )


def gallery_page(cards: list[dict[str, Any]]) -> str:
    """Page with a thumbnail, expected in ``thumbs``, of every figure."""
    cells = [
        f"[![{escaped(card['title'])}](thumbs/{card['file']})]({card['name']}.md)\n\n"
        f"    [{escaped(card['title'].rstrip('.'))}]({card['name']}.md)"
        for card in cards
    ]
    cells += [""] * (-len(cells) % COLUMNS)
    rows = [f"{'  -' if k % COLUMNS else '* -'} {cell}" for k, cell in enumerate(cells)]
    return "\n".join(
        [
            "# Gallery",
            "",
            "Each figure is drawn by a study, a module of `studies`, which measures what it shows. Its page gives the",
            "question, the picture, the numbers of its sidecar, and the source.",
            "",
            "```{list-table}",
            ":class: thumbnails",
            f":widths: {' '.join(['1'] * COLUMNS)}",
            "",
            *rows,
            "```",
            "",
            "```{toctree}",
            ":hidden:",
            "",
            *(f"{short(card['title'])} <{card['name']}>" for card in cards),
            "```",
            "",
        ]
    )


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


def numbers(card: dict[str, Any]) -> list[str]:
    """Tables of the parameters and errors of a sidecar, and the seconds."""
    rows = ["## Numbers", ""]
    for title, value in (("Parameters", card["parameters"]), ("Errors", card["error"])):
        rows += [f"| {title} | |", "|---|---|"]
        rows += [f"| {escaped(name)} | {escaped(text)} |" for name, text in flattened(value)]
        rows.append("")
    return [*rows, f"Drawn in {card['seconds']:g} s."]


def flattened(value: Any, name: str = "") -> list[tuple[str, str]]:
    """Names and texts of all values of a nest of dicts."""
    if isinstance(value, dict):
        return [row for key, inner in value.items() for row in flattened(inner, f"{name}, {key}" if name else str(key))]
    return [(name.replace("_", " "), _shown(value))]


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, (list, tuple)):
        more = ", ..." if len(value) > LONGEST else ""
        return ", ".join(map(_shown, value[:LONGEST])) + more
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    return str(value)
