"""Creeping rays on smooth bodies by the phase flow method.

Public names stand in ``__init__.pyi`` and are imported when first used, so that ``import creeping`` costs next to
nothing.
"""

import lazy_loader

from creeping._presenting import present_with

# by name: results show themselves by what only plotting knows, and import it when first asked
present_with("creeping.plotting")

_known, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_GUESSED = {
    "rcs": "backscatter(body, wavenumbers=creeping.wavenumber('10 GHz')).field.polarisation('VV').dbsm",
    "target_strength": "backscatter(body, wavenumbers=creeping.wavenumber('38 kHz', sound_speed=1477), "
    "boundary='soft').field.target_strength",
}


def __getattr__(name: str) -> object:
    try:
        return _known(name)
    except AttributeError:
        raise AttributeError(f"creeping has no {name!r}{_instead(name)}", name=name) from None


def _instead(name: str) -> str:
    """What stands under another name, or in another package."""
    if name.startswith("_"):
        return ""
    if name.lower() in _GUESSED:
        return f"; it is creeping.{_GUESSED[name.lower()]}"
    import scatterers
    from creeping.errors import near_names

    if name in scatterers.__all__:
        return f"; bodies are in another package: import scatterers as sc, then sc.{name}"
    return near_names(name, __all__)
