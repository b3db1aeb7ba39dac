"""The forward lobe, and the fan integral: integrals over the shadow line that no caustic spoils.

    I_S = -(1/√π) ∫ √(|J| m1 m2) e^{-iπN/2} g(ξ) e^{ik(d.x0 + s* - r.x*)} dσ⊥      rays at n.r = 0
    I_L = -(1/√π) ∫ m g(ξ) e^{iξ³/12} e^{ik(d - r).x} dσ⊥,   ξ = 2 m n.d           bisector contour, lit half
    near d      g = p*, and the silhouette -1/(4π(1 - d.r)) ∮ e^{ik(d - r).x} (d × r).dl; i k A/(2π) at r = d
    beyond      g = p* - c²/(2√π ξ),  c = n0.e on S (e along r across d), c = n.(r - d)/|r - d| on L

By stationary phase I_S is the isolated ray and I_L the reflected field. The fan integral is I_S with g = e^{-iπ/4} P
over every crossing, tapered between p.r of 0.3 and 0.7; it replaces isolated rays where they merge.

Also here: the step of a cut that fits the lobes of its pattern: lambda/D wide if bistatic, half of that in backscatter.

Sources: Derivations, F10 to F12.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.arguments import checked, fock_parameter, scales
from creeping.field.boundary import Boundary, fock_scale
from creeping.field.fock import pekeris_slope, pekeris_star
from creeping.field.waves.shed_wave import SECOND_ORDER, shared_pole, shed_orders, shed_wave, smoothstep
from creeping.geometry.surface import Surface
from creeping.rays.observer_contour import HorizonRays, MidHorizon
from creeping.shadow.attachment import line_tangents
from creeping.shadow.line import ShadowLine
from creeping.storage.memory import within_budget


def shadow_half(
    nodes: HorizonRays,
    observers: FloatArray,
    direction: FloatArray,
    wavenumber: float,
    boundary: Boundary,
    order: int,
    pole_share: FloatArray,
) -> ComplexArray:
    """Integrand of I_S times its weight (n,), L; ``pole_share`` (n,) weights g's term in c²: 0 near d, else 1."""
    rays = nodes.rays
    r, direction = observers[nodes.observer], direction[nodes.observer]
    xi = fock_parameter(rays, wavenumber)
    e = r - np.sum(r * direction, axis=1, keepdims=True) * direction
    c = np.sum(rays.first_normal * e, axis=1) / np.maximum(np.linalg.norm(e, axis=1), 1e-300)
    g = np.exp(-0.25j * np.pi) * shed_wave(
        rays, wavenumber, boundary, order, transverse_weight=0.5, pole_share=np.where(xi > 0, pole_share * c**2, 0.0)
    )
    factor = _crossing_factor(nodes, r, wavenumber)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(factor != 0, factor * g, 0.0))


def fan_half(
    nodes: HorizonRays, observers: FloatArray, wavenumber: float, boundary: Boundary
) -> tuple[ComplexArray, ComplexArray]:
    """Integrand of the fan integral times its weight (n,), L, in both orders."""
    first, second = shed_orders(nodes.rays, wavenumber, boundary, transverse_weight=0.5)
    factor = np.exp(-0.25j * np.pi) * _crossing_factor(nodes, observers[nodes.observer], wavenumber)
    # a ray that has ended counts for nothing, whatever its numbers
    first, second = (np.where(factor != 0, factor * wave, 0.0) for wave in (first, second))
    return first, second


def _crossing_factor(nodes: HorizonRays, r: FloatArray, wavenumber: float) -> ComplexArray:
    """What multiplies g(ξ) under the integral (n,), L; 0 where the integrand is."""
    rays = nodes.rays
    m1, m2 = scales(rays, wavenumber)
    phase = wavenumber * (rays.eikonal - np.sum(r * rays.points, axis=1)) - 0.5 * np.pi * rays.caustics
    taper = smoothstep(np.sum(rays.directions * r, axis=1), 0.3, 0.7) * rays.alive
    amplitude = np.sqrt(np.abs(rays.spreading) * np.where(np.isfinite(m1 * m2), m1 * m2, 0.0)) * taper
    with np.errstate(invalid="ignore"):
        factor = -amplitude / np.sqrt(np.pi) * nodes.weight * np.exp(1j * phase)
    return np.asarray(np.where(amplitude > 0, factor, 0.0))


