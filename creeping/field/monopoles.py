"""The electric field at each of many monopoles on a perfect conductor of each other: all geodesics between them.

    E_ij = sum over geodesics of the waves of `creeping.field.monopole_waves`, or beams where these merge

Their error is that of a point source's waves.

Sources: [PW81]; Derivations, F33.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from functools import partial
from typing import Literal

import numpy as np

from creeping._typing import Any, ArrayLike, ComplexArray
from creeping.field.arguments import checked, checked_plain
from creeping.field.coupling_result import Coupling
from creeping.field.monopole_waves import MonopoleTerms, monopole_waves
from creeping.field.port_beams import PortBeams
from creeping.field.port_coupling import coupled, port_geodesics
from creeping.field.port_sources import PortSources, scalar_sources
from creeping.field.port_waves import path_terms
from creeping.geometry.arguments import checked_body
from creeping.geometry.surface import Surface
from creeping.rays.port_rays import PortRays
from creeping.rays.reach import AUTO


def monopole_coupling(
    body: Surface,
    ports: ArrayLike,
    *,
    wavenumber: float,
    order: int = 2,
    length: float | Literal["auto"] = AUTO,
) -> Coupling:
    """Fields between monopoles on a perfect conductor: E along n at each of a unit electric moment at each other.

    A short monopole with the current I all along its height h is the moment I h along the normal. Values are E there
    along the normal, with the conductor in place, times the admittance of free space, for a unit of the moment: on a
    plane twice ik (1 + grad grad/k^2) e^{ikr}/(4 pi r), near field and all. The mutual impedance of two short monopoles
    is minus that times their heights and the impedance of free space.

    Parameters
    ----------
    body : Surface
        Smooth and plain.
    ports : (n, 3), L
        On the body, two or more, no two in one place.
    wavenumber : float, 1/L
    order : 2 or 1
    length : float or "auto", L
        As of `coupling`.

    Returns
    -------
    Coupling
        A symmetric matrix (n, n), 1/L^2, with errors, statuses and geodesics as of `coupling`.

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
    k = checked(wavenumber, order)
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
