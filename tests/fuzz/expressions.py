"""Expressions and the BODY of a command, made by a grammar and then mutated.

The grammar makes what is allowed, what is nearly allowed and what would do harm if it were executed: harmful pieces
write a file that must not be there afterwards. An audit hook sees commands, sockets and written files.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.fuzz.calls import ACCEPTED, REFUSED, SILENT, Verdict
from tests.fuzz.mutation import mutated

FUNCTIONS = (
    "sin",
    "cos",
    "exp",
    "log",
    "sqrt",
    "tanh",
    "abs",
    "where",
    "max",
    "min",
    "gamma",
    "eval",
    "open",
    "factorial",
    "Matrix",
)
NUMBERS = ("1", "2", "0.5", "3e-2", "1e300", "1e-300", "9**9", "64", "1/3", "0", "1j", "1_0", "0x1f", "10**10")
NAMES = ("x", "y", "z", "x", "y", "z", "pi", "E", "I", "oo", "w", "self", "__builtins__", "os", "\ufb01", "\u0445")
HARM = (
    "__import__('os').system('touch {0}')",
    "open('{0}','w')",
    "exec(\"open('{0}','w')\")",
    "().__class__.__mro__[1].__subclasses__()",
    "(lambda: open('{0}','w'))()",
    "[open('{0}','w') for x in (1,)]",
    "x.__class__.__init__.__globals__",
    'f\'{{open("{0}","w")}}\'',
    "sympify('x')",
    "(x := 9)",
    "print(x)",
    "x if y else z",
    "'a'*10**9",
    "9**9**9**9",
    "2**(2**(2**(2**(2**2))))",
    "where(x < 0, open('{0}','w'), y)",
)
BODIES = (
    "x**2 + y**2 + z**2 - 1",
    "x**2/1.44 + y**4 + 2*z**2 - 1",
    "(sqrt(x**2 + y**2) - 1)**2 + z**2 - 0.25",
    "(x**2 + y**2 + z**2 + 0.64)**2 - 2.56*x**2 - 0.9**4",
    "exp(x**2 + y**2 + z**2) - 3",
    "where(x < 0, x**2, 2*x**2) + y**2 + z**2 - 1",
    "max(x**2 + y**2 + z**2 - 1, z - 0.5, min(x, y) - 0.4)",
    "sqrt(x**2 + y**2) - (1 - z**2)/2",
)
SPECS = ("sphere", "sphere:radius=2", "ellipsoid:a=1.2,b=0.8,c=0.8", "torus:R=1,r=0.5", "twisted-ellipsoid", "hull.stl")


def expression(rng: Generator, canary: str, depth: int = 0) -> str:
    """A text by the grammar."""
    kind = rng.random()
    if depth > 5 or kind < 0.3:
        return _pick(rng, NAMES if rng.random() < 0.6 else NUMBERS)
    if kind < 0.33:
        return _pick(rng, HARM).format(canary)
    inner = [expression(rng, canary, depth + 1) for _ in range(3)]
    if kind < 0.75:
        return f"{inner[0]}{_pick(rng, ('+', '-', '*', '/', '**', '**2', ' % ', '//', ' @ ', '<'))}{inner[1]}"
    if kind < 0.85:
        return f"({inner[0]})"
    if kind < 0.97:
        count = int(rng.integers(0, 4)) if rng.random() < 0.2 else 1
        return f"{_pick(rng, FUNCTIONS)}({', '.join(inner[:count])})"
    return f"where({inner[0]} < {inner[1]}, {inner[2]}, {inner[0]})"


def _pick(rng: Generator, values: tuple[str, ...]) -> str:
    return values[int(rng.integers(len(values)))]


def changed(text: str, rng: Generator) -> str:
    """The text with changed bytes, read as far as they are characters."""
    return mutated(text.encode(), rng, text=True).decode("utf-8", errors="replace")


class Watch:
    """Sees commands, connections and files written outside a folder; stays for the life of the process."""

    def __init__(self, folder: Path) -> None:
        self.seen: list[str] = []
        self.active = False
        self._folder = str(folder)
        sys.addaudithook(self._event)

    def _event(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self.active:
            return
        writes = event == "open" and isinstance(arguments[1], str) and set("wax+") & set(arguments[1])
        if writes and "__pycache__" in str(arguments[0]):
            return
        starts = event in ("os.system", "os.exec", "os.posix_spawn", "subprocess.Popen", "socket.connect", "os.remove")
        if writes or starts:
            self.seen.append(f"{event} {arguments[0]!r}"[:200])


class Expressions:
    """Bodies from expressions."""

    def prepare(self, folder: Path) -> None:
        """Make a body of each expression to begin with."""
        import scatterers as sc

        for text in BODIES:
            sc.Implicit(text)
        self.watch = Watch(folder)

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Make an expression, and a body of it."""
        canary = str(place.with_name(f"{place.name}-executed"))
        kind = rng.random()
        if kind < 0.4:
            text = changed(_pick(rng, BODIES), rng)
        elif kind < 0.6:
            text = f"{_pick(rng, BODIES)} + 1e-3*({expression(rng, canary)})"
        else:
            text = expression(rng, canary)
            text = changed(text, rng) if rng.random() < 0.3 else text
        place.with_suffix(".txt").write_text(text, errors="replace")
        return self._tried(text, canary)

    def make(self, text: str) -> Any:
        """The body."""
        import scatterers as sc

        return sc.Implicit(text)

    def _tried(self, text: str, canary: str) -> Verdict:
        self.watch.seen.clear()
        self.watch.active = True
        try:
            with np.errstate(all="ignore"):
                body = self.make(text)
            verdict = Verdict(ACCEPTED)
        except ValueError as error:
            verdict = Verdict(REFUSED, str(error))
        finally:
            self.watch.active = False
        if Path(canary).exists() or self.watch.seen:
            return Verdict(SILENT, f"executed: {self.watch.seen}")
        if verdict.kind == ACCEPTED and not np.all(np.isfinite(body.bounds)):
            return Verdict(SILENT, f"bounds {np.asarray(body.bounds).tolist()}")
        return verdict


class Specs(Expressions):
    """The BODY of a command: names with parameters, names of files, expressions."""

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Make a text and parse it."""
        canary = str(place.with_name(f"{place.name}-executed"))
        kind = rng.random()
        if kind < 0.7:
            text = changed(_pick(rng, SPECS), rng)
        elif kind < 0.85:
            pairs = [f"{_pick(rng, ('a', 'b', 'c', 'd', 'R', 'r', 'radius', 'speed', 'q'))}=" for _ in range(3)]
            values = [_pick(rng, (*NUMBERS, "nan", "inf", "-1", "", "x", "1e308", "=")) for _ in range(3)]
            chosen = ",".join(p + v for p, v in zip(pairs, values, strict=True))
            text = f"{_pick(rng, SPECS).partition(':')[0]}:{chosen}"
        else:
            text = expression(rng, canary)
        place.with_suffix(".txt").write_text(text, errors="replace")
        return self._tried(text, canary)

    def make(self, text: str) -> Any:
        """The body."""
        from creeping.commands.options import parse_body

        return parse_body(text, cache=False)
