"""`cached`: a property that is computed once.

For type checkers it is a plain property: not all of them take `functools.cached_property` for one in a protocol.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from builtins import property as cached
else:
    from functools import cached_property as cached

__all__ = ["cached"]
