"""The field reflected by the lit side, uniform up to grazing incidence.

    f = (1/(2√|K|)) [1 + (i/(k cos θᵢ)) (κ_b/2 - Λ)] R e^{ik(d - r).x}
    R = -√(-4/ξ) e^{iξ³/12} P(ξ; q + q_eff),   ξ = -2 m cos θᵢ,   q_eff = -r/(4m²)

m with the curvature in the plane of incidence, r = κ_b/κₙ of the curvature across it. q_eff belongs to the hard
boundary and to impedances; it is 1 - iκ_b/(k cos θᵢ) away from grazing. A conductor has that factor with E across the
plane of incidence, and none with E in it, and turns polarisations where the plane leans against the principal axes: e
along b and h along b × d go on as e', h' along b and b × r with

    e' = R_e e - (it/(k cos²θᵢ)) R_h h,    h' = R_h h - (it/(k cos²θᵢ)) R_e e,    t = a.Sb

At normal incidence R_e and R_h are ∓1 with 1 ± i(κ_a - κ_b)/(2k), whatever the plane. What P lacks of an admittance
η at that order is added to R; where P does not serve, R is that of a plane with what P would have of that order,
R₀ = (cos θᵢ - η)/(cos θᵢ + η):

    (i η/(2k (cos θᵢ + η)²)) [κ_b - R₀ κₙ]     and     -(i κₙ/(2k cos³θᵢ)) [R₀² + 2 η² cos θᵢ/(cos θᵢ + η)³]

Each negative principal curvature turns the phase by -π/2.

The bracket is what the next order of the reflected field's series adds to that of P: Λ, from third and fourth
derivatives of the surface (`creeping.rays.specular.shape_term`), is 1/(2a) on a sphere, where the bracket is 1, and
3/(16a) on a cylinder, where κ_b = 0. It comes from Green's formula with the field on the surface to the same order.

Sources: [KLS56] for the series, [P79] for P; Derivations, F13, and F18 for what is a conductor's own.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.field.boundary import Boundary, fock_scale
from creeping.field.fock import FARTHEST, pekeris, pekeris_slope
from creeping.field.waves.shed_wave import limited, smoothstep
from creeping.rays.specular import SpecularPoints

NORMAL = (0.0, 0.2)
"""Sines of the angle of incidence between which its plane, and a conductor's polarisations, come to be told apart."""
LARGEST_TERM = 0.5
"""Bound of terms of the next order."""
UNRESOLVED = 0.25
"""Size of the next term of the reflected field's series from which a specular point is too flat for it."""


def reflection(
    cosine: FloatArray, along: FloatArray, across: FloatArray, wavenumber: float, boundary: Boundary, order: int
) -> ComplexArray:
    """Coefficient R (n,) from cos θᵢ (n,) and curvatures (n,), 1/L, in and across the plane of incidence; k in 1/L."""
    m = fock_scale(wavenumber, along)
    curved = np.isfinite(m) & (2 * m * cosine < -FARTHEST) & (cosine > 1e-12)
    out = np.empty(cosine.shape, dtype=complex)
    shifted = order == 2 and boundary.kind not in ("soft", "electric hard")
    flat = ~curved
    out[flat] = _flat_reflection(cosine[flat], along[flat], across[flat], wavenumber, boundary, order)
    if np.any(curved):
        xi = -2 * m[curved] * cosine[curved]
        q = boundary.q(m[curved])
        wave = pekeris(xi, q)
        if shifted:
            # a soft wave has no q: the hard one's relative change stands for it
            of = 0.0 if q is None else q
            change = pekeris_slope(xi, of) * np.exp(0.25j * np.pi) / (pekeris(xi, of) if q is None else wave)
            wave = (1 - 0.25 * across[curved] / along[curved] / m[curved] ** 2 * change) * wave
        out[curved] = -np.sqrt(-4 / xi) * np.exp(1j * xi**3 / 12) * wave
    if order == 2 and boundary.kind == "impedance":
        # what an admittance has at order 1/k beside P
        eta = complex(boundary.admittance)
        c = np.maximum(cosine, 0.0) + eta
        term = 0.5j * eta / (wavenumber * c**2) * (across - (cosine - eta) / c * along)
        out = out + limited(np.asarray(term, dtype=complex), LARGEST_TERM)
    return out


def _flat_reflection(
    cosine: FloatArray, along: FloatArray, across: FloatArray, k: float, boundary: Boundary, order: int
) -> ComplexArray:
    """R (n,) where P is not valid: on flat and concave surfaces, and far from grazing."""
    first = plane_reflection(cosine, boundary)
    if order == 1:
        return first
    c = np.maximum(cosine, 1e-12)
    eta = boundary.admittance
    absorbed = 2 * eta**2 * c / (c + eta) ** 3 if boundary.kind == "impedance" else 0.0
    second = -1j * along / (2 * k * c**3) * (first**2 + absorbed)
    if boundary.kind in ("hard", "impedance", "electric soft"):
        # q_eff, which P has where it serves
        slope = c / (c + eta) ** 2 if boundary.kind == "impedance" else first / c
        second = second - 1j * across / k * slope
    return np.asarray(first + limited(np.asarray(second, dtype=complex), LARGEST_TERM))


