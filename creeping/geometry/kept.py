"""What is made of a body once and kept as long as it lives.

By identity: bodies may be equal to others, or not be hashable.
"""

from collections.abc import Callable
from typing import TypeVar
from weakref import finalize

from creeping._typing import Any
from creeping.geometry.surface import Surface

T = TypeVar("T")
_KEPT: dict[int, dict[str, Any]] = {}


def kept(body: Surface, name: str, make: Callable[[], T]) -> T:
    """What ``make`` gives at the first call for a body and a name."""
    if id(body) not in _KEPT:
        try:
            finalize(body, _KEPT.pop, id(body), None)
        except TypeError:
            # without weak references the identity may come again
            return make()
        _KEPT[id(body)] = {}
    own = _KEPT[id(body)]
    if name not in own:
        own[name] = make()
    found: T = own[name]
    return found
