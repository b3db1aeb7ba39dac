"""Does the default suite see small faults? One is planted into each of some modules, one at a time, and the tests run.

Faults are those that a slip of the pen makes: + for -, * for /, a comparison turned round, a factor or an index off by
one, a sign lost. Modules and places are drawn from ``--seed``. Each fault is planted into a copy of the working tree;
first run the tests that name the module, then those of its room, then all, each until one fails. A run that does not
end in time, or takes too much memory, has seen the fault too. Run
``python -m tests.planted_faults [--count 40] [--seed 1] [--only I ...] [--runs 2] [-o FILE]`` (hours).
"""

import argparse
import ast
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
SWAPPED: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Lt: ast.GtE,
    ast.GtE: ast.Lt,
    ast.Gt: ast.LtE,
    ast.LtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
}
LEAST_PLACES = 6
"""Places for a fault that a module must have: those with fewer hold types and names."""
MEMORY = 10 * 2**30
"""Bytes of data that a process of a run may hold."""
SMALL = 3
"""The largest constant that is changed: those above are sizes, texts and limits more often than factors and indices."""
MINUTES = 30.0
"""Minutes of a run, of the whole suite at most."""


@dataclass(frozen=True)
class Fault:
    """A change of one expression: file, line, and the source of the expression before and after."""

    file: str
    line: int
    column: int
    before: str
    after: str

    def planted(self, text: str) -> str:
        """The source of the file with the fault."""
        lines = text.splitlines(keepends=True)
        start = sum(map(len, lines[: self.line - 1])) + self.column
        if not text.startswith(self.before, start):
            raise ValueError(f"{self.file}:{self.line} does not hold {self.before!r}")
        return text[:start] + self.after + text[start + len(self.before) :]


def changed(node: ast.expr) -> ast.expr | None:
    """The expression with its fault; None where there is none to make."""
    if isinstance(node, ast.BinOp) and type(node.op) in SWAPPED:
        return ast.BinOp(node.left, SWAPPED[type(node.op)](), node.right)  # type: ignore[arg-type]
    if isinstance(node, ast.Compare) and len(node.ops) == 1 and type(node.ops[0]) in SWAPPED:
        return ast.Compare(node.left, [SWAPPED[type(node.ops[0])]()], node.comparators)  # type: ignore[list-item]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return node.operand
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and node.value in range(SMALL + 1):
        return None if isinstance(node.value, bool) else ast.Constant(node.value + 1)
    return None


def inside_functions(tree: ast.AST) -> Iterator[ast.expr]:
    """Expressions of function bodies: neither annotations nor defaults, nor what messages are made of."""
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            pending: list[ast.AST] = list(function.body)
            while pending:
                node = pending.pop()
                if isinstance(node, ast.Raise | ast.JoinedStr | ast.FunctionDef | ast.Lambda | ast.ClassDef):
                    continue
                if isinstance(node, ast.AnnAssign):
                    pending += [node.value] if node.value else []
                    continue
                pending += ast.iter_child_nodes(node)
                if isinstance(node, ast.expr):
                    yield node


def places(path: Path) -> list[Fault]:
    """All faults that can be planted into a file, those of one line each."""
    text, found = path.read_text(encoding="utf-8"), []
    lines, name = text.splitlines(), path.relative_to(ROOT).as_posix()
    for node in inside_functions(ast.parse(text)) if text.isascii() else ():
        after = changed(node)
        if after is None or node.lineno != node.end_lineno:
            continue
        before = lines[node.lineno - 1][node.col_offset : node.end_col_offset]
        found.append(Fault(name, node.lineno, node.col_offset, before, f"({ast.unparse(after)})"))
    return sorted(set(found), key=lambda fault: (fault.line, fault.column, fault.after))


def drawn(count: int, seed: int) -> list[Fault]:
    """A fault in each of so many modules of the product."""
    chance = random.Random(seed)
    modules = [places(path) for room in ("creeping", "scatterers") for path in sorted((ROOT / room).rglob("*.py"))]
    return [chance.choice(of) for of in chance.sample([of for of in modules if len(of) >= LEAST_PLACES], count)]


def stages(fault: Fault) -> list[list[str]]:
    """Arguments of the runs: the module's examples and the tests that name it, tests of its room, all."""
    package, _, stem = fault.file.removesuffix(".py").replace("/", ".").rpartition(".")
    names = (f"{package}.{stem}", f"{package} import {stem}")
    tests = sorted((ROOT / "tests").rglob("test_*.py"))
    near = [p.relative_to(ROOT).as_posix() for p in tests if any(name in p.read_text("utf-8") for name in names)]
    room = ROOT / "tests" / Path(fault.file).parent.as_posix().removeprefix("creeping/")
    while not room.is_dir():
        room = room.parent
    return [[fault.file, *near], [str(room.relative_to(ROOT))], []]


def failure(tree: Path, arguments: list[str]) -> str:
    """The first test of a run that fails, "" if none does."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST")} | {"PYTHONPATH": str(tree)}
    try:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-x", "-q", "--no-header", "--tb=no", *arguments],
            cwd=tree,
            env=environment,
            capture_output=True,
            text=True,
            timeout=60 * MINUTES,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY)),
        )
    except subprocess.TimeoutExpired:
        return f"no end within {MINUTES:.0f} minutes"
    if done.returncode in (0, 5):
        return ""
    told = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return (told or [f"exit {done.returncode}"])[0][:160]


def seen(fault: Fault, tree: Path, runs: int) -> str:
    """What sees the fault in so many of the runs, "" if nothing does."""
    target = tree / fault.file
    whole = target.read_text(encoding="utf-8")
    target.write_text(fault.planted(whole), encoding="utf-8")
    try:
        return next(filter(None, (failure(tree, arguments) for arguments in stages(fault)[:runs])), "")
    finally:
        target.write_text(whole, encoding="utf-8")


def main() -> None:
    """Plant the faults one after the other; a line each, and the share that was seen."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, nargs="*", help="numbers of faults to plant")
    parser.add_argument("--sound", action="store_true", help="do not see first whether all tests pass without a fault")
    parser.add_argument("--runs", type=int, default=3, help="2: the tests of the module and of its room alone")
    parser.add_argument("-o", type=Path, help="write the results there, as JSON, after each fault")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".git", ".venv", "dist"))
        if not options.sound and (broken := failure(tree, [])):
            raise SystemExit(f"the suite fails without a fault: {broken}")
        for number, fault in enumerate(drawn(options.count, options.seed)):
            if options.only is not None and number not in options.only:
                continue
            began = time.perf_counter()
            by = seen(fault, tree, options.runs)
            seconds = round(time.perf_counter() - began)
            rows.append({"number": number, **asdict(fault), "seen by": by, "seconds": seconds})
            print(
                f"{number:3} {fault.file}:{fault.line} {fault.before} -> {fault.after}: {by or 'NOT SEEN'}", flush=True
            )
            if options.o:
                options.o.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    print(f"seen: {sum(bool(row['seen by']) for row in rows)} of {len(rows)}")


if __name__ == "__main__":
    main()
