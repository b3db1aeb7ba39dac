"""The field at each of many ports on a body of a unit source at each other: all geodesics between them.

    value_ij = sum over geodesics of the waves of `creeping.field.ports.tensor`, or beams where these merge

Ports are numbered slots first. By reciprocity (i, j) and (j, i) are equal; between a slot and a monopole they are
opposite, H_ji = -E_ij. Their error is that of a point source's waves, and what was not derived.

Sources: [PW81], [P82]; Derivations, F25, F28, F33 and F34.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypedDict, Unpack, overload

import numpy as np

from creeping._typing import Any, ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.airy import hard_modes
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import BoundaryLike, boundary_name, scalar_boundaries
from creeping.field.ports.coupling_result import Coupling
from creeping.field.ports.sums import port_sums
from creeping.field.ports.tensor import TENSORS, path_waves
from creeping.field.results.point_result import FieldStatus, Words
from creeping.geodesics.equations import points_of_charts
from creeping.geodesics.states import as_points, on_body
from creeping.geometry.arguments import checked_body, positive_number, real_array
from creeping.geometry.checks import unit_of
from creeping.geometry.curvature import curvature_norms
from creeping.geometry.surface import Surface, normal, size
from creeping.rays.port_rays import PortRays, rays_between
from creeping.rays.reach import AUTO

CLOSEST = 1e-6
"""Least distance of ports, in body sizes."""
Length = float | Literal["auto"]
Wavenumbers = Sequence[float] | FloatArray


class _More(TypedDict, total=False):
    order: int
    length: Length


class _Bounded(_More, total=False):
    boundary: BoundaryLike


@overload
def coupling(body: Surface, ports: ArrayLike, *, wavenumber: float, **more: Unpack[_Bounded]) -> Coupling: ...
@overload
def coupling(
    body: Surface, ports: ArrayLike, *, wavenumber: Wavenumbers, **more: Unpack[_Bounded]
) -> list[Coupling]: ...
def coupling(
    body: Surface,
    ports: ArrayLike,
    *,
    wavenumber: float | Wavenumbers,
    boundary: BoundaryLike = "hard",
    order: int = 2,
    length: Length = AUTO,
) -> Coupling | list[Coupling]:
    """Matrix of fields u between ports on a hard body: a unit point source e^{ikr}/(4 pi r) at one, u at another.

    Parameters
    ----------
    body : Surface
        Smooth and not weighted (without ``speed``).
    ports : (n, 3), L
        On the body, two or more.
    wavenumber : float or (f,), 1/L
        Several give a list, one matrix for each.
    boundary : "hard"
        Only "hard" is supported. On a soft body the field is 0.
    order : 2 or 1
    length : float or "auto", L
        Length up to which geodesics are traced. "auto" ends where the wave has decayed, but is long enough for
        geodesics in opposite directions to meet.

    Returns
    -------
    Coupling
        Matrix (n, n), 1/L, usable as an array, with errors, statuses, and the geodesics of each pair. The status of a
        pair is CAUSTIC if geodesics merge and beams are not valid, DETACHED if a significant geodesic meets
        kappa_n <= 0, and NO_RAY or TRUNCATED if no geodesic connects the ports.

    Raises
    ------
    InvalidInputError
        On ports off the body, or two in one place, a bad wavenumber, boundary, order or length, and for a weighted body
        or one with edges.
    SurfaceError
        If geodesics cannot be traced on the body.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> angle = np.radians([0, 40, 80])
    >>> ports = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    >>> u = cr.coupling(sc.Sphere(), ports, wavenumber=30.0)
    >>> np.abs(u[0, 1:]).round(4).tolist(), bool(np.all(u[0, 1:] == u[1:, 0]))
    ([0.1065, 0.0173], True)
    """
    return _coupled(body, ports, None, "point", wavenumber, order, length, "ports", boundary)


@overload
def slot_coupling(
    body: Surface, ports: ArrayLike, axes: ArrayLike, *, wavenumber: float, **more: Unpack[_More]
) -> Coupling: ...
@overload
def slot_coupling(
    body: Surface, ports: ArrayLike, axes: ArrayLike, *, wavenumber: Wavenumbers, **more: Unpack[_More]
) -> list[Coupling]: ...
def slot_coupling(
    body: Surface,
    ports: ArrayLike,
    axes: ArrayLike,
    *,
    wavenumber: float | Wavenumbers,
    order: int = 2,
    length: Length = AUTO,
) -> Coupling | list[Coupling]:
    """Matrix of fields between slots in a perfect conductor: H along one, of a unit magnetic dipole along another.

    A slot of length dl and voltage V (its field integrated across the slot) is a magnetic moment V dl along the slot.
    Values are H along the receiving slot in the presence of the conductor, times the impedance of free space, per unit
    moment. On a plane this is twice ik (1 + grad grad/k^2) e^{ikr}/(4 pi r), including the near field. The mutual
    admittance of two short slots is minus the value times both lengths over the impedance of free space, with currents
    counted into the ports.

    Parameters
    ----------
    body : Surface
        Smooth and not weighted (without ``speed``).
    ports : (n, 3), L
        On the body, two or more, no two at the same point.
    axes : (n, 3) or (3,)
        Directions of the slots, of any length; only the tangential components are used.
    wavenumber : float or (f,), 1/L
        Several give a list, one matrix for each.
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
    return _coupled(body, ports, axes, "slot", wavenumber, order, length, "slots")