def plane_reflection(cosine: FloatArray, boundary: Boundary) -> ComplexArray:
    """R of a plane (n,), without unit: -1 soft, +1 hard, (cos θᵢ - η)/(cos θᵢ + η)."""
    if boundary.kind == "impedance":
        return np.asarray((cosine - boundary.admittance) / (cosine + boundary.admittance))
    return np.full(cosine.shape, -1.0 if boundary.kind.endswith("soft") else 1.0, dtype=complex)


def curvatures(specular: SpecularPoints) -> tuple[FloatArray, FloatArray]:
    """Normal curvatures, 1/L, along the plane of incidence and across it (n,).

    At normal incidence there is no such plane: both are the mean curvature.
    """
    oblique = smoothstep(specular.sine, *NORMAL)
    mean = 0.5 * (specular.along + specular.across)
    return mean + oblique * (specular.along - mean), mean + oblique * (specular.across - mean)


def polarisation_terms(specular: SpecularPoints, wavenumber: float) -> tuple[ComplexArray, ComplexArray]:
    """What a conductor has beside R_e, R_h of `curvatures`: p and s (n,) in (1 + p) R_e, (1 - p) R_h, -s R_e, -s R_h.

    p is what the mean of the curvatures next to normal incidence leaves out.
    """
    c = np.maximum(specular.cosine, 1e-12)
    along, across = curvatures(specular)
    kept_back = 0.5 * ((specular.along - specular.across) - (along - across))
    with np.errstate(over="ignore"):
        own = 0.5j * kept_back * (1 + 1 / c**2) / (wavenumber * c)
        other = 1j * specular.twist / (wavenumber * c**2)
    return limited(np.asarray(own), LARGEST_TERM), limited(np.asarray(other), LARGEST_TERM)


def next_order(specular: SpecularPoints, wavenumber: float) -> FloatArray:
    """Size (n,) of (κ_b/2 - Λ)/(k cos θᵢ), real: i times it is the next term of the reflected field's series."""
    with np.errstate(divide="ignore", over="ignore"):
        return np.asarray((curvatures(specular)[1] / 2 - specular.shape) / (wavenumber * specular.cosine))


def series_fails(specular: SpecularPoints, wavenumber: float, *, conductor: bool) -> BoolArray:
    """Whether the next term of a series is too large (n,), or that by which a conductor's polarisations differ."""
    size = np.abs(next_order(specular, wavenumber))
    if conductor:
        unlike = np.abs(specular.along - specular.across)
        with np.errstate(divide="ignore", over="ignore"):
            size = np.maximum(size, 0.5 * unlike / (wavenumber * specular.cosine))
    return np.asarray(size > UNRESOLVED)


def series_parameter(specular: SpecularPoints, wavenumber: float) -> FloatArray:
    """What the series of the reflected field goes by (n,), at most LARGEST_TERM: its n-th term is about its n-th power.

    It is the sum of the sizes of what makes the second, (|κₙ|/c² + |κ_b| + 2|Λ|)/(2kc), with c² = cos²θᵢ + 2/m²: nearer
    to grazing than that P is no series.
    """
    along, across = curvatures(specular)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        c = np.sqrt(specular.cosine**2 + 2 / fock_scale(wavenumber, np.abs(along)) ** 2)
        share = (np.abs(along) / c**2 + np.abs(across) + 2 * np.abs(specular.shape)) / (2 * wavenumber * c)
    return np.asarray(np.minimum(np.nan_to_num(share, nan=LARGEST_TERM), LARGEST_TERM))


def reflected_error(
    specular: SpecularPoints, wave: ComplexArray, wavenumber: float, order: int, factor: float
) -> FloatArray:
    """Size of what is beyond an order of the wave of each specular point (n,), L, some times its next power.

    Where a plane would reflect little, what comes next is a share of what a mirror reflects.
    """
    share = series_parameter(specular, wavenumber)
    with np.errstate(divide="ignore"):
        mirror = 0.5 / np.sqrt(np.abs(np.prod(specular.principal, axis=1)))
    if order == 1:
        return np.asarray(2 * share * np.maximum(np.abs(wave), share * mirror))
    return np.asarray(factor * share**2 * (np.abs(wave) + share * mirror))


def reflected_amplitude(
    specular: SpecularPoints,
    observers: FloatArray,
    direction: FloatArray,
    wavenumber: float,
    boundary: Boundary,
    order: int,
) -> ComplexArray:
    """Contribution of each specular point to the far field (n,), L."""
    R = reflection(specular.cosine, *curvatures(specular), wavenumber, boundary, order)
    path = specular.path(direction, observers)
    with np.errstate(divide="ignore"):
        spread = 0.5 / np.sqrt(np.abs(np.prod(specular.principal, axis=1)))
    turns = np.sum(specular.principal < 0, axis=1)
    f = spread * R * np.exp(1j * wavenumber * path - 0.5j * np.pi * turns)
    size = next_order(specular, wavenumber)
    if order == 2:
        f = (1 + limited(np.asarray(1j * size, dtype=np.complex128), LARGEST_TERM)) * f
    # towards a flat point the term grows like κ^-3: f, like κ^-1/2, stops growing where the term is not small
    with np.errstate(over="ignore"):
        excess = np.minimum(np.abs(size) / UNRESOLVED, 1e60)
    return np.asarray(f * (1 + excess**4) ** (-1 / 24))
