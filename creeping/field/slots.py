"""The magnetic field at each of many slots in a perfect conductor of each other: all geodesics between them.

    H_ij = sum over geodesics of the waves of `creeping.field.slot_waves`, or beams where these merge

Sources: [PW81]; Derivations, F28.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from typing import Literal

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked, checked_plain
from creeping.field.coupling_result import Coupling
from creeping.field.port_coupling import coupled, port_geodesics
from creeping.field.slot_sources import slot_sources
from creeping.geometry.arguments import checked_body, real_array
from creeping.geometry.surface import Surface
from creeping.rays.reach import AUTO

FLAT = 1e-3
"""Least tangential part of an axis, as a share of it."""


def slot_coupling(
    body: Surface,
    ports: ArrayLike,
    axes: ArrayLike,
    *,
    wavenumber: float,
    order: int = 2,
    length: float | Literal["auto"] = AUTO,
) -> Coupling:
    """Fields between slots in a perfect conductor: H along each of a unit magnetic dipole along each other.

    A slot of voltage V (its field integrated across it) and length dl is the moment V dl along it. Values are the
    tangential H there, along the receiving slot and with the conductor in place, times the impedance of free space, for
    a unit of the moment: on a plane twice ik (1 + grad grad/k^2) e^{ikr}/(4 pi r), near field and all. The mutual
    admittance of two short slots is that times their lengths over the impedance of free space, but for its sign, which
    is a matter of the directions of their currents.

    Parameters
    ----------
    body : Surface
        Smooth and plain.
    ports : (n, 3), L
        On the body, two or more, no two in one place.
    axes : (n, 3) or (3,)
        Directions of the slots, of any length; their tangential parts count.
    wavenumber : float, 1/L
    order : 2 or 1
    length : float or "auto", L
        As of `coupling`.

    Returns
    -------
    Coupling
        A symmetric matrix (n, n), 1/L^2, with errors, statuses and geodesics as of `coupling`. Where slots are crossed
        so that next to nothing is received, the error tells so and the status is OK as it is for other axes.

    Raises
    ------
    InvalidInputError
        On ports off the body, or two in one place, axes that are not tangential at all, a bad wavenumber, order or
        length, and for a weighted body or one with edges.
    SurfaceError
        If geodesics cannot be traced on the body.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> angle = np.radians([0, 40, 80])
    >>> ports = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    >>> abreast = cr.slot_coupling(sc.Sphere(), ports, (0, 1, 0), wavenumber=30.0)
    >>> in_line = cr.slot_coupling(sc.Sphere(), ports, np.cross((0, 1, 0), ports), wavenumber=30.0)
    >>> np.abs(abreast[0, 1:]).round(3).tolist(), np.abs(in_line[0, 1:]).round(3).tolist()
    ([3.76, 0.689], [0.256, 0.022])
    """
    checked_body(body)
    checked_plain(body, smooth="the coupling of slots")
    k = checked(wavenumber, order)
    rays = port_geodesics(body, ports, k, length)
    along = tangential(axes, rays.normals)
    return coupled(rays, slot_sources(rays, along, k, order), k, "pec", order, "slot", along)


def tangential(axes: ArrayLike, normals: FloatArray) -> FloatArray:
    """Unit tangents (n, 3) along given axes."""
    given = real_array(axes, "axes")
    if given.shape not in ((3,), normals.shape):
        raise InvalidInputError(
            f"axes have shape {given.shape} for {len(normals)} slots; give ({len(normals)}, 3) or one axis (3,) for all"
        )
    given = np.broadcast_to(given, normals.shape)
    long = np.linalg.norm(given, axis=1)
    flat = given - np.sum(given * normals, axis=1, keepdims=True) * normals
    rest = np.linalg.norm(flat, axis=1)
    bad = ~(np.isfinite(long) & (rest > FLAT * long))
    if np.any(bad):
        worst = int(np.flatnonzero(bad)[0])
        raise InvalidInputError(
            f"{np.sum(bad)} of {len(normals)} axes are not finite or have no tangential part (first: {worst}, "
            f"{given[worst].tolist()} where the normal is {normals[worst].round(3).tolist()}); give directions along "
            "the surface"
        )
    return np.asarray(flat / rest[:, None])
