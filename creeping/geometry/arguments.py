"""Arguments of callers, of whatever kind they come: taken as what they are for, or refused by name.

numpy makes numbers of texts, dates and masked arrays without a word, and drops imaginary parts; here they are refused.
"""

import os
import reprlib
import sys
from collections.abc import Callable, Sized
from pathlib import Path

import numpy as np

from creeping._typing import Any, ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.geometry.surface import Surface, why_no_rays
from creeping.geometry.triangulation import checked_extent
from creeping.storage.memory import within_budget

MEMBERS = ("level", "gradient", "hessian", "bounds", "atlas")
"""What every body has; the first three are methods."""
MOST_NUMBERS = 10**8
"""Of a list, a tuple or a range, before it is made an array."""
MOST_COUNT = 10**15
"""Of anything."""
NO_NUMBERS = (str, bytes, bytearray, complex, np.complexfloating, np.datetime64, np.timedelta64)
"""Kinds of which numpy or Python make real numbers, or drop an imaginary part."""
Progress = Callable[[str], None]


def shown(value: Any) -> str:
    """Text of a value that is none of those expected, short whatever it is."""
    return reprlib.repr(value) if not isinstance(value, np.ndarray) else f"an array {value.dtype} {value.shape}"


def real_array(values: ArrayLike, what: str) -> FloatArray:
    """Numbers as an array, of the shape they come in; they may be infinite or NaN.

    Parameters
    ----------
    values : array_like
    what : str
        Words for them, plural.

    Raises
    ------
    InvalidInputError
        If they are complex, masked, no numbers, of no shape, or too many.

    Examples
    --------
    >>> real_array([1, 2], "lengths")
    array([1., 2.])
    >>> real_array([1j], "lengths")
    Traceback (most recent call last):
      ...
    creeping.errors.InvalidInputError: lengths are complex; give real ones
    """
    try:
        count = len(values) if isinstance(values, Sized) and not isinstance(values, np.ndarray) else 0
        if count > MOST_NUMBERS:
            raise InvalidInputError(f"{count} {what} are more than {MOST_NUMBERS}; give fewer")
        given = np.asarray(values)
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        if isinstance(error, InvalidInputError):
            raise
        raise InvalidInputError(f"{what} are not an array of numbers: {error}") from error
    if np.iscomplexobj(given):
        raise InvalidInputError(f"{what} are complex; give real ones")
    if given.dtype.kind not in "fiuO":
        raise InvalidInputError(f"{what} are not an array of numbers, but of {given.dtype}")
    if np.ma.is_masked(values):
        raise InvalidInputError(f"{what} are masked in places; give those that are there")
    within_budget(8.0 * given.size, f"{given.size} numbers of the {what}", "give fewer")
    try:
        # of objects each must be a number by itself: a text that spells one is none
        if given.dtype.kind == "O" and any(isinstance(value, NO_NUMBERS) for value in given.flat):
            raise TypeError("texts, dates or complex numbers are among them")
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInputError(f"{what} are not an array of numbers: {error}") from error


def real_number(value: Any, name: str) -> float:
    """One real number, which may be infinite or NaN.

    Raises
    ------
    InvalidInputError
        If it is none.
    """
    if isinstance(value, (complex, np.complexfloating)):
        raise InvalidInputError(f"{name} = {value!r} is complex; give a real number")
    if isinstance(value, (bool, np.bool_, *NO_NUMBERS)):
        raise InvalidInputError(f"{name} = {shown(value)} is not a number")
    try:
        # an array of one number is that number to Python, though it may be one of many by mistake
        if isinstance(value, np.ndarray) and (value.ndim or value.dtype.kind not in "fiu"):
            raise TypeError
        return float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInputError(f"{name} = {shown(value)} is not a number") from error


def number_between(value: Any, name: str, least: float, most: float) -> float:
    """One real number of a range, ends included.

    Raises
    ------
    InvalidInputError
        If it is none.
    """
    number = real_number(value, name)
    if not least <= number <= most:
        raise InvalidInputError(f"{name} = {value!r} is not between {least:g} and {most:g}")
    return number


