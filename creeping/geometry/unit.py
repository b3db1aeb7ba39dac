"""The unit of a body's lengths: bodies made from files know theirs, the metre; of others it is the user's, L."""

from creeping._typing import Any

METRE, UNKNOWN = "m", "L"


def unit_of(body: Any) -> str:
    """Unit of a body's lengths: "m" if the body says so, else "L".

    Examples
    --------
    >>> import scatterers as sc
    >>> unit_of(sc.Sphere())
    'L'
    """
    return METRE if getattr(body, "unit", None) == METRE else UNKNOWN
