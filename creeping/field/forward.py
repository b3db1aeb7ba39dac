"""The forward lobe, and the fan integral: integrals over the shadow line that no caustic spoils.

    I_S = -(1/√π) ∫ √(|J| m1 m2) e^{-iπ N/2} g(ξ) e^{ik(d.x0 + s* - r.x*)} dσ⊥    creeping rays at the horizon n.r = 0
    I_L = -(1/√π) ∫ m g(ξ) e^{iξ³/12} e^{ik(d - r).x} dσ⊥,   ξ = 2 m n.d           mid-horizon, lit half
    near d      g = p*, and the silhouette -1/(4π(1 - d.r)) ∮ e^{ik(d - r).x} (d × r).dl; i k A/(2π) at r = d
    beyond      g = p* - c²/(2√π ξ),  c = n0.e on S (e along r across d), c = n.(r - d)/|r - d| on L

By stationary phase I_S is the isolated ray and I_L the reflected field. The fan integral is I_S with g = e^{-iπ/4} P over
every crossing, tapered in p.r; it replaces isolated rays where they merge.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.coefficients import Boundary, fock_scale
from creeping.field.launching import fock_parameter, scales, shed_wave, smoothstep
from creeping.field.reflected import lit_wave
from creeping.rays.horizon import HorizonRays, MidHorizon
from creeping.rays.launch_points import line_tangents
from creeping.rays.shadow import ShadowLine

TAPER = (0.3, 0.7)
"""p.r between which a crossing comes to count."""


def shadow_half(
    nodes: HorizonRays, observers: FloatArray, direction: FloatArray, wavenumber: float, boundary: Boundary, order: int,
    pole: FloatArray,
) -> ComplexArray:
    """Integrand of I_S times its weight (n,), L; ``pole`` (n,) weights the term in c², 0 near d and 1 beyond."""
    rays = nodes.rays
    r = observers[nodes.observer]
    xi = fock_parameter(rays, wavenumber)
    g = np.exp(-0.25j * np.pi) * shed_wave(rays, wavenumber, boundary, order, transverse_weight=0.5, star=True)
    e = r - np.sum(r * direction, axis=1, keepdims=True) * direction
    c = np.sum(rays.first_normal * e, axis=1) / np.maximum(np.linalg.norm(e, axis=1), 1e-300)
    g = g - _over(pole * c**2, 2 * np.sqrt(np.pi) * xi)
    return _crossing_wave(nodes, r, wavenumber, g)


def fan_half(
    nodes: HorizonRays, observers: FloatArray, wavenumber: float, boundary: Boundary, order: int
) -> ComplexArray:
    """Integrand of the fan integral times its weight (n,), L."""
    r = observers[nodes.observer]
    g = np.exp(-0.25j * np.pi) * shed_wave(nodes.rays, wavenumber, boundary, order, transverse_weight=0.5)
    return _crossing_wave(nodes, r, wavenumber, g)


def _crossing_wave(nodes: HorizonRays, r: FloatArray, wavenumber: float, g: ComplexArray) -> ComplexArray:
    rays = nodes.rays
    m1, m2 = scales(rays, wavenumber)
    phase = wavenumber * (rays.eikonal - np.sum(r * rays.points, axis=1)) - 0.5 * np.pi * rays.caustics
    taper = smoothstep(np.sum(rays.directions * r, axis=1), *TAPER) * rays.alive
    amplitude = np.sqrt(np.abs(rays.spreading) * np.where(np.isfinite(m1 * m2), m1 * m2, 0.0)) * taper
    with np.errstate(invalid="ignore"):
        wave = -amplitude / np.sqrt(np.pi) * g * np.exp(1j * phase) * nodes.weight
    return np.asarray(np.where(amplitude > 0, wave, 0.0))


def lit_half(
    nodes: MidHorizon, observers: FloatArray, direction: FloatArray, wavenumber: float, boundary: Boundary, order: int,
    pole: FloatArray,
) -> ComplexArray:
    """Integrand of I_L times its weight (n,), L."""
    r = observers[nodes.observer]
    m = fock_scale(wavenumber, nodes.along)
    curved = np.isfinite(m)
    m = np.where(curved, m, 1.0)
    xi = np.minimum(2 * m * (nodes.normals @ direction), 0.0)
    g = np.exp(-0.25j * np.pi) * lit_wave(
        xi, m, np.where(curved, nodes.across / np.where(curved, nodes.along, 1.0), 0.0), boundary, order, star=True
    )
    away = r - direction
    c = np.sum(nodes.normals * away, axis=1) / np.maximum(np.linalg.norm(away, axis=1), 1e-300)
    g = g - _over(pole * c**2, 2 * np.sqrt(np.pi) * xi)
    phase = wavenumber * np.sum((direction - r) * nodes.points, axis=1) + xi**3 / 12
    return np.asarray(np.where(curved, -m / np.sqrt(np.pi) * g * np.exp(1j * phase) * nodes.weight, 0.0))


def _over(top: FloatArray, bottom: FloatArray) -> FloatArray:
    """Quotient, 0 where the bottom is: there the top vanishes faster."""
    return np.divide(top, bottom, out=np.zeros_like(top), where=bottom != 0)


def silhouette(line: ShadowLine, observers: FloatArray, wavenumber: float) -> ComplexArray:
    """Diffraction by the rim of the shadow (m,), L; over the attached part of the shadow line."""
    d = line.direction
    total = np.zeros(len(observers), dtype=complex)
    area = 0.0
    for curve in line.curves:
        count = max(len(curve.points), int(np.ceil(wavenumber * curve.length)))
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
