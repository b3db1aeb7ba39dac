"""Unit directions of sweeps: from and to angles, spread over the sphere, with quadrature weights, and along cuts.

A direction is where the wave travels. theta is measured from z, phi and the azimuth from x towards y, the elevation
from the plane of x and y; all in radians.

Also here: tangents at a normal, and solutions found more than once: the first of each.

Sources: [G10], [LL99], [W06]; Derivations, B9.
"""

from collections.abc import Callable

import numpy as np

from creeping._typing import ArrayLike, BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geometry.arguments import real_array, shown

MOST = 10_000_000
"""Directions of one set: 240 MB."""
LEBEDEV_ORDERS = (
    *range(3, 33, 2),
    *range(35, 132, 6),
)


def tangent_frames(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit tangents at each unit normal, right-handed with it: (..., 3) -> (..., 3), (..., 3).

    The first is across that axis of space which the normal is farthest from.

    Examples
    --------
    >>> one, two = tangent_frames(np.array([0.0, 0.0, 1.0]))
    >>> one.tolist(), two.tolist()
    ([0.0, 1.0, 0.0], [-1.0, 0.0, 0.0])
    """
    one = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=-1)])
    one /= np.linalg.norm(one, axis=-1, keepdims=True)
    return one, np.cross(normals, one)


def directions_from_angles(theta: ArrayLike, phi: ArrayLike) -> FloatArray:
    """Unit directions of polar angles and azimuths.

    Parameters
    ----------
    theta, phi : (...), radians
        Broadcast against each other.

    Returns
    -------
    (..., 3)

    Raises
    ------
    InvalidInputError
        If angles are not finite numbers, or do not broadcast.

    Examples
    --------
    >>> directions_from_angles([0.0, np.pi / 2], 0.0).round(12) + 0.0
    array([[0., 0., 1.],
           [1., 0., 0.]])
    """
    t, p = _angles(theta=theta, phi=phi)
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t) * np.ones_like(p)], axis=-1)


def angles_of(directions: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Polar angles in [0, pi] and azimuths in (-pi, pi], radians, of directions (..., 3), which need not be unit.

    Examples
    --------
    >>> theta, phi = angles_of((0.0, 2.0, 0.0))
    >>> float(theta.round(6)), float(phi.round(6))
    (1.570796, 1.570796)
    """
    d = unit_directions(directions)
    # arccos loses half the digits near the poles
    return np.arctan2(np.hypot(d[..., 0], d[..., 1]), d[..., 2]), np.arctan2(d[..., 1], d[..., 0])


def directions_from_azimuth_elevation(azimuth: ArrayLike, elevation: ArrayLike) -> FloatArray:
    """Unit directions (..., 3) of azimuths and elevations (...), radians.

    Examples
    --------
    >>> directions_from_azimuth_elevation(0.0, np.pi / 2).round(12)
    array([0., 0., 1.])
    """
    a, e = _angles(azimuth=azimuth, elevation=elevation)
    return np.stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e) * np.ones_like(a)], axis=-1)


