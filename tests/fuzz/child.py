"""The process that tries cases: ``python -m tests.fuzz.child ATTACK SEED START STOP STEP FOLDER MEMORY``.

Its standard output is for the lines that `tests.fuzz.supervision` reads; whatever else is printed goes to standard
error. Address space is limited once all is prepared.
"""

import contextlib
import faulthandler
import json
import os
import resource
import shutil
import sys
import time
import warnings
from pathlib import Path
from typing import Any

from tests.fuzz import ATTACKS
from tests.fuzz.calls import WRONG, Attack, Verdict, failure, generator


def main(name: str, seed: int, numbers: range, folder: Path, memory: int) -> None:
    """Prepare, and try the cases one by one."""
    faulthandler.enable()
    warnings.simplefilter("ignore")
    told = os.fdopen(os.dup(1), "w", buffering=1)
    # printing of libraries, in C too
    os.dup2(2, 1)

    def tell(**said: Any) -> None:
        told.write(json.dumps(said) + "\n")

    attack = ATTACKS[name]()
    attack.prepare(folder)
    if memory:
        most = _address_space() + memory
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    for number in numbers:
        tell(begin=number)
        began = time.monotonic()
        place = folder / f"case-{number}"
        verdict = tried(attack, name, seed, number, place)
        tell(verdict=verdict.kind, number=number, words=verdict.words, seconds=time.monotonic() - began)
        if verdict.kind in ("refused", "accepted"):
            for left in folder.glob(f"case-{number}*"):
                shutil.rmtree(left) if left.is_dir() else left.unlink()
    tell(done=True)


def tried(attack: Attack, name: str, seed: int, number: int, place: Path) -> Verdict:
    """Verdict on a case; what the attack itself does not expect is of a wrong class."""
    try:
        return attack.attempt(number, generator(name, seed, number), place)
    except MemoryError as error:
        with contextlib.suppress(MemoryError):
            return Verdict(WRONG, f"MemoryError: {error}")
        return Verdict(WRONG, "MemoryError")
    except Exception as error:
        return failure(error)


def _address_space() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()


if __name__ == "__main__":
    name, seed, start, stop, step, folder, memory = sys.argv[1:]
    main(name, int(seed), range(int(start), int(stop), int(step)), Path(folder), int(memory))
