"""The field at each of many ports on a hard body of a unit point source at each other: all geodesics between them.

    u_ij = sum over geodesics of the waves of `creeping.field.port_waves`, or beams where these merge

Sources: [PW81], [P82]; Derivations, F25.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from typing import Literal

import numpy as np

from creeping._typing import Any, ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import BoundaryLike, boundary_name, scalar_boundaries
from creeping.field.coupling_result import Coupling
from creeping.field.point_result import FieldStatus
from creeping.field.port_sources import PortSources, point_sources
from creeping.field.port_sums import PortSums, port_sums
from creeping.field.served import Words
from creeping.field.special.airy import hard_modes
from creeping.geodesics.bundle import as_points, on_body
from creeping.geodesics.equations import points_of_charts
from creeping.geometry.arguments import checked_body, positive_number
from creeping.geometry.curvature import curvature_norms
from creeping.geometry.surface import Surface, size
from creeping.geometry.unit import unit_of
from creeping.rays.port_rays import PortRays, rays_between
from creeping.rays.reach import AUTO

DECAY, GIRTHS = 13.0, (0.65, 1.2)
"""Exponent by which the wave falls along geodesics of length "auto", and bounds of that in girths of the body."""
CLOSEST = 1e-6
"""Least distance of ports, in body sizes."""
NEAR = 2.0
"""How far from a caustic a port is close to it, in terms of (a/k^2)^(1/3)."""


def coupling(
    body: Surface,
    ports: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "hard",
    order: int = 2,
    length: float | Literal["auto"] = AUTO,
) -> Coupling:
    """Fields between ports on a hard body: u at each of them of a unit point source e^{ikr}/(4 pi r) at each other.

    Parameters
    ----------
    body : Surface
        Smooth and plain.
    ports : (n, 3), L
        On the body, two or more.
    wavenumber : float, 1/L
    boundary : "hard"
        On a soft body the field is 0; that of an impedance is not known here.
    order : 2 or 1
    length : float or "auto", L
        Up to which geodesics are followed; "auto" is where the wave has died away, and at least long enough for both
        ways round to meet.

    Returns
    -------
    Coupling
        A matrix (n, n), 1/L, that acts as an array, with errors, statuses, and the geodesics of each pair. Trouble of a
        pair is a status: CAUSTIC where geodesics merge and beams do not serve, DETACHED where one that mattered has
        come to where kappa_n <= 0, NO_RAY and TRUNCATED where none comes.

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
    k = checked_wave(body, wavenumber, boundary, order)
    rays = port_geodesics(body, ports, k, length)
    return coupled(rays, point_sources(rays, k, order), k, boundary_name(boundary), order)


def checked_wave(body: Surface, wavenumber: float, boundary: BoundaryLike, order: int) -> float:
    """The wavenumber, if coupling is known on the body at it, with the boundary and to the order."""
    checked_body(body)
    checked_plain(body, smooth="the coupling of ports")
    k = checked(wavenumber, order)
    if scalar_boundaries(boundary)[0].kind != "hard" or boundary == "pec":
        raise InvalidInputError(
            f"boundary = {boundary_name(boundary)!r}: coupling is known on hard bodies only; give 'hard', or use "
            "slot_coupling, monopole_coupling or antenna_coupling for slots in and monopoles on a conductor"
        )
    return k


def port_geodesics(body: Surface, ports: ArrayLike, k: float, length: float | Literal["auto"]) -> PortRays:
    """All between checked ports (n, 3), L, up to a length, L."""
    y = _checked_ports(body, ports)
    return rays_between(body, y, fan_length(body, k, length), pad=merging_pad(body, k))


def merging_pad(body: Surface, k: float) -> float:
    """How far from a caustic a port counts as close to it, L."""
    return float(NEAR * np.cbrt(size(body) / k**2))


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


def fan_length(body: Surface, k: float, length: float | Literal["auto"]) -> float:
    """Length of geodesics, L: "auto" is by the decay of the first mode at the root mean square curvature."""
    if not (isinstance(length, str) and length == AUTO):
        return positive_number(length, "length")
    box = np.asarray(body.bounds, dtype=float)
    girth = np.pi * float(np.max(box[1] - box[0]))
    typical = float(np.median(curvature_norms(body, points_of_charts(body)))) / np.sqrt(2)
    decay = float(hard_modes().tau[0].imag) * np.cbrt(k / 2) * np.cbrt(typical) ** 2
    return float(np.clip(DECAY / decay, GIRTHS[0] * girth, GIRTHS[1] * girth))


def coupled(
    rays: PortRays,
    sources: PortSources,
    k: float,
    boundary: str,
    order: int,
    kind: str = "point",
    axes: FloatArray | None = None,
) -> Coupling:
    """The matrix of ports of one kind, symmetric."""
    return matrix_of(rays, port_sums(rays, sources, k), k, boundary, order, np.full(len(rays.ports), kind), axes)


def matrix_of(
    rays: PortRays, found: PortSums, k: float, boundary: str, order: int, kinds: Words, axes: FloatArray | None
) -> Coupling:
    """The matrix, with what has no meaning on its diagonal; ports of two kinds have the opposite the other way."""
    n = len(rays.ports)
    values = found.values
    back = np.where(kinds[:, None] == kinds, values.T, -values.T)

    def square(upper: Any, lower: Any, diagonal: Any) -> Any:
        out = np.where(np.triu(np.ones((n, n), dtype=bool)), upper, lower)
        np.fill_diagonal(out, diagonal)
        return out

    return Coupling(
        body=rays.body,
        ports=rays.ports,
        normals=rays.normals,
        values=square(values, back, np.inf),
        error=square(found.error, found.error.T, np.inf),
        status=square(found.status, found.status.T, int(FieldStatus.CAUSTIC)),
        method=square(found.method, found.method.T, "none"),
        wavenumber=k,
        boundary=boundary,
        order=order,
        length=rays.length,
        length_unit=unit_of(rays.body),
        kinds=kinds,
        axes=axes,
        _rays=rays,
        _waves=found.waves,
    )
