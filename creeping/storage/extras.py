"""Libraries of the extras, which an installation may lack."""

from importlib import import_module

from creeping._typing import Any
from creeping.errors import CreepingError


def required(package: str, *, use: str, extra: str) -> Any:
    """Import a package of an extra.

    Parameters
    ----------
    package : str
    use, extra : str
        What needs it, and the extra that brings it.

    Raises
    ------
    CreepingError
        If it is missing, with the command that installs it.

    Examples
    --------
    >>> required("json", use="nothing", extra="sweep").dumps(1)
    '1'
    """
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        raise CreepingError(f"{use} {error.name}: pip install 'creeping[{extra}]'") from error
