"""Incident waves: a plane wave, or that of a point source, and how each travels at a point.

    q(x) = d + w x,   p = q/|q|,   1/R = w/|q|

Plane wave: w = 0 and |d| = 1; its phase is k d.x. Point source at x_s: w > 0 and d = -w x_s, so that R = |x - x_s|; its
phase is kR, its amplitude 1/(4 pi R). Kernels take the row (d, w); any multiple of it is the same source.

Sources: Derivations, R19.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.geometry.arguments import real_array, shown
from creeping.geometry.directions import unit_direction
from creeping.geometry.surface import Surface, size

REMEDY = (
    "a point source off the body. Its fan has each ray's own wave, by creeping.surface_field(fan, wavenumber=k) "
    "without points; other fields come by reciprocity: creeping.source_pattern gives what it sends away, "
    "creeping.coupling what passes between points on the body"
)


@dataclass(frozen=True, init=False)
class PlaneWave:
    """A plane wave e^{ik d.x}.

    Parameters
    ----------
    direction : (3,)
        Direction of travel; need not be unit.

    Attributes
    ----------
    direction : tuple of float
        Unit vector.

    Raises
    ------
    InvalidInputError
        If the direction is zero or not finite.

    Examples
    --------
    >>> import creeping as cr
    >>> cr.PlaneWave((0, 0, 2)).direction
    (0.0, 0.0, 1.0)
    """

    direction: tuple[float, float, float]

    def __init__(self, direction: ArrayLike) -> None:
        x, y, z = unit_direction(direction).tolist()
        object.__setattr__(self, "direction", (x, y, z))

    def row(self, body: Surface | None = None) -> FloatArray:
        """Homogeneous coordinates (d, 0) of the wave for the compiled kernels: (4,)."""
        return np.array([*self.direction, 0.0])


@dataclass(frozen=True, init=False)
class PointSource:
    """A point source e^{ikR}/(4 pi R), where R is the distance from the source.

    Parameters
    ----------
    position : (3,), L
        Outside the body, not on it.

    Attributes
    ----------
    position : tuple of float, L

    Raises
    ------
    InvalidInputError
        If the position is not three finite numbers.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> line = cr.shadow_line(sc.Sphere(), source=cr.PointSource((0, 0, -2)))
    >>> round(line.length / (2 * np.pi), 6)                     # the circle at 60 degrees from the source: sin 60
    0.866025
    """

    position: tuple[float, float, float]

    def __init__(self, position: ArrayLike) -> None:
        found = real_array(position, "coordinates of a source")
        if found.shape != (3,) or not np.all(np.isfinite(found)):
            raise InvalidInputError(f"source position {shown(position)} is not three finite numbers; give (x, y, z)")
        x, y, z = found.tolist()
        object.__setattr__(self, "position", (x, y, z))

    def row(self, body: Surface | None = None) -> FloatArray:
        """Homogeneous coordinates (d, w) of the source for compiled kernels, |d + w x| about 1 on the body: (4,)."""
        x = np.array(self.position)
        if body is None:
            return np.array([*-x, 1.0])
        far = float(np.linalg.norm(x - np.mean(body.bounds, axis=0)))
        w = 1 / max(far, 0.5 * size(body))
        return np.array([*(-w * x), w])


Incident = PlaneWave | PointSource


def incident_words(source: Incident) -> str:
    """Direction or place of a wave, for titles.

    Examples
    --------
    >>> incident_words(PlaneWave((0, 3, 4))), incident_words(PointSource((0, 0, 1.5)))
    ('d = (0, 0.6, 0.8)', 'source at (0, 0, 1.5)')
    """
    kind, place = ("source at", source.position) if isinstance(source, PointSource) else ("d =", source.direction)
    return f"{kind} ({', '.join(f'{x:.3g}' for x in place)})"


def incident_of(direction: ArrayLike | None, source: Incident | None) -> Incident:
    """The incident wave that a caller names in one of two ways.

    Raises
    ------
    InvalidInputError
        If both or neither is given, or the source is none.
    """
    if (direction is None) == (source is None):
        raise InvalidInputError(
            "give either direction=, three numbers, where a plane wave travels, or source=, a creeping.PlaneWave or "
            f"creeping.PointSource: {'neither' if source is None else 'both'} given"
        )
    if source is None:
        assert direction is not None
        return PlaneWave(direction)
    if not isinstance(source, PlaneWave | PointSource):
        raise InvalidInputError(
            f"source = {shown(source)} is no wave; give creeping.PointSource((x, y, z)) or "
            "creeping.PlaneWave(direction)"
        )
    return source


def incident_of_row(wave: FloatArray) -> Incident:
    """The wave of a row (d, w), or of a unit direction (3,)."""
    if spherical(wave):
        return PointSource(-wave[:3] / wave[3])
    return PlaneWave(wave[:3])


def plane_direction(source: Incident, what: str) -> FloatArray:
    """Direction (3,) of a plane wave; that of another wave there is none.

    Raises
    ------
    InvalidInputError
        If it is a point source: ``what`` has no one direction.
    """
    if isinstance(source, PointSource):
        raise InvalidInputError(f"{what} has no one direction: it is of {REMEDY}")
    return np.array(source.direction)


def rows_of(waves: FloatArray) -> FloatArray:
    """Rows (d, w) of waves, contiguous: (..., 4), or unit directions (..., 3) of plane waves -> (..., 4)."""
    waves = np.asarray(waves, dtype=float)
    if waves.shape[-1] == 3:
        waves = np.concatenate([waves, np.zeros((*waves.shape[:-1], 1))], axis=-1)
    return np.ascontiguousarray(waves)


def spherical(waves: FloatArray) -> bool:
    """Whether some of the waves (..., 3 or 4) are those of point sources."""
    return bool(waves.shape[-1] == 4 and np.any(waves[..., 3]))


def travel(waves: FloatArray, points: FloatArray) -> FloatArray:
    """q of waves (..., 3 or 4) at points (..., 3), not unit but for plane waves: (..., 3)."""
    if not spherical(waves):
        return np.asarray(waves[..., :3])
    return np.asarray(waves[..., :3] + waves[..., 3:] * points)


def headings(waves: FloatArray, points: FloatArray) -> FloatArray:
    """Unit vectors p of waves (..., 3 or 4) at points (..., 3), along which they travel: (..., 3)."""
    q = np.broadcast_to(travel(waves, points), np.broadcast_shapes(points.shape, (*waves.shape[:-1], 3)))
    return q / np.linalg.norm(q, axis=-1, keepdims=True) if spherical(waves) else q


def openings(waves: FloatArray, points: FloatArray) -> FloatArray:
    """1/R of waves (..., 3 or 4) at points (..., 3), 0 of plane waves: (...), 1/L."""
    shape = np.broadcast_shapes(points.shape[:-1], waves.shape[:-1])
    if not spherical(waves):
        return np.zeros(shape)
    return np.broadcast_to(waves[..., 3] / np.linalg.norm(travel(waves, points), axis=-1), shape)


def optical_paths(waves: FloatArray, points: FloatArray) -> FloatArray:
    """The eikonal of waves (..., 3 or 4) at points (..., 3), d.x or R: (...), L."""
    plane = np.asarray(np.sum(points * waves[..., :3], axis=-1))
    if not spherical(waves):
        return plane
    opened = openings(waves, points)
    return np.asarray(np.divide(1.0, opened, out=plane.copy(), where=opened > 0))
