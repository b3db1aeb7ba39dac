"""What is made of a body or a fan once and kept as long as it lives.

By identity: bodies may be equal to others, or not be hashable.
"""

from collections.abc import Callable, Hashable
from typing import TypeVar
from weakref import finalize

from creeping._typing import Any

T = TypeVar("T")
_KEPT: dict[int, dict[str, Any]] = {}


def memo(owner: object, name: str, make: Callable[[], T]) -> T:
    """What ``make`` gives at the first call for an owner and a name."""
    if id(owner) not in _KEPT:
        try:
            finalize(owner, _KEPT.pop, id(owner), None)
        except TypeError:
            # without weak references the identity may come again
            return make()
        _KEPT[id(owner)] = {}
    own = _KEPT[id(owner)]
    if name not in own:
        own[name] = make()
    found: T = own[name]
    return found


def memo_of(owner: object, name: str, key: Hashable, make: Callable[[], T], most: int) -> T:
    """The same for a name and a key, of which the last ``most`` that were made are kept."""
    known: dict[Hashable, T] = memo(owner, name, dict)
    if key not in known:
        while len(known) >= most:
            known.pop(next(iter(known)))
        known[key] = make()
    return known[key]
