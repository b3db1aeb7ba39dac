"""Bad files, bad expressions, bad arguments, foreign connections: what the program makes of them.

Each attack has cases without end, each known by a seed and a number. A case may be refused, by an error of ours, or
accepted, and nothing else: no end of the process, no error of another class, no more than 20 s or 4 GB, and nothing
accepted that is not what was given ("silent"). The cases are tried in processes of their own.
"""

from collections.abc import Callable

from tests.fuzz.calls import Attack, BadCalls
from tests.fuzz.expressions import Expressions, Specs
from tests.fuzz.files import CadFiles, Directions, Studies, meshes
from tests.fuzz.origins import Origins
from tests.fuzz.stored import FarFiles, Fits, Maps, Stores


def _invariants() -> Attack:
    # hypothesis comes with the tests, and no other attack needs it
    from tests.fuzz.invariants import Invariants

    return Invariants()


ATTACKS: dict[str, Callable[[], Attack]] = {
    **meshes(),
    "step": CadFiles,
    "study": Studies,
    "directions-csv": lambda: Directions("csv"),
    "directions-npy": lambda: Directions("npy"),
    "ffe": FarFiles,
    "map": Maps,
    "fit": Fits,
    "store": Stores,
    "expression": Expressions,
    "body": Specs,
    "call": BadCalls,
    "invariant": _invariants,
    "origin": Origins,
}
"""Makers of the attacks by name."""
