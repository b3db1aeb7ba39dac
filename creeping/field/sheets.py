"""The far field of many incidences as sums over sheets: rays and specular points that move with the incidence.

    f_c = sum over sheets of a_c exp(i k_c L)

A sheet is a ray shed towards an observer, or a specular point; its path L and its amplitudes a_c, one of each problem c
(a boundary, its component and a wavenumber), are smooth functions of the incidence where the field itself oscillates.

Sources: [LK59]; Derivations, F3 and F23.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.far_geometry import FarGeometry
from creeping.field.far_rays import Parts
from creeping.geometry.surface import size


class Sheets(NamedTuple):
    """Sheets of incidences with their observers.

    Attributes
    ----------
    observer : (n,) of int
        Row of the observer, ascending; those of one incidence follow each other.
    creeping : (n,) of bool
        Whether it is a shed ray, else a specular point.
    key : (n, 4)
        Where the ray leaves, and its time, in body sizes: what tells neighbours.
    path : (n,), L
        L.
    amplitudes : (n, problems), L
        Complex.
    """

    observer: IntArray
    creeping: BoolArray
    key: FloatArray
    path: FloatArray
    amplitudes: ComplexArray


def sheets_of(geometry: FarGeometry, parts: list[Parts]) -> Sheets:
    """Sheets of a geometry with the amplitudes of all its problems, one component after the other of each."""
    shed, specular = geometry.shed, geometry.specular
    rays, length = shed.rays, size(geometry.body)
    points = specular.points
    path = np.concatenate([rays.departing, specular.path(geometry.direction[specular.observer], geometry.directions)])
    key = np.concatenate(
        [
            np.concatenate([rays.points, rays.time[:, None]], axis=1),
            np.concatenate([points, np.zeros((len(points), 1))], axis=1),
        ]
    )
    waves = np.concatenate(
        [
            np.concatenate([_columns(one.shed_waves, len(shed.observer)) for one in parts], axis=1),
            np.concatenate([_columns(one.specular_waves, len(points)) for one in parts], axis=1),
        ]
    )
    numbers = np.concatenate([np.full(_width(one), one.wavenumber) for one in parts])
    with np.errstate(invalid="ignore"):
        amplitudes = waves * np.exp(-1j * numbers * path[:, None])
    observer = np.concatenate([shed.observer, specular.observer])
    creeping = np.arange(len(observer)) < len(shed.observer)
    # what has come to its end, or is hidden, is not there
    there = np.flatnonzero(np.any(amplitudes != 0, axis=1))
    order = there[np.argsort(observer[there], kind="stable")]
    return Sheets(observer[order], creeping[order], key[order] / length, path[order], amplitudes[order])


def isolated(geometry: FarGeometry, parts: list[Parts]) -> BoolArray:
    """Whether the field of each observer is that of its sheets, whatever the problem: no integral serves (m,)."""
    alone = np.ones(len(geometry.directions), dtype=bool)
    for one in parts:
        alone &= (one.in_forward == 0) & (one.in_fan == 0)
    return alone


def _width(parts: Parts) -> int:
    return 4 if parts.vector else 1


def _columns(waves: list[ComplexArray], count: int) -> ComplexArray:
    """Contributions of both polarisations of a conductor, or of the one scalar problem, as columns (count, ...)."""
    return np.asarray(np.sum(waves, axis=0, dtype=complex).reshape(count, -1) if count else np.zeros((0, _size(waves))))


def _size(waves: list[ComplexArray]) -> int:
    return int(np.prod(waves[0].shape[1:], dtype=int))
