"""How uncertain a far field is because its body is known only approximately."""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from creeping.field.arguments import checked, checked_plain, observers_of
from creeping.field.boundary import BoundaryLike, scalar_boundaries
from creeping.field.far import far_field
from creeping.geometry.arguments import one_of
from creeping.rays.fan import RayFan
from creeping.rays.uncertain_body import coarse_factor, coarse_fan


def far_field_uncertainty(
    fan: RayFan, observation: ArrayLike, *, wavenumber: float, boundary: BoundaryLike = "soft", order: int = 2
) -> FloatArray | None:
    """Change of the far field when the body is replaced by its second fit (`coarse_fit`).

    Shadow line and rays are computed again on the second fit. The change is about the error of the less accurate fit.
    Where the second fit uses a coarser grid that resolves the body, it is two to four times the error of the fan's
    field. For a subdivided mesh it is multiplied by ``coarse_factor`` and is about the error of the fan's field. The
    error of the asymptotic method is not included.

    Parameters
    ----------
    fan : RayFan
        Of a body from a file; see `creeping.rays.uncertain_body`.
    observation, wavenumber, boundary, order
        As for `far_field`.

    Returns
    -------
    (m,) or (m, 2, 2), L, or None
        |f - f on the second fit| times ``coarse_factor``; None for a body that is known exactly.

    Raises
    ------
    InvalidInputError
        For the reasons given at `far_field`.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> fan = cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, direction=(0, 0, 1)), length=0.5, n_rays=8)
    >>> cr.far_field_uncertainty(fan, [(0, 0, -1)], wavenumber=30.0) is None    # a sphere is known exactly
    True
    """
    one_of(fan, "fan", RayFan, "creeping.launch")
    checked_plain(fan.body)
    scalar_boundaries(boundary)
    checked(wavenumber, order)
    observers_of(observation)
    other = coarse_fan(fan)
    if other is None:
        return None
    mine, its = (
        far_field(one, observation, wavenumber=wavenumber, boundary=boundary, order=order) for one in (fan, other)
    )
    return coarse_factor(fan) * np.abs(mine.total - its.total)