def azimuth_elevation_of(directions: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Azimuths in (-pi, pi] and elevations in [-pi/2, pi/2] of directions (..., 3), which need not be unit."""
    d = unit_directions(directions)
    return np.arctan2(d[..., 1], d[..., 0]), np.arctan2(d[..., 2], np.hypot(d[..., 0], d[..., 1]))


def fibonacci_directions(n: int) -> FloatArray:
    """Evenly spread unit directions (n, 3): equal steps of z, turned by the golden angle [G10].

    Parameters
    ----------
    n : int
        1 to 10 000 000.

    Raises
    ------
    InvalidInputError
        If n is not a whole number in this range.

    Examples
    --------
    >>> fibonacci_directions(1000).shape
    (1000, 3)
    """
    count = direction_count("n", n)
    k = np.arange(count)
    z = 1 - (2 * k + 1) / count
    # whole turns are left out before the product grows, so that late points keep their digits
    turn = 2 * np.pi * ((k * (2 / (1 + np.sqrt(5)))) % 1.0)
    r = np.sqrt((1 - z) * (1 + z))
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=-1)


def lebedev_directions(order: int) -> tuple[FloatArray, FloatArray]:
    """Unit directions (n, 3) and weights (n,), of sum 4 pi, exact for polynomials up to ``order`` [LL99].

    Raises
    ------
    InvalidInputError
        If there is no rule of this order; the message lists them.

    Examples
    --------
    >>> directions, weights = lebedev_directions(17)
    >>> len(directions), bool(abs(weights.sum() - 4 * np.pi) < 1e-12)
    (110, True)
    """
    if isinstance(order, bool) or order not in LEBEDEV_ORDERS:
        known = ", ".join(map(str, LEBEDEV_ORDERS))
        raise InvalidInputError(f"order = {order!r} is none of Lebedev's: {known}")
    from scipy.integrate import lebedev_rule

    points, weights = lebedev_rule(int(order))
    d = np.ascontiguousarray(points.T)
    return d / np.linalg.norm(d, axis=1, keepdims=True), np.asarray(weights)


def theta_phi_grid(n_theta: int, n_phi: int) -> tuple[FloatArray, FloatArray]:
    """Directions of a grid with equal steps in both angles, and their weights.

    Parameters
    ----------
    n_theta, n_phi : int
        theta = (i + 1/2) pi/n_theta, phi = 2 pi j/n_phi; phi runs fastest.

    Returns
    -------
    directions : (n_theta n_phi, 3)
    weights : (n_theta n_phi,)
        Of sum 4 pi; Fejer's first rule [W06], exact for polynomials below the degree min(n_theta, n_phi).

    Examples
    --------
    >>> directions, weights = theta_phi_grid(8, 16)
    >>> directions.shape, bool(abs(np.sum(weights * directions[:, 2] ** 2) - 4 * np.pi / 3) < 1e-12)
    ((128, 3), True)
    """
    from scipy.fft import dct

    rows, columns = direction_count("n_theta", n_theta), direction_count("n_phi", n_phi)
    direction_count("n_theta n_phi", rows * columns)
    theta = (np.arange(rows) + 0.5) * np.pi / rows
    # 2 sum over j of cos(2 j theta)/(4 j^2 - 1) is a cosine transform; cos(rows theta) is 0
    j = np.arange(1, (rows + 1) // 2)
    terms = np.zeros(rows)
    terms[2 * j] = 1 / (4.0 * j**2 - 1)
    fejer = 2 / rows * (1 - dct(terms, type=3))
    phi = 2 * np.pi * np.arange(columns) / columns
    directions = directions_from_angles(theta[:, None], phi).reshape(-1, 3)
    return directions, np.repeat(fejer * 2 * np.pi / columns, columns)


def great_circle(
    first: ArrayLike, through: ArrayLike, n: int, *, start: float = 0.0, stop: float = 2 * np.pi, endpoint: bool = False
) -> FloatArray:
    """Directions at equal angles along the great circle from one direction through another.

    Parameters
    ----------
    first, through : (3,)
        Need not be unit, and must not be parallel.
    n : int
    start, stop : float, radians
        Angles from ``first``, positive towards ``through``.
    endpoint : bool
        Whether ``stop`` is among them.

    Returns
    -------
    (n, 3)

    Raises
    ------
    InvalidInputError
        If a direction is not three finite numbers, both are parallel, or n is out of range.

    Examples
    --------
    >>> great_circle((0, 0, 1), (1, 0, 0), 4).round(12) + 0.0
    array([[ 0.,  0.,  1.],
           [ 1.,  0.,  0.],
           [ 0.,  0., -1.],
           [-1.,  0.,  0.]])
    """
    count = direction_count("n", n)
    a, b = unit_directions(first), unit_directions(through)
    if a.shape != (3,) or b.shape != (3,):
        raise InvalidInputError(f"first and through have shapes {a.shape} and {b.shape}; give three numbers each")
    (angles,) = _angles(angles=np.linspace(start, stop, count, endpoint=endpoint))
    across = np.cross(np.cross(a, b), a)
    sine = float(np.linalg.norm(across))
    if sine < 1e-9:
        raise InvalidInputError(
            f"first {tuple(a.tolist())} and through {tuple(b.tolist())} are parallel (sine of their angle {sine:.1e}); "
            "give two directions that span a plane"
        )
    d = np.cos(angles)[:, None] * a + np.sin(angles)[:, None] * across / sine
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


def unit_directions(directions: ArrayLike, what: str = "directions") -> FloatArray:
    """Return directions (..., 3) as unit vectors; those that are unit keep their bits.

    Raises
    ------
    InvalidInputError
        If the shape is another or rows are zero or not finite; the rows are named, and are ``rows`` of the error.
    """
    d = real_array(directions, what)
    if d.ndim < 1 or d.shape[-1] != 3 or d.size == 0:
        raise InvalidInputError(f"{what} have shape {d.shape}; give at least one row of three numbers, shape (n, 3)")
    flat = d.reshape(-1, 3)
    largest = np.max(np.abs(flat), axis=1)
    for wrong, word in ((~np.isfinite(largest), "not finite"), (largest == 0, "zero")):
        rows = np.flatnonzero(wrong)
        if len(rows):
            named = ", ".join(map(str, rows[:5])) + (", ..." if len(rows) > 5 else "")
            verb = "is" if len(rows) == 1 else "are"
            raise InvalidInputError(
                f"{len(rows)} of {len(flat)} {what} {verb} {word} (rows {named}; the first is "
                f"{tuple(flat[rows[0]].tolist())}); leave them out",
                rows=rows,
            )
    return _normalised(flat).reshape(d.shape)


def _normalised(flat: FloatArray) -> FloatArray:
    """Finite vectors (n, 3), none of them zero, of unit length."""
    # first by the largest component, whose square may overflow or vanish
    largest = np.max(np.abs(flat), axis=1)
    unit = np.abs(np.linalg.norm(np.clip(flat, -2, 2), axis=1) - 1) < 4e-16
    scaled = flat / largest[:, None]
    scaled /= np.linalg.norm(scaled, axis=1, keepdims=True)
    return np.where(unit[:, None], flat, scaled)


def _angles(**named: ArrayLike) -> list[FloatArray]:
    """Finite angles, broadcast against each other."""
    found = []
    for name, values in named.items():
        try:
            array = real_array(values, name)
        except InvalidInputError as error:
            raise InvalidInputError(f"{name} is not an array of numbers: {error}") from error
        bad = int(np.sum(~np.isfinite(array)))
        if bad:
            raise InvalidInputError(f"{bad} of {array.size} values of {name} are not finite; give angles in radians")
        found.append(array)
    try:
        return [np.asarray(array) for array in np.broadcast_arrays(*found)]
    except ValueError as error:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(named, found, strict=True))
        raise InvalidInputError(f"shapes do not go together: {shapes}") from error


def direction_count(name: str, value: int) -> int:
    """Return a number of directions, if it is one from 1 to `MOST`.

    Raises
    ------
    InvalidInputError
        If it is none.
    """
    kinds = (int, np.signedinteger, np.unsignedinteger)
    # to numpy a duration is a whole number
    if isinstance(value, (bool, np.timedelta64)) or not isinstance(value, kinds) or not 1 <= value <= MOST:
        raise InvalidInputError(f"{name} = {shown(value)} is not a whole number from 1 to {MOST}")
    return int(value)


def unit_direction(direction: ArrayLike) -> FloatArray:
    """Return an incidence direction as a unit vector (3,).

    Raises
    ------
    InvalidInputError
        If it has not three finite components or is zero.

    Examples
    --------
    >>> unit_direction((0, 3, 4))
    array([0. , 0.6, 0.8])
    """
    try:
        d = real_array(direction, "numbers of the direction")
    except InvalidInputError as error:
        raise InvalidInputError(f"direction {shown(direction)} is not three numbers: {error}") from error
    if d.shape != (3,):
        raise InvalidInputError(f"direction has shape {d.shape}; give three numbers, e.g. (1, 1, 1)")
    if not np.all(np.isfinite(d)):
        raise InvalidInputError(f"direction {tuple(d.tolist())} is not finite; give three finite numbers")
    if not np.any(d):
        raise InvalidInputError("direction is the zero vector; give where the wave travels, e.g. (1, 1, 1)")
    return np.asarray(_normalised(d[None])[0])


def first_of_equals(group: IntArray, alike: Callable[[IntArray, IntArray], BoolArray]) -> IntArray:
    """Numbers (m,), ascending, of those that are like no earlier one of their group.

    Parameters
    ----------
    group : (n,)
        What each is a solution of.
    alike : callable
        Whether two of them are one: numbers (k,), (k,) -> (k,).

    Examples
    --------
    >>> x = np.array([0.0, 1.0, 1e-9, 1.0])
    >>> first_of_equals(np.array([0, 0, 0, 1]), lambda i, j: np.abs(x[i] - x[j]) < 1e-6)
    array([0, 1, 3])
    """
    kept = np.ones(len(group), dtype=bool)
    if not len(group):
        return np.flatnonzero(kept)
    order = np.argsort(group, kind="stable")
    _, counts = np.unique(group, return_counts=True)
    for shift in range(1, int(counts.max())):
        late, early = order[shift:], order[:-shift]
        same = group[late] == group[early]
        late, early = late[same], early[same]
        kept[late[alike(late, early)]] = False
    return np.flatnonzero(kept)
