"""Polarisation of a perfect conductor's far field: each contribution is a sum of two dyads.

    across   s = n × d/|n × d| of the incident, n' × r/|n' × r| of the scattered wave      soft
    along    h = s × d,  s' × r                                                            electric hard

n is the normal where the wave lands, n' where it leaves: both s and h are carried by the ray (b → b, n → n), with no
exchange between them [PBM80]. Components are those of θ̂ and φ̂ at the directions of travel d and r.

Sources: Derivations, F14.
"""

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.geometry.arguments import shown

CLEAR = 1e-6
"""Least |n × d| that has a direction: normals are known to 1e-11, and d and r share ``spare`` to this angle."""
ACROSS = 1e-6
"""Share of an incident E0 up to which it may lie along the direction, by rounding."""


def spherical_frame(directions: FloatArray) -> FloatArray:
    """θ̂ and φ̂ at unit directions (..., 3), φ = 0 at the poles: (..., 2, 3)."""
    x, y, z = np.moveaxis(directions, -1, 0)
    across = np.hypot(x, y)
    polar = across < 1e-12
    safe = np.where(polar, 1.0, across)
    cos, sin = np.where(polar, 1.0, x / safe), np.where(polar, 0.0, y / safe)
    theta = np.stack([z * cos, z * sin, -across], axis=-1)
    phi = np.stack([-sin, cos, np.zeros_like(cos)], axis=-1)
    return np.stack([theta, phi], axis=-2)


def incident_mix(polarisation: str | ArrayLike | None, direction: FloatArray) -> ComplexArray:
    """Components along theta and phi of incident waves of unit E, both of them for None: (2, p).

    Raises
    ------
    InvalidInputError
        If a polarisation is no text known, not three finite numbers, 0, or not across the direction.

    Examples
    --------
    >>> d = np.array([0.0, 0.0, 1.0])
    >>> incident_mix("phi", d).real.tolist(), np.round(incident_mix((1, 1j, 0), d), 3).tolist()
    ([[0.0], [1.0]], [[(0.707+0j)], [0.707j]])
    """
    if polarisation is None:
        return np.eye(2, dtype=complex)
    if isinstance(polarisation, str):
        if polarisation not in ("theta", "phi"):
            raise InvalidInputError(
                f"polarisation = {polarisation!r} is not 'theta' or 'phi'; or give E0 as three numbers"
            )
        return np.eye(2, dtype=complex)[:, [("theta", "phi").index(polarisation)]]
    try:
        given = np.asarray(polarisation, dtype=complex)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"polarisation = {shown(polarisation)} is not E0 of three numbers") from error
    if given.shape != (3,) or not np.all(np.isfinite(given)) or not np.any(given):
        raise InvalidInputError(
            f"polarisation = {shown(polarisation)} is not E0 of three finite numbers, not all of them 0"
        )
    given = given / np.linalg.norm(given)
    along = abs(given @ direction)
    if along > ACROSS:
        raise InvalidInputError(
            f"polarisation = {shown(polarisation)} has {100 * along:.3g} % of itself along the direction of incidence; "
            "give E0 across it"
        )
    mix = spherical_frame(direction) @ given
    return np.asarray((mix / np.linalg.norm(mix))[:, None])


def turned_to_azimuth(directions: FloatArray, phi: FloatArray) -> FloatArray:
    """Matrices (m, 2, 2) that give components along θ̂ and φ̂ of the azimuths φ (m,), radians, from those of here.

    They differ at the poles alone, where θ̂ and φ̂ are those of the azimuth from which a cut or a grid comes there.

    Examples
    --------
    >>> turned_to_azimuth(np.array([[0.0, 0.0, 1.0]]), np.array([np.pi / 2])).round(12)[0].tolist()
    [[0.0, 1.0], [-1.0, 0.0]]
    """
    cosine = directions[:, 2]
    theta = np.stack(
        [cosine * np.cos(phi), cosine * np.sin(phi), -np.hypot(directions[:, 0], directions[:, 1])], axis=-1
    )
    own = np.stack([theta, np.stack([-np.sin(phi), np.cos(phi), np.zeros_like(phi)], axis=-1)], axis=1)
    polar = np.hypot(directions[:, 0], directions[:, 1]) < 1e-12
    turn = np.einsum("nac,nbc->nab", own, spherical_frame(directions))
    return np.where(polar[:, None, None], turn, np.eye(2))


def wave_frame(normals: FloatArray, directions: FloatArray, spare: FloatArray) -> FloatArray:
    """Vectors s and h of waves that travel along unit directions, (n, 3) each, normals of any length: (n, 2, 3).

    ``spare`` (n, 3), tangent to the body, replaces n × d where d is along n.
    """
    s = np.cross(normals, directions)
    long = np.linalg.norm(s, axis=-1, keepdims=True)
    clear = long > CLEAR * np.linalg.norm(normals, axis=-1, keepdims=True)
    s = np.where(clear, s / np.where(clear, long, 1.0), spare)
    return np.stack([s, np.cross(s, directions)], axis=-2)


def dyads(incoming: FloatArray, outgoing: FloatArray, direction: FloatArray, observers: FloatArray) -> FloatArray:
    """Components of both dyads (n, 2 kinds, 2 scattered, 2 incident), from frames (n, 2, 3); d is (3,) or (n, 3).

    The kind is that of the incoming vector; the outgoing one stands in the same place.
    """
    received = incoming @ np.swapaxes(spherical_frame(direction), -1, -2)
    sent = np.einsum("nkc,noc->nko", outgoing, spherical_frame(observers))
    return np.asarray(sent[..., :, None] * received[..., None, :])
