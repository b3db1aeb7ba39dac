"""Marched waves of both senses on a section, put together on its surface and compared with the exact ones.

In front, between the two starts, stands optics of second order [K56]: with c = -n.d and z = i kappa/(2 k c^3),

    soft du/dn = -2ik c e^{ikd.x} (1 + z),   hard u = 2 e^{ikd.x} (1 - z)
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import HARD, SOFT, Boundary
from creeping.field.marching.layer import MarchedRays, march_rays
from creeping.field.marching.profile import RayProfiles
from tests.reference.section import SectionField
from tests.reference.section_shapes import Section

BLEND = (1.0, 0.8)
"""Shares of the way back to the start between which optics gives over to the marched wave."""
ROUND = 0.95
"""Share of the circumference that a wave is followed for the far field,"""
SEEN = 0.62
"""and for the field on the surface."""
NODES = 900
"""Of a ray's profile, over the section's length."""
BOUNDARIES: dict[str, Boundary] = {"soft": SOFT, "hard": HARD, "impedance": Boundary("impedance")}
Admittance = Callable[[FloatArray], Any]
REGIONS = ("lit", "penumbra", "deep", "concave", "beyond")


@dataclass(frozen=True)
class SectionWave:
    """Wave that creeps round a section in one sense from its shadow point on.

    Attributes
    ----------
    marched : MarchedRays
        Of one ray.
    shadow : float, L
        Arc length of the shadow point.
    sense : int
        1 counterclockwise.
    phase : complex
        Of the incident wave at the shadow point.
    """

    marched: MarchedRays
    shadow: float
    sense: int
    phase: complex

    def along(self, s: FloatArray, section: Section) -> FloatArray:
        """Length along the wave's way (n,), L, of places on the section, 0 to its circumference."""
        return np.mod(self.sense * (s - self.shadow), section.length)

    def values(self, along: FloatArray) -> ComplexArray:
        """Wave (n,) at lengths along its way, 0 where it was not marched."""
        return np.asarray(self.phase * self.marched.at(0, along) * np.exp(1j * self.marched.wavenumber * along))


def shadow_point(section: Section, direction: FloatArray, sense: int) -> float:
    """Arc length of the first place from the front on, in a sense, where the wave grazes and goes on."""
    s = np.linspace(0, section.length, 20001)
    front = s[np.argmin(section.at(s).points @ direction)]
    way = front + sense * np.linspace(0, section.length, 20001)
    places = section.at(way)
    dark = (places.normals @ direction > -1e-9) & (sense * places.tangents @ direction > 0)
    i = int(np.argmax(dark))
    low, high = way[i - 1], way[i]
    for _ in range(60):
        middle = 0.5 * (low + high)
        there = float(section.at(np.array([middle])).normals[0] @ direction) > -1e-9
        low, high = (low, middle) if there else (middle, high)
    return float(np.mod(high, section.length))


def plane_rays(s: FloatArray, curvature: FloatArray, **more: Any) -> RayProfiles:
    """Rays in planes, J = 1 on them, and the incident wave that of their curves, unless more is given."""
    none = np.zeros(s.shape)
    names = "transverse", "torsion", "lean", "potential", "phase", "climb"
    given = dict.fromkeys(names, none) | {"spreading": none + 1} | more
    found = RayProfiles(s, curvature, **given)
    own = {"phase": found.curves[..., 1] - s, "climb": np.sin(found.curves[..., 0])}
    return replace(found, **{name: values for name, values in own.items() if name not in more})


