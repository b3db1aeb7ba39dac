"""The field at each of many slots and monopoles of a perfect conductor of each other: all geodesics between them.

    slot to slot, monopole to monopole     as `creeping.field.ports.antennas` and `creeping.field.ports.antennas`
    slot i to monopole j                   E_ij = sum over geodesics of `creeping.field.ports.mixed`, or beams
    monopole j to slot i                   H_ji = -E_ij

Also here: the electric field at each of many monopoles on a perfect conductor of each other: all geodesics between
them.

    E_ij = sum over geodesics of the waves of `creeping.field.ports.antenna_waves`, or beams where these merge

Their error is that of a point source's waves.

Also here: the magnetic field at each of many slots in a perfect conductor of each other: all geodesics between them.

    H_ij = sum over geodesics of the waves of `creeping.field.ports.antenna_waves`, or beams where these merge

Sources: [PW81]; Derivations, F34, F33 and F28.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from functools import partial
from typing import Literal

import numpy as np

from creeping._typing import Any, ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked, checked_plain
from creeping.field.ports.antenna_waves import MonopoleTerms, monopole_waves, slot_sources
from creeping.field.ports.beams import PortBeams
from creeping.field.ports.coupling_result import Coupling, coupled, matrix_of, port_geodesics
from creeping.field.ports.mixed import mixed_sources
from creeping.field.ports.sources import PortSources, scalar_sources
from creeping.field.ports.sums import PortSums, port_sums
from creeping.field.ports.waves import path_terms
from creeping.geodesics.bundle import as_points
from creeping.geometry.arguments import checked_body, real_array
from creeping.geometry.surface import Surface
from creeping.rays.port_rays import PortRays
from creeping.rays.reach import AUTO

FLAT = 1e-3
"""Least tangential part of an axis, as a share of it."""


def antenna_coupling(
    body: Surface,
    slots: ArrayLike,
    axes: ArrayLike,
    monopoles: ArrayLike,
    *,
    wavenumber: float,
    order: int = 2,
    length: float | Literal["auto"] = AUTO,
) -> Coupling:
    """Matrix of fields between slots in, and monopoles on, a perfect conductor, for unit moments.

    Ports are numbered slots first, then monopoles. Row i is the source: a magnetic moment V dl along a slot
    (`slot_coupling`), or an electric moment I h along n (`monopole_coupling`). Column j is the received field: H along
    a slot, or E along n at a monopole. Electric moments and H are multiplied by the impedance of free space, so that
    all values are in 1/L^2. Entries between slots, and between monopoles, equal those of `slot_coupling` and
    `monopole_coupling`. From a monopole to a slot the entry is H for a unit I h, from a slot to a monopole E for a unit
    V dl. On a plane E is -2 ik (1 + i/kr) e^{ikr}/(4 pi r) for a slot along n x (direction of the path), i.e. across
    the path, and 0 for a slot along the path.

    The matrix is not symmetric: by reciprocity H at slot i due to monopole j is minus E at monopole j due to slot i, as
    for hybrid parameters. ``values.T @ moments``, with the unknown diagonal left out, gives currents of receiving slots
    and voltages of receiving monopoles from voltages of slots and currents of monopoles.

    Parameters
    ----------
    body : Surface
        Smooth and without a speed.
    slots : (n, 3), L
        On the body, one or more.
    axes : (n, 3) or (3,)
        Directions of the slots, of any length; only the tangential components are used.
    monopoles : (m, 3), L
        On the body, one or more; no two ports at the same point.
    wavenumber : float, 1/L
    order : 2 or 1
    length : float or "auto", L
        As for `coupling`.

    Returns
    -------
    Coupling
        Matrix (n + m, n + m), 1/L^2, with errors, statuses and geodesics as for `coupling`; ``kinds`` has "slot" and
        "monopole".

    Raises
    ------
    InvalidInputError
        On no slots or no monopoles, ports off the body, or two in one place, axes without a tangential component, a bad
        wavenumber, order or length, and for a weighted body or one with edges.
    SurfaceError
        If geodesics cannot be traced on the body.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> angle = np.radians([0, 40, 80])
    >>> ports = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    >>> found = cr.antenna_coupling(sc.Sphere(), ports[:1], (0, 1, 0), ports[1:], wavenumber=30.0)
    >>> np.abs(found[0, 1:]).round(3).tolist(), bool(np.all(found[0, 1:] == -found[1:, 0]))
    ([3.921, 0.719], True)
    >>> found.kinds.tolist()
    ['slot', 'monopole', 'monopole']
    """
    checked_body(body)
    checked_plain(body, smooth="the coupling of antennas")
    k = checked(wavenumber, order, body)
    parts = [as_points(given) for given in (slots, monopoles)]
    shapes = [part.shape for part in parts]
    if any(part.ndim != 2 or not len(part) for part in parts):
        raise InvalidInputError(
            f"slots have shape {shapes[0]} and monopoles {shapes[1]}; give one or more of each as (n, 3), or use "
            "slot_coupling or monopole_coupling for one kind"
        )
    count = len(parts[0])
    rays = port_geodesics(body, np.concatenate(parts), k, length)
    along = np.concatenate([tangential(axes, rays.normals[:count]), rays.normals[count:]])
    kinds = np.repeat(["slot", "monopole"], [count, len(parts[1])])
    return matrix_of(rays, _sums(rays, along, count, k, order), k, "pec", order, kinds, along)


def _sums(rays: PortRays, axes: FloatArray, count: int, k: float, order: int) -> PortSums:
    """What geodesics bring, or beams, of both kinds, the first so many ports slots; each block by itself."""
    n = len(rays.ports)
    slots, monopoles, mixed = rays.among(0, count), rays.among(count, n), rays.across(count)
    here, there = slice(0, count), slice(count, n)
    one = port_sums(slots, slot_sources(slots, axes[here], k, order), k)
    other = port_sums(monopoles, monopole_sources(monopoles, k, order), k)
    both = port_sums(mixed, mixed_sources(mixed, axes, k, order), k)
    for name in ("values", "error", "status", "method"):
        whole = getattr(both, name)
        whole[here, here], whole[there, there] = getattr(one, name), getattr(other, name)
    waves = np.zeros(len(rays), dtype=complex)
    waves[rays.second < count], waves[rays.first >= count] = one.waves, other.waves
    waves[(rays.first < count) & (rays.second >= count)] = both.waves
    return PortSums(both.values, both.error, both.status, both.method, waves)


def monopole_coupling(
    body: Surface,
    ports: ArrayLike,
    *,
    wavenumber: float,
    order: int = 2,
    length: float | Literal["auto"] = AUTO,
) -> Coupling:
    """Matrix of fields between monopoles on a perfect conductor: E along n at one, of a unit moment at another.

    A short monopole of height h with uniform current I is an electric moment I h along the normal. Values are E along
    the normal in the presence of the conductor, times the admittance of free space, per unit moment. On a plane this
    is twice ik (1 + grad grad/k^2) e^{ikr}/(4 pi r), including the near field. The mutual impedance of two short
    monopoles is minus the value times both heights and the impedance of free space.

    Parameters
    ----------
    body : Surface
        Smooth and without a speed.
    ports : (n, 3), L
        On the body, two or more, no two at the same point.
    wavenumber : float, 1/L
    order : 2 or 1
    length : float or "auto", L
        As for `coupling`.

    Returns
    -------
    Coupling
        Symmetric matrix (n, n), 1/L^2, with errors, statuses and geodesics as for `coupling`.

    Raises
    ------
    InvalidInputError
        On ports off the body, or two in one place, a bad wavenumber, order or length, and for a weighted body or one
        with edges.
    SurfaceError
        If geodesics cannot be traced on the body.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> angle = np.radians([0, 40, 80])
    >>> ports = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    >>> E = cr.monopole_coupling(sc.Sphere(), ports, wavenumber=30.0)
    >>> np.abs(E[0, 1:]).round(3).tolist(), bool(np.all(E[0, 1:] == E[1:, 0]))
    ([4.083, 0.752], True)
    """
    checked_body(body)
    checked_plain(body, smooth="the coupling of monopoles")
    k = checked(wavenumber, order, body)
    rays = port_geodesics(body, ports, k, length)
    return coupled(rays, monopole_sources(rays, k, order), k, "pec", order, "monopole")


def monopole_sources(rays: PortRays, k: float, order: int) -> PortSources:
    """Waves of monopoles, 1/L^2."""
    waves = partial(monopole_waves, rays, k)
    return scalar_sources(rays, path_terms(rays, k), k, order, waves, MonopoleBeams, k)


class MonopoleBeams(PortBeams):
    """Beams of a monopole at a port; their field is E_n, 1/L^2."""

    def _wave(self, path: tuple[Any, ...], order: int) -> ComplexArray:
        terms = MonopoleTerms(*path)
        return np.asarray(terms.hard.factor * terms.upright(order))


def slot_coupling(
    body: Surface,
    ports: ArrayLike,
    axes: ArrayLike,
    *,
    wavenumber: float,
    order: int = 2,
    length: float | Literal["auto"] = AUTO,
) -> Coupling:
    """Matrix of fields between slots in a perfect conductor: H along one, of a unit magnetic dipole along another.

    A slot of length dl and voltage V (its field integrated across the slot) is a magnetic moment V dl along the slot.
    Values are H along the receiving slot in the presence of the conductor, times the impedance of free space, per unit
    moment. On a plane this is twice ik (1 + grad grad/k^2) e^{ikr}/(4 pi r), including the near field. The mutual
    admittance of two short slots is minus the value times both lengths over the impedance of free space, with currents
    counted into the ports.

    Parameters
    ----------
    body : Surface
        Smooth and without a speed.
    ports : (n, 3), L
        On the body, two or more, no two at the same point.
    axes : (n, 3) or (3,)
        Directions of the slots, of any length; only the tangential components are used.
    wavenumber : float, 1/L
    order : 2 or 1
    length : float or "auto", L
        As for `coupling`.

    Returns
    -------
    Coupling
        Symmetric matrix (n, n), 1/L^2, with errors, statuses and geodesics as for `coupling`. Slots may be oriented so
        that almost nothing is received. The status is OK there too, as for other axes; only the error shows it.

    Raises
    ------
    InvalidInputError
        On ports off the body, or two in one place, axes without a tangential component, a bad wavenumber, order or
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
    k = checked(wavenumber, order, body)
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