@overload
def monopole_coupling(body: Surface, ports: ArrayLike, *, wavenumber: float, **more: Unpack[_More]) -> Coupling: ...
@overload
def monopole_coupling(
    body: Surface, ports: ArrayLike, *, wavenumber: Wavenumbers, **more: Unpack[_More]
) -> list[Coupling]: ...
def monopole_coupling(
    body: Surface,
    ports: ArrayLike,
    *,
    wavenumber: float | Wavenumbers,
    order: int = 2,
    length: Length = AUTO,
) -> Coupling | list[Coupling]:
    """Matrix of fields between monopoles on a perfect conductor: E along n at one, of a unit moment at another.

    A short monopole of height h with uniform current I is an electric moment I h along the normal. Values are E along
    the normal in the presence of the conductor, times the admittance of free space, per unit moment. On a plane this
    is twice ik (1 + grad grad/k^2) e^{ikr}/(4 pi r), including the near field. The mutual impedance of two short
    monopoles is minus the value times both heights and the impedance of free space.

    Parameters
    ----------
    body : Surface
        Smooth and not weighted (without ``speed``).
    ports : (n, 3), L
        On the body, two or more, no two at the same point.
    wavenumber : float or (f,), 1/L
        Several give a list, one matrix for each.
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
    return _coupled(body, ports, None, "monopole", wavenumber, order, length, "monopoles")


@overload
def antenna_coupling(
    body: Surface, slots: ArrayLike, axes: ArrayLike, monopoles: ArrayLike, *, wavenumber: float, **more: Unpack[_More]
) -> Coupling: ...
@overload
def antenna_coupling(
    body: Surface,
    slots: ArrayLike,
    axes: ArrayLike,
    monopoles: ArrayLike,
    *,
    wavenumber: Wavenumbers,
    **more: Unpack[_More],
) -> list[Coupling]: ...
def antenna_coupling(
    body: Surface,
    slots: ArrayLike,
    axes: ArrayLike,
    monopoles: ArrayLike,
    *,
    wavenumber: float | Wavenumbers,
    order: int = 2,
    length: Length = AUTO,
) -> Coupling | list[Coupling]:
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
        Smooth and not weighted (without ``speed``).
    slots : (n, 3), L
        On the body, one or more.
    axes : (n, 3) or (3,)
        Directions of the slots, of any length; only the tangential components are used.
    monopoles : (m, 3), L
        On the body, one or more; no two ports at the same point.
    wavenumber : float or (f,), 1/L
        Several give a list, one matrix for each.
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
    parts = [as_points(given) for given in (slots, monopoles)]
    shapes = [part.shape for part in parts]
    if any(part.ndim != 2 or not len(part) for part in parts):
        raise InvalidInputError(
            f"slots have shape {shapes[0]} and monopoles {shapes[1]}; give one or more of each as (n, 3), or use "
            "slot_coupling or monopole_coupling for one kind"
        )
    kinds = np.repeat(["slot", "monopole"], [len(part) for part in parts])
    return _coupled(body, np.concatenate(parts), axes, kinds, wavenumber, order, length, "antennas")


def checked_wave(body: Surface, wavenumber: float, order: int, what: str, boundary: BoundaryLike = "hard") -> float:
    """The wavenumber, if the coupling of such ports is known on the body at it, with the boundary and to the order."""
    checked_body(body)
    checked_plain(body, smooth=f"the coupling of {what}")
    k = checked(wavenumber, order, body)
    if scalar_boundaries(boundary)[0].kind != "hard" or boundary == "pec":
        raise InvalidInputError(
            f"boundary = {boundary_name(boundary)!r}: coupling is known on hard bodies only; give 'hard', or use "
            "slot_coupling, monopole_coupling or antenna_coupling for slots in and monopoles on a conductor"
        )
    return k


def _checked_ports(body: Surface, ports: ArrayLike) -> FloatArray:
    """Ports (n, 3) on the body, apart from each other."""
    given = as_points(ports)
    if given.ndim != 2 or len(given) < 2:
        raise InvalidInputError(f"ports have shape {given.shape}; give two or more as (n, 3)")
    y = on_body(body, given)
    from scipy.spatial import cKDTree

    close = cKDTree(y).query_pairs(CLOSEST * size(body), output_type="ndarray")
    if len(close):
        raise InvalidInputError(
            f"{len(close)} pairs of ports are in one place (first: {close[0, 0]} and {close[0, 1]}); give each once"
        )
    return y


def _tangential(axes: ArrayLike, normals: FloatArray) -> FloatArray:
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
    # less is rounding of the normal, not a direction
    bad = ~(np.isfinite(long) & (rest > 1e-3 * long))
    if np.any(bad):
        worst = int(np.flatnonzero(bad)[0])
        raise InvalidInputError(
            f"{np.sum(bad)} of {len(normals)} axes are not finite or have no tangential part (first: {worst}, "
            f"{given[worst].tolist()} where the normal is {normals[worst].round(3).tolist()}); give directions along "
            "the surface"
        )
    return np.asarray(flat / rest[:, None])


def port_geodesics(
    body: Surface, ports: FloatArray, k: float, length: Length, *, sources: int | None = None
) -> PortRays:
    """Geodesics up to ``length``, L, from the first ``sources`` (or all) of the ports (n, 3), L, to all."""
    # so far from a caustic a port is close to it
    pad = float(2 * np.cbrt(size(body) / k**2))
    if not (isinstance(length, str) and length == AUTO):
        long = positive_number(length, "length")
    else:
        # by the decay of the first mode at the root mean square curvature, to e^-13
        girth = np.pi * float(np.max(np.ptp(np.asarray(body.bounds, dtype=float), axis=0)))
        typical = float(np.median(curvature_norms(body, points_of_charts(body)))) / np.sqrt(2)
        decay = float(hard_modes().tau[0].imag) * np.cbrt(k / 2) * np.cbrt(typical) ** 2
        long = float(np.clip(13 / decay, 0.65 * girth, 1.2 * girth))
    return rays_between(body, ports, long, pad=pad, sources=sources)


def _coupled(
    body: Surface,
    ports: ArrayLike,
    axes: ArrayLike | None,
    kinds: str | Words,
    wavenumber: float | Wavenumbers,
    order: int,
    length: Length,
    what: str,
    boundary: BoundaryLike = "hard",
) -> Coupling | list[Coupling]:
    """The matrix of ports of given kinds, slots first, which have axes; of several wavenumbers a list."""
    many = not isinstance(wavenumber, str) and np.ndim(wavenumber) == 1
    waves: Any = real_array(wavenumber, "wavenumber").tolist() if many else [wavenumber]
    waves = [checked_wave(body, one, order, what, boundary) for one in waves]
    y = _checked_ports(body, ports)
    named, name = np.broadcast_to(kinds, len(y)), boundary_name(boundary) if what == "ports" else "pec"
    # checked before fans are traced
    slots, along = named == "slot", normal(body, y)
    if axes is not None:
        along[slots] = _tangential(axes, along[slots])
    sign = np.where(named[:, None] == named, 1, -1)

    def square(upper: Any, lower: Any, diagonal: Any) -> Any:
        out = np.where(np.triu(np.ones(sign.shape, dtype=bool)), upper, lower)
        np.fill_diagonal(out, diagonal)
        return out

    found = []
    for k in waves:
        # geodesics take a small part of the time: each wave traces its own, of the length that it needs
        rays = port_geodesics(body, y, k, length)
        blocks, values = [], np.zeros(len(rays), dtype=complex)
        for pair in TENSORS:
            sources, receivers = (named == kind for kind in pair)
            if not (np.any(sources) and np.any(receivers)):
                continue
            made = path_waves(rays.between(sources, receivers), pair, along, k, order)
            values[sources[rays.first] & receivers[rays.second]] = made.values
            blocks.append((port_sums(made), np.outer(sources, receivers)))
        whole = blocks[0][0]
        for block, where in blocks[1:]:
            whole.put(block, where)
        one = Coupling(
            body=body,
            ports=y,
            normals=rays.normals,
            values=square(whole.values, sign * whole.values.T, np.inf),
            error=square(whole.error, whole.error.T, np.inf),
            status=square(whole.status, whole.status.T, int(FieldStatus.CAUSTIC)),
            method=square(whole.method, whole.method.T, "none"),
            wavenumber=k,
            boundary=name,
            order=order,
            length=rays.length,
            length_unit=unit_of(body),
            kinds=named,
            axes=None if axes is None else along,
            _rays=rays,
            _waves=values,
        )
        found.append(one)
    return found if many else found[0]