def section_profile(section: Section, shadow: float, sense: int, length: float) -> RayProfiles:
    """Profile of the way along a section from half its circumference before the shadow point on."""
    begin, total = -section.length / 2, section.length
    shifts = np.concatenate([sense * (section.joints + i * total - shadow) for i in range(-3, 4)])
    # the shadow point may lie on a joint, by rounding beside it
    shifts = np.where(np.abs(shifts) < 1e-9 * total, 0.0, shifts)
    inner = np.unique(shifts[(shifts > begin + 1e-6) & (shifts < length - 1e-6)])
    marks = np.concatenate([[begin], inner, [length]])
    s, kappa = [], []
    for low, high in pairwise(marks):
        ends = [low, 0.0, high] if low < 0 < high else [low, high]
        piece = [np.array([low])]
        for a, b in pairwise(ends):
            piece.append(np.linspace(a, b, max(4, int(NODES * (b - a) / total)))[1:])
        nodes = np.concatenate(piece)
        # a joint belongs to both of its pieces
        inside = np.clip(nodes, low + 1e-7 * total * bool(len(inner)), high - 1e-7 * total * bool(len(inner)))
        s.append(nodes)
        kappa.append(section.at(shadow + sense * inside).curvature)
    return plane_rays(np.concatenate(s)[None], np.concatenate(kappa)[None])


def section_waves(
    section: Section,
    wavenumber: float,
    angle: float,
    boundary: str,
    share: float = SEEN,
    admittance: Admittance | None = None,
) -> list[SectionWave]:
    """Waves of both senses for incidence along (cos angle, sin angle), followed for a share of the circumference.

    With an admittance, eta at arc lengths, the boundary is an impedance.
    """
    direction = np.array([np.cos(angle), np.sin(angle)])
    waves = []
    for sense in (1, -1):
        shadow = shadow_point(section, direction, sense)
        profile = section_profile(section, shadow, sense, share * section.length)
        if admittance is not None:
            profile = replace(profile, admittance=np.asarray(admittance(shadow + sense * profile.s), dtype=complex))
        marched = march_rays(profile, wavenumber=wavenumber, boundary=BOUNDARIES[boundary])
        at = section.at(np.array([shadow])).points[0]
        waves.append(SectionWave(marched, shadow, sense, complex(np.exp(1j * wavenumber * (at @ direction)))))
    return waves


def region_errors(
    section: Section,
    wavenumber: float,
    angle: float,
    boundary: str,
    exact: SectionField,
    admittance: Admittance | None = None,
) -> dict[str, tuple[float, float, float]]:
    """Errors by region, per cent: median and 95 % of |error| over the sum of |waves|, largest over the largest wave.

    "covered" is the share, per cent, of the places behind the starts whose error is within that stated.
    """
    waves = section_waves(section, wavenumber, angle, boundary, admittance=admittance)
    places, s = exact.nodes.places, exact.nodes.s
    direction = np.array([np.cos(angle), np.sin(angle)])
    total, size, stated = np.zeros(len(s), complex), np.zeros(len(s)), np.zeros(len(s))
    served, lit = np.zeros(len(s), bool), np.zeros(len(s), bool)
    region = np.full(len(s), -1)
    found = []
    for wave in waves:
        end = float(wave.marched.s[0, -1])
        along = wave.along(s, section)
        along = np.where(along > end, along - section.length, along)
        here = (along > 0.85 * wave.marched.start[0]) & (along < end)
        value = np.where(here, wave.values(np.where(here, along, 0.0)), 0)
        total, size = total + value, size + np.abs(value)
        mine = np.interp(along, wave.marched.s[0], wave.marched.error[0])
        stated = np.hypot(stated, np.where(along > wave.marched.start[0], mine, 0))
        served |= here
        lit |= here & (along <= 0)
        found.append((wave, along, here, value))
    for wave, along, here, value in found:
        mine = here & (np.abs(value) > 0.5 * size)
        region[mine] = _regions(section, wave, wavenumber, along[mine])
    bright = places.normals @ direction < 0
    region[~served | (bright & ~lit & (region < 3))] = -1
    error, most = np.abs(total - exact.values), np.max(np.abs(exact.values))
    dark = served & (~bright | lit)
    within = 100 * float(np.mean(error[dark] <= stated[dark]))
    rows: dict[str, tuple[float, float, float]] = {"covered": (within, within, within)}
    for number, name in enumerate(REGIONS):
        q = region == number
        if np.sum(q) >= 3:
            share = error[q] / size[q]
            found_here = (np.median(share), np.percentile(share, 95), np.max(error[q]) / most)
            rows[name] = (100 * float(found_here[0]), 100 * float(found_here[1]), 100 * float(found_here[2]))
    return rows


