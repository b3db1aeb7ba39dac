"""Bodies without creeping rays, on flat facets or of several parts: why they have none, and what is inside them.

Such a body has ``bounds``, ``inside(points)``, and in place of F the corners of its facets
(``vertices``, ``triangles``, with ``hidden(points, direction)``), or ``parts``, bodies of any kind, with ``turns``,
``shifts`` and ``own(number, points)``.
"""

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray


def why_no_rays(body: Any) -> str:
    """Why a body has no creeping rays, in words; nothing of one that has.

    Examples
    --------
    >>> import scatterers as sc
    >>> why_no_rays(sc.Sphere())
    ''
    """
    return str(getattr(body, "without_rays", ""))


def is_faceted(body: Any) -> bool:
    """Whether a body is given by the corners of flat facets."""
    return bool(why_no_rays(body)) and hasattr(body, "triangles")


def inside(body: Any, points: FloatArray) -> BoolArray:
    """Whether points (m, 3), L, are inside a body of any kind: (m,)."""
    return np.asarray(body.inside(points) if why_no_rays(body) else body.level(points) < 0)
