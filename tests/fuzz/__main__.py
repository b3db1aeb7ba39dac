"""Try bad input and print what came of it: ``python -m tests.fuzz [ATTACK ...] --seconds 600 --seed 0 -o findings``.

Without names all attacks share the time. ``--cases N`` tries N cases of each, as far as the time reaches; ``--case N``
tries one again and shows its error in full. Ends with 1 if anything was found: a reproducer is below the table, the
input in the folder of ``-o``.
"""

import argparse
import sys
import tempfile
from pathlib import Path

from tests.fuzz import ATTACKS
from tests.fuzz.child import tried
from tests.fuzz.supervision import HEAD, LIMIT, MEMORY, run_attack

CASES = 10**9


def main(arguments: list[str] | None = None) -> int:
    """Run the attacks; 1 if anything was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("attacks", nargs="*", metavar="ATTACK", help=f"one of {', '.join(ATTACKS)}")
    parser.add_argument("--seconds", type=float, default=600.0, help="of all attacks together")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", type=int, default=CASES, help="of each attack, at most")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--case", type=int, help="try this one again, in this process")
    parser.add_argument("--limit", type=float, default=LIMIT, help="seconds of a case")
    parser.add_argument("--memory", type=float, default=MEMORY / 1e9, help="GB of a case")
    parser.add_argument("-o", "--output", type=Path, help="folder for the inputs of findings")
    parser.add_argument("--quick", action="store_true", help="20 cases of each attack")
    given = parser.parse_args(arguments)
    names = given.attacks or list(ATTACKS)
    if unknown := [name for name in names if name not in ATTACKS]:
        parser.error(f"there is no attack {unknown[0]!r}; attacks are {', '.join(ATTACKS)}")
    if given.case is not None:
        if len(names) != 1:
            parser.error("--case belongs to one attack")
        return again(names[0], given.seed, given.case)
    count = 20 if given.quick else given.cases
    print(HEAD, flush=True)
    found = []
    left = given.seconds
    for k, name in enumerate(names):
        numbers = range(given.first, given.first + count)
        tally = run_attack(
            name,
            given.seed,
            numbers,
            seconds=left / (len(names) - k),
            kept=given.output,
            limit=given.limit,
            memory=int(given.memory * 1e9),
        )
        left = max(0.0, left - tally.seconds)
        found += tally.findings
        print(tally.row(), flush=True)
    for finding in found:
        print(f"{finding.attack} {finding}")
    return 1 if found else 0


def again(name: str, seed: int, number: int) -> int:
    """Try one case in this process."""
    attack = ATTACKS[name]()
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        attack.prepare(Path(folder))
        verdict = tried(attack, name, seed, number, Path(folder) / f"case-{number}")
    print(f"{verdict.kind}: {verdict.words}")
    return 0 if verdict.kind in ("refused", "accepted") else 1


if __name__ == "__main__":
    sys.exit(main())