def positive_number(value: Any, name: str) -> float:
    """One positive finite number.

    Raises
    ------
    InvalidInputError
        If it is none.
    """
    number = real_number(value, name)
    if not (np.isfinite(number) and number > 0):
        raise InvalidInputError(f"{name} = {value!r} is not a positive finite number")
    return number


def whole_number(value: Any, name: str, least: int = 1) -> int:
    """One whole number, not below the least.

    Raises
    ------
    InvalidInputError
        If it is none.
    """
    # to numpy a duration is a whole number
    whole = np.asarray(value).dtype.kind in "iu" if isinstance(value, np.generic) else isinstance(value, int)
    if isinstance(value, bool) or not whole or value < least:
        raise InvalidInputError(f"{name} = {shown(value)} is not a whole number >= {least}")
    if value > MOST_COUNT:
        raise InvalidInputError(f"{name} = {shown(value)} is more than {MOST_COUNT:g}; give a smaller one")
    return int(value)


def flag(value: Any, name: str) -> bool:
    """True or False.

    Raises
    ------
    InvalidInputError
        If it is neither.
    """
    if not isinstance(value, (bool, np.bool_)):
        raise InvalidInputError(f"{name} = {shown(value)} is neither True nor False")
    return bool(value)


def folder_path(value: Any, name: str) -> Path:
    """Path of a folder, which need not be there.

    Raises
    ------
    InvalidInputError
        If it is no path.
    """
    parts = Path(value).parts if isinstance(value, (str, Path)) else ()
    if not parts or "\0" in str(value) or max(len(os.fsencode(part)) for part in parts) > 255:
        raise InvalidInputError(f"{name} = {shown(value)} is not the path of a folder")
    return Path(value)


def reporter(progress: Any) -> Progress:
    """The callable that is told what is done: one that shows it for True, and that does nothing for None.

    Raises
    ------
    InvalidInputError
        If it cannot be called.
    """
    if progress is None or progress is False:
        return _nothing
    if progress is True:
        return _show
    if not callable(progress):
        raise InvalidInputError(f"progress = {shown(progress)} cannot be called; give True or a function of a text")
    return progress  # type: ignore[no-any-return]


def _nothing(_: str) -> None:
    pass


def _show(text: str) -> None:
    print(f"creeping: {text}", file=sys.stderr)


def one_of(value: Any, name: str, kind: type, made_by: str) -> None:
    """Refuse what is not of a kind, and say what makes one.

    Raises
    ------
    InvalidInputError
    """
    if not isinstance(value, kind):
        raise InvalidInputError(f"{name} = {shown(value)} is no {kind.__name__}; make one by {made_by}")


def rays_refused(body: Any) -> str:
    """What is said where rays are asked of a body without any."""
    return (
        f"there are no creeping rays on this body: {why_no_rays(body)}; its field is given by creeping.solve, "
        "backscatter and bistatic, and by the commands rcs, ts, run and sweep"
    )


def checked_body(body: Surface, *, charts: bool = True) -> None:
    """Refuse what lacks the members of a body; whether they fit each other is not looked at.

    ``charts`` says whether its atlas is needed.

    Raises
    ------
    InvalidInputError
    """
    if why_no_rays(body):
        raise InvalidInputError(rays_refused(body))
    # a property such as the atlas is expensive, so it is sought in the class first
    needed = MEMBERS if charts else MEMBERS[:-1]
    missing = [name for name in needed if not (hasattr(type(body), name) or hasattr(body, name))]
    if isinstance(body, type):
        raise InvalidInputError(f"body = {shown(body)} is a class; make a body of it")
    if missing or not all(callable(getattr(body, name)) for name in MEMBERS[:3]):
        lacks = f"lacks {', '.join(missing)}" if missing else f"has {', '.join(MEMBERS[:3])} that are no methods"
        raise InvalidInputError(
            f"body = {shown(body)} is no body: it {lacks}; give one of scatterers, or see "
            "creeping.geometry.surface.Surface"
        )
    if body.bounds is None:
        raise InvalidInputError(f"body = {shown(body)} has no bounds; give the box that contains it")
    checked_extent(body.bounds)