def _regions(section: Section, wave: SectionWave, k: float, along: FloatArray) -> IntArray:
    """Number of the region in `REGIONS` at lengths along a wave's way."""
    grid = np.linspace(0, float(wave.marched.s[0, -1]), 4000)
    kappa = section.at(wave.shadow + wave.sense * grid).curvature
    rate = np.maximum(0.5 * (kappa[1:] + kappa[:-1]), 0) ** (2 / 3)
    parameter = np.concatenate([[0], np.cumsum(rate * np.diff(grid))]) * (k / 2) ** (1 / 3)
    dips = grid[kappa < 0]
    dip = dips[0] if len(dips) else np.inf
    first = max(float(kappa[0]), float(section.at(np.array([wave.shadow - wave.sense * 1e-6])).curvature[0]))
    turned = (k / 2) ** (1 / 3) * first ** (2 / 3) * along
    here = section.at(wave.shadow + wave.sense * along).curvature
    dark = np.where(along > dip, 4, np.where(np.interp(along, grid, parameter) < 1, 1, 2))
    return np.where(along < 0, np.where(turned < -1, 0, 1), np.where(here < 0, 3, dark))


def whole_currents(
    section: Section, wavenumber: float, angle: float, boundary: str, exact: SectionField
) -> ComplexArray:
    """Currents of the whole section at the nodes of an exact field: both waves, and optics between their starts."""
    k, places, s = wavenumber, exact.nodes.places, exact.nodes.s
    direction = np.array([np.cos(angle), np.sin(angle)])
    waves = section_waves(section, k, angle, boundary, ROUND)
    length, end = section.length, ROUND * section.length
    total, cover = np.zeros(len(s), complex), np.zeros(len(s))
    for wave in waves:
        start = float(wave.marched.start[0])
        for turn in (-1, 0, 1):
            along = wave.along(s, section) + turn * length
            fade = _ramp(along, BLEND[0] * start, BLEND[1] * start) * (1 - _ramp(along, 0.93 * end, 0.999 * end))
            some = fade > 0
            total[some] += fade[some] * wave.values(along[some])
            cover += fade * (along <= 0)
    c = np.maximum(-(places.normals @ direction), 1e-3)
    z = 1j * places.curvature / (2 * k * c**3)
    incident = np.exp(1j * k * places.points @ direction)
    optics = -2j * k * c * incident * (1 + z) if boundary == "soft" else 2 * incident * (1 - z)
    front = _between(section, waves, s) & (places.normals @ direction < 0)
    return total + np.where(front, np.clip(1 - cover, 0, 1) * optics, 0)


def _between(section: Section, waves: list[SectionWave], s: FloatArray) -> BoolArray:
    """Whether places lie in front, between both starts: elsewhere 1/c^3 of optics has no bound."""
    first, second = waves
    length = section.length
    ends = [BLEND[1] * float(wave.marched.start[0]) for wave in waves]
    back = first.along(s, section) - length
    other = np.mod(first.sense * (second.shadow + second.sense * ends[1] - first.shadow), length) - length
    return np.asarray((back < ends[0]) & (back > other))


def _ramp(x: FloatArray, low: float, high: float) -> FloatArray:
    """0 below, 1 above, and a quintic between."""
    t = np.clip((x - low) / (high - low), 0, 1)
    return np.asarray(t**3 * (10 - 15 * t + 6 * t**2))


def far_errors(
    section: Section, wavenumber: float, angle: float, boundary: str, exact: SectionField
) -> tuple[float, float]:
    """Far field's error, per cent: largest over the largest |F|, and median of relative ones in the back half."""
    turn = np.radians(np.arange(0, 360, 0.5))
    looks = np.stack([np.cos(turn + angle), np.sin(turn + angle)], axis=-1)
    currents = whole_currents(section, wavenumber, angle, boundary, exact)
    found, true = exact.far(looks, currents), exact.far(looks)
    error = np.abs(found - true)
    back = np.cos(turn) < 0
    return 100 * float(np.max(error) / np.max(np.abs(true))), 100 * float(np.median((error / np.abs(true))[back]))