def lit_half(
    nodes: MidHorizon,
    observers: FloatArray,
    direction: FloatArray,
    wavenumber: float,
    boundary: Boundary,
    order: int,
    pole_share: FloatArray,
) -> ComplexArray:
    """Integrand of I_L times its weight (n,), L."""
    r, direction = observers[nodes.observer], direction[nodes.observer]
    m = fock_scale(wavenumber, nodes.along)
    curved = np.isfinite(m)
    m = np.where(curved, m, 1.0)
    xi = np.minimum(2 * m * np.sum(nodes.normals * direction, axis=1), 0.0)
    away = r - direction
    c = np.sum(nodes.normals * away, axis=1) / np.maximum(np.linalg.norm(away, axis=1), 1e-300)
    ratio = np.where(curved, nodes.across / np.where(curved, nodes.along, 1.0), 0.0)
    g = lit_wave(xi, m, ratio, boundary, order, np.where(xi < 0, pole_share * c**2, 0.0))
    phase = wavenumber * np.sum((direction - r) * nodes.points, axis=1) + xi**3 / 12
    return np.asarray(np.where(curved, -m / np.sqrt(np.pi) * g * np.exp(1j * phase) * nodes.weight, 0.0))


def lit_wave(
    xi: FloatArray, m: FloatArray, ratio: FloatArray, boundary: Boundary, order: int, share: FloatArray
) -> ComplexArray:
    """p* - share/(2√π ξ) on the lit side, ξ <= 0, scales m and r = κ_b/κ_n (n,).

    The second order is that of the shadow at ξ = 0, carried over from the path e^{ikaφ} of the circle to that of the
    reflected ray: with D = -i d/dξ,

        (1/m²) {(iξ/60) D² + (1/30) D + (iξ³/24) D + i (3/320) ξ⁵ + (r/2) (D + ξ²/4) - (1/10 ± r/4) d/dq} (p* - pole)

    Far on the lit side all its growing terms cancel.
    """
    q = boundary.q(m)

    g = pekeris_star(xi, q) - shared_pole(xi, share)
    if order == 1:
        return g
    # near grazing the pole is left alone, beyond it is part of the reflected wave
    share = share * smoothstep(-xi, *SECOND_ORDER)
    whole, first, second = (pekeris_star(xi, q, n) - shared_pole(xi, share, n) for n in range(3))
    change = 1j * xi / 60 * second + (1 / 30 + 1j * xi**3 / 24 + ratio / 2) * first
    change = change + (3j / 320 * xi**5 + ratio * xi**2 / 8) * whole
    if q is not None:
        change = change - (0.1 + 0.25 * boundary.sign * ratio) * pekeris_slope(xi, q)
        if np.ndim(q):
            change = change - 2 / 15 * q * pekeris_slope(xi, q, 1)
    return np.asarray(g + change / m**2)


def silhouette(line: ShadowLine, observers: FloatArray, wavenumber: float) -> ComplexArray:
    """Diffraction by the rim of the shadow (m,), L; over the attached part of the shadow line."""
    d = line.direction
    total = np.zeros(len(observers), dtype=complex)
    area = 0.0
    for curve in line.curves:
        count = max(len(curve.points), int(np.ceil(wavenumber * curve.length)))
        what = f"{count:.2g} points of the rim at k = {wavenumber:g}"
        within_budget(200.0 * count, what, "lower the wavenumber, or ask for no direction near d")
        s = (np.arange(count) + 0.5) * (curve.length / count)
        x = curve.at(s)
        t = line_tangents(line.body, x, d)
        lit = np.zeros(count, dtype=bool)
        for start, end, status in curve.arcs:
            lit |= (np.mod(s - start, curve.length) < end - start) & (status == "attached")
        dl = t * (curve.length / count) * lit[:, None]
        area += 0.5 * float(np.sum(np.cross(x, dl) @ d))
        for row, r in enumerate(observers):
            # the closed integral of a constant is 0: without it nothing cancels near r = d
            wave = np.expm1(1j * wavenumber * (x @ (d - r)))
            total[row] += np.sum(wave * (dl @ np.cross(d, r)))
    turn = np.sign(area) if area else 1.0
    gap = 0.5 * np.sum((observers - d) ** 2, axis=1)
    ahead = gap < 1e-12
    result = -turn * total / (4 * np.pi * np.where(ahead, 1.0, gap))
    return np.asarray(np.where(ahead, 0.5j * wavenumber * abs(area) / np.pi, result))


def lobe_step(body: Surface, wavenumber: float, *, monostatic: bool) -> float:
    """Step of a cut, degrees, with four angles for each lobe: lambda/D of a bistatic pattern, half in backscatter.

    Examples
    --------
    >>> import scatterers as sc
    >>> lobe_step(sc.Sphere(), 60.0, monostatic=True)
    0.25
    """
    longest = float(np.max(np.ptp(body.bounds, axis=0)))
    lobe = 2 * np.pi / (float(checked(wavenumber, 2)) * longest) / (2 if monostatic else 1)
    steps = (1.0, 0.5, 0.25, 0.2, 0.1, 0.05, 0.025, 0.02, 0.01, 0.005, 0.002, 0.001)
    return next((step for step in steps if step <= np.degrees(lobe) / 4), steps[-1])
