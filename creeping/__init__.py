"""Creeping rays on smooth bodies by the phase flow method.

Public names stand in ``__init__.pyi`` and are imported when first used, so that ``import creeping`` costs next to
nothing.
"""

import lazy_loader

from creeping._presenting import present_with

# by name: results show themselves by what only plotting knows, and import it when first asked
present_with("creeping.plotting.presenter")

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
