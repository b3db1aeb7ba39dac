"""Arguments that fields have in common."""

import numpy as np

from creeping.errors import InvalidInputError
from creeping.geometry.speed import speed_of
from creeping.geometry.surface import Surface


def checked_plain(body: Surface) -> None:
    """Refuse a weighted body."""
    if speed_of(body) is not None:
        raise InvalidInputError(f"{body!r} has a speed; the diffracted field is that of a plain body")


def checked(wavenumber: float, order: int) -> float:
    """The wavenumber, if it and the order are usable."""
    if isinstance(wavenumber, complex | np.complexfloating):
        raise InvalidInputError(f"wavenumber = {wavenumber!r} is complex; give a real one: losses belong to the medium")
    try:
        k = float(wavenumber)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"wavenumber = {wavenumber!r} is not a number") from error
    if not (np.isfinite(k) and k > 0):
        raise InvalidInputError(f"wavenumber = {wavenumber!r} is not a positive finite number")
    if order not in (1, 2):
        raise InvalidInputError(f"order = {order!r} is neither 1 nor 2")
    return k
