"""The field on the lit side put together with the rays that come there, and how far the lit side's expansion is off.

The error of the lit side, as a share of u1 and with u2 of second order, is

    [(A |u2/u1 - 1|^2)^2 + (B/(m^4 (1 + G xi^2)))^2 + (C (|rho rho''| + rho'^2)/m^2)^2 + (D r^2/m^4)^2 + E^2]^(1/2)
    E = 0.7 max(0, 1 - 2 max(kappa_a, 0) a)/(k a max(c, 1/m_a)^3),   m_a = (ka/2)^(1/3)

r is kappa_b/kappa_a, of a conductor its root. E is for ground that is flat by the measure of the body's size a: the
second order kappa_a/(2kc^3) of optics knows nothing there of the curvature at its end, which on a closed body is 1/a in
the mean. Where rays end or the body hides part of its line, 2 epsilon more: not all waves that come to the lit side
from elsewhere on the body are known, and what currents leave inside (`creeping.field.currents.whole_body`) tells how
large the others are; where that cannot be measured the error is a bound.

Sources: [F46], [LK59]; Derivations, F16 and F20. The factors were set on four bodies
(`studies.accuracy.point_coverage`), that of E on x^4 + y^4 + z^4 = 1 at k = 8 and 14.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.boundary import Boundary, fock_scale
from creeping.field.currents.nodes import LitNodes
from creeping.field.currents.radiation import may_self_reflect
from creeping.field.results.point_result import FieldStatus, PointValues, Words
from creeping.field.waves.ray_sums import RaySum
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import size
from creeping.rays.ends import RayStatus
from creeping.rays.fan import RayFan


class LitFactors(NamedTuple):
    """Factors of the error of a boundary's lit side.

    Attributes
    ----------
    squared, least, varies, across : float
        A to D; an impedance leaves curvature that varies out of its second order.
    fades : float
        G: what the second order leaves out of a conductor's currents is most where the wave grazes.
    afar : float
        The factor of what currents leave inside on the dark side, where waves are marched beyond the end of rays.
    """

    squared: float
    least: float
    varies: float
    across: float
    fades: float
    afar: float


FACTORS = {
    "soft": LitFactors(0.7, 0.02, 0.02, 0.05, 0.0, 1.5),
    "hard": LitFactors(2.0, 0.02, 0.02, 0.05, 0.0, 2.5),
    "impedance": LitFactors(0.6, 0.05, 0.06, 0.15, 0.0, 2.0),
    "conductor": LitFactors(2.0, 0.25, 0.05, 0.3, 1.0, 2.5),
}
LEFT, UNKNOWN = 2.0, 2.0
"""Factor of what currents leave inside, of waves that come to the lit side from elsewhere; and their bound, a
reflected wave and its image."""


def convex(fan: RayFan) -> bool:
    """Whether nothing on the rays, along the line or anywhere on the body says that it may reflect onto itself.

    On a torus along its axis all rays are OK, and light goes to and fro in its hole.
    """
    if fan.line.fractions["attached"] < 1.0 or not np.all(fan.status == RayStatus.OK):
        return False
    return is_piecewise(fan.body) or not may_self_reflect(fan.body)


def composed(
    fan: RayFan,
    lit: tuple[ComplexArray, FloatArray, FloatArray],
    rays: RaySum,
    by: Words,
    left: float,
    k: float,
    kind: Boundary,
    unit: float,
) -> PointValues:
    """Total field at points of the body (n,), of one or three components.

    ``lit`` are the lit side's part of it, its error and its share; ``rays`` came ``by`` some method; ``left`` is what
    currents leave inside of the incident wave, of size ``unit``.
    """
    wave, lit_off, share = lit
    unknown = (share > 0) & (not np.isfinite(left))
    lit_off = np.hypot(lit_off, share * unit * (LEFT * left if np.isfinite(left) else UNKNOWN))
    # where rays have ended the march goes on, but waves from elsewhere come to the dark side as well
    afar, dark = FACTORS[kind.kind].afar, 1 - share
    if kind.kind == "conductor":
        # such waves come to the penumbra as they do beyond it
        # what is left inside tells of the dark side up to 0.04, beyond the factor grows with it
        afar, dark = afar * max(1.0, left / 0.04), np.where(share < 1, 1.0, 0.0)
    lit_off = np.hypot(lit_off, (by == "march") * dark * unit * afar * left if np.isfinite(left) else 0.0)
    creeping, error, status = rays.values, rays.error, rays.status
    bare = (status != FieldStatus.OK) & (error == 0)
    # next to the line rays have hardly a share: what ends with the fan is less there than the lit side is off by
    harmless = np.isin(status, (FieldStatus.TRUNCATED, FieldStatus.CAUSTIC)) & ~bare & (share > 0) & (error <= lit_off)
    status = np.where(harmless, FieldStatus.OK, status)
    error = np.where(bare, unit, error)
    # on the lit side rays that come from afar have decayed: those that are not to be trusted are left out, and no more
    # than what an axis makes of them, sqrt(2 pi k a); of those that have left the body, what is left inside tells
    most = unit * rays.faded * np.sqrt(2 * np.pi * k * size(fan.body))
    out = (share == 1) & ((status != FieldStatus.OK) | (error > most))
    creeping = np.where(out.reshape(-1, *(1,) * (creeping.ndim - 1)), 0.0, creeping)
    error = np.where(out, np.where(bare | (status == FieldStatus.DETACHED), 0.0, np.fmin(error, most)), error)
    status = np.where(share == 1, FieldStatus.OK, status)
    return PointValues(
        wave=wave,
        creeping=creeping,
        error=np.hypot(error, lit_off),
        error_by=np.where(unknown | (status != FieldStatus.OK), "bound", "expansion"),
        status=np.where(unknown & (status == FieldStatus.OK), FieldStatus.UNRESOLVED, status).astype(np.int64),
        method=np.where(share == 1, "lit", np.where(share > 0, np.char.add("lit+", by), by)),
    )


def without_tips(field: PointValues) -> PointValues:
    """The field without values where curvature is infinite, as on a tip: 0, without a bound, UNRESOLVED."""
    values = field.values.reshape(len(field.error), -1)
    bad = ~(np.all(np.isfinite(values) & (np.abs(values) < 1e30), axis=1) & np.isfinite(field.error))
    if not np.any(bad):
        return field
    each = bad.reshape(-1, *(1,) * (field.values.ndim - 1))
    return replace(
        field,
        wave=np.where(each, 0.0, field.wave),
        creeping=np.where(each, 0.0, field.creeping),
        error=np.where(bad, np.inf, field.error),
        error_by=np.where(bad, "bound", field.error_by),
        status=np.where(bad, int(FieldStatus.UNRESOLVED), field.status),
    )


def lit_error(
    part: LitNodes, size: FloatArray, change: FloatArray, k: float, kind: Boundary, order: int, extent: float
) -> FloatArray:
    """Error (n,) of the lit side's expansion, large as ``size`` and changed so much by the second order (n,).

    The body is of size ``extent``, L.
    """
    m, of = fock_scale(k, part.along), FACTORS[kind.kind]
    # grazing a flat or concave place m is infinite, and optics alone stands there
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        across = np.nan_to_num(np.abs(part.across / part.along) / m**2, posinf=0.0)
        flatness = np.maximum(0.0, 1 - 2 * np.maximum(part.along, 0.0) * extent)
        terms = (
            of.squared * (change / np.maximum(size, 1e-300)) ** 2,
            of.least / m**4 / (1 + of.fades * (np.minimum(m, 1e9) * part.cosine) ** 2),
            of.varies * (np.abs(part.bend) + part.rate**2) / m**2,
            of.across * across * (m**-2 if kind.kind == "conductor" else across),
            # what the curvature at the end of a flat surface is worth on it
            0.7 * flatness / (k * extent * np.maximum(part.cosine, np.cbrt(2 / (k * extent))) ** 3),
        )
    # an admittance that varies is off by more
    share = np.linalg.norm(terms, axis=0) * (1.5 if kind.varies else 1.0)
    return np.asarray(size * np.minimum(share, 1.0) + (change if order == 1 else 0.0))
