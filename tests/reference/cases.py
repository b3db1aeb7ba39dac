"""The exact fields that `tests.reference.stored` keeps: bodies, waves and points of each, and how they are solved."""

import numpy as np

from tests.reference import antennas, dipoles, fundamental, hard_ports
from tests.reference.clouds import Body, ellipsoid, star
from tests.reference.conditions import Arrays, Boundary, FloatArray
from tests.reference.generatrix import pieces_profile
from tests.reference.mirrored_box import scatter_box
from tests.reference.modal_conductor import scatter_conductor
from tests.reference.modal_equation import scatter_by_modes
from tests.reference.revolution import Profile, wave_directions
from tests.reference.two_spheres import Kind, scatter_spheres

HEIGHTS = (0.05, 0.08, 0.11, 0.14)
"""Of sources above their ports, L."""
LOW_HEIGHTS = (0.03, 0.05, 0.07, 0.09, 0.12)
"""The same of monopoles, L."""
ADMITTANCE = 0.5 + 0.2j
"""Of the edged cylinder."""
LOBE = 0.25
"""Angle off the forward direction within which a few directions are, radians: half the lobe of k a = 10."""


def ellipsoid_slots() -> Arrays:
    """Slots along two tangents at a port of the ellipsoid (0.75, 0.9, 1.15), k = 12, at points all about it."""
    rng = np.random.default_rng(1)
    sources, points = rng.normal(size=(1, 3)), rng.normal(size=(60, 3))
    sources, points = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (sources, points))
    # off the planes of symmetry, where the dipoles would meet their images
    sources = np.sign(sources) * np.maximum(np.abs(sources), 0.3)
    sources /= np.linalg.norm(sources, axis=1, keepdims=True)
    points = points[np.max(points @ sources.T, axis=1) < 0.95]
    found = antennas.coupled_slots(ellipsoid(0.75, 0.9, 1.15), 12.0, sources, points, depth=0.25, heights=HEIGHTS)
    return {"ports": found.ports, "points": found.points, "tangents": found.tangents, "values": found.values}


def _capsule(radius: float, half: float) -> Body:
    """A capsule along z, its cylinder from -half to half: where rays from its middle leave it."""

    def to_body(X: FloatArray) -> FloatArray:
        across, z = np.hypot(X[..., 0], X[..., 1]), np.abs(X[..., 2])
        side = radius / np.maximum(across, 1e-12)
        end = half * z + np.sqrt(np.maximum(radius**2 - (half * across) ** 2, 0))
        return np.asarray(np.where(side * z > half, end, side)[..., None] * X)

    def gradient(x: FloatArray) -> FloatArray:
        return np.asarray(x - np.clip(x, -half, half) * [0, 0, 1])

    return Body(to_body, gradient, (0, 1, 2))


def capsule_echoes() -> Arrays:
    """Backscatter, L, of the capsule of radius 0.4 and length 1.8, k = 20, by elevation above broadside, degrees."""
    elevation = np.array([0.0, 15.0, 25.0, 45.0, 80.0])
    e, body = np.radians(elevation), _capsule(0.4, 0.5)
    r = np.stack([np.cos(e), 0 * e, np.sin(e)], axis=1)
    soft = fundamental.scatter(body, 20.0, -r, "soft", depth=0.1).far_field(r)
    pec = dipoles.scatter(body, 20.0, -r, depth=0.1).far_field(r)
    return {"elevation": elevation} | {
        name: np.stack([values[i, i] for i in range(len(r))]) for name, values in (("soft", soft), ("pec", pec))
    }


def ellipsoid_ports() -> Arrays:
    """Fields of three sources on the rigid ellipsoid (0.8, 0.9, 1.1), k = 14, at points all about it."""
    rng = np.random.default_rng(7)
    sources, points = rng.normal(size=(3, 3)), rng.normal(size=(60, 3))
    sources, points = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in (sources, points))
    # off the planes of symmetry, where the local solutions would meet their images
    sources = np.sign(sources) * np.maximum(np.abs(sources), 0.25)
    sources /= np.linalg.norm(sources, axis=1, keepdims=True)
    body = ellipsoid(0.8, 0.9, 1.1)
    found = hard_ports.coupled(body, 14.0, sources, points, depth=0.25, heights=HEIGHTS, per_wavelength=7.0)
    return {"ports": found.ports, "points": found.points, "values": found.values, "spread": found.spread}


def ellipsoid_monopoles() -> Arrays:
    """E of a monopole on the conductor (0.75, 0.9, 1.15), k = 12, at points all about it."""
    body, sources, points = _about_a_monopole(60)
    found = antennas.coupled_monopoles(body, 12.0, sources, points, depth=0.25, heights=LOW_HEIGHTS)
    return {"ports": found.ports, "points": found.points, "values": found.values, "spread": found.spread}


def ellipsoid_antennas() -> Arrays:
    """H of the same monopole along two tangents of each point."""
    body, sources, points = _about_a_monopole(80)
    found = antennas.slots_of_monopoles(body, 12.0, sources, points, depth=0.25, heights=LOW_HEIGHTS)
    return {name: getattr(found, name) for name in ("ports", "points", "tangents", "values", "spread")}


def _about_a_monopole(count: int) -> tuple[Body, FloatArray, FloatArray]:
    """The conductor, the direction of the foot, and those of so many points drawn that are not next to it."""
    points = np.random.default_rng(7).normal(size=(count, 3))
    sources = np.array([[0.45, 0.6, -np.sqrt(1 - 0.45**2 - 0.6**2)]])
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return ellipsoid(0.75, 0.9, 1.15), sources, points[np.max(points @ sources.T, axis=1) < 0.9]


def ellipsoid_caustic() -> Arrays:
    """The dark side of the ellipsoid (0.9, 0.7, 1), k = 16: u where it is hard, du/dn where it is soft."""
    body, d = ellipsoid(0.9, 0.7, 1.0), np.array([0.5, 0.4, 0.77])
    d /= np.linalg.norm(d)
    cloud = body.spread(0.13)
    dark = cloud.normals @ d > 0.25
    points, normals = cloud.points[dark], cloud.normals[dark]
    hard, soft = (fundamental.scatter(body, 16.0, d[None], kind, depth=0.14) for kind in ("hard", "soft"))
    return {
        "direction": d,
        "points": points,
        "hard": hard.total(points)[:, 0],
        "soft": soft.normal_derivative(points, normals)[:, 0],
    }


def peanut_shadow() -> Arrays:
    """Points all over the hard peanut, met almost along its axis, k = 20."""

    def level(x: FloatArray) -> FloatArray:
        return np.asarray((np.sum(x**2, axis=-1) + 0.64) ** 2 - 2.56 * x[..., 0] ** 2 - 0.9**4)

    def gradient(x: FloatArray) -> FloatArray:
        grow = 4 * (np.sum(x**2, axis=-1) + 0.64)[..., None] * x
        return np.asarray(grow - 5.12 * x * np.array([1.0, 0.0, 0.0]))

    body, d = star(level, gradient, (0, 1, 2)), np.array([1, 0.05, 0.02])
    d /= np.linalg.norm(d)
    away = np.random.default_rng(0).normal(size=(300, 3)) * [1.2, 0.5, 0.5]
    points = body.map(away / np.linalg.norm(away, axis=1, keepdims=True))
    u = fundamental.scatter(body, 20.0, d[None], "hard", depth=0.12, per_wavelength=6.0)
    return {"points": points, "values": u.total(points)[:, 0]}


def spheroid_ahead() -> Arrays:
    """Hard far field straight ahead of the spheroid (0.6, 0.6, 1.2) met along its axis."""
    wavenumbers, ahead = np.array([10.0, 20.0]), np.array([[0.0, 0.0, 1.0]])
    body = ellipsoid(0.6, 0.6, 1.2)
    each = [fundamental.scatter(body, k, ahead, "hard", depth=0.12).far_field(ahead)[0, 0] for k in wavenumbers]
    return {"wavenumbers": wavenumbers, "values": np.array(each)}


def ellipsoid_impedance() -> Arrays:
    """Far field of the ellipsoid (1, 0.8, 0.6) of admittance 0.7, k = 20."""
    r = np.random.default_rng(20260301).normal(size=(200, 3))
    r /= np.linalg.norm(r, axis=1, keepdims=True)
    d = np.array([0.6, 0.3, 0.74]) / np.linalg.norm([0.6, 0.3, 0.74])
    found = fundamental.scatter(ellipsoid(1.0, 0.8, 0.6), 20.0, d[None], 0.7, depth=0.12)
    return {"direction": d, "directions": r, "values": found.far_field(r)[:, 0]}


def ellipsoid_equation() -> Arrays:
    """Far, on and near the ellipsoid (0.9, 0.55, 0.7), k = 10, hard and soft (du/dn on the body)."""
    k, axes, rng = 10.0, np.array([0.9, 0.55, 0.7]), np.random.default_rng(20260301)
    r, x = rng.normal(size=(2, 80, 3))
    r /= np.linalg.norm(r, axis=1, keepdims=True)
    x /= np.linalg.norm(x / axes, axis=1, keepdims=True)
    n = x / axes**2
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    y = x + rng.uniform(0.3, 3.0, 80)[:, None] * 2 * np.pi / k * n
    d, found = np.array([0.3, -0.5, 0.8]), {"far": r, "on": x, "near": y}
    d /= np.linalg.norm(d)
    for kind in ("hard", "soft"):
        u = fundamental.scatter(ellipsoid(*axes), k, d[None], kind, depth=0.13, per_wavelength=7.0)
        on = u.normal_derivative(x, n) if kind == "soft" else u.total(x)
        found |= {f"{kind} far": u.far_field(r)[:, 0], f"{kind} on": on[:, 0], f"{kind} near": u.total(y)[:, 0]}
    return found


def ellipsoid_echoes() -> Arrays:
    """Far fields of the conductor (1, 0.7, 0.5) near backscatter, k = 20: of four waves three directions each."""
    d = np.random.default_rng(11).normal(size=(4, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    aside = np.cross(d, np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8]))
    r = -d[:, None] + np.array([0.0, 0.1, 0.25])[:, None] * aside[:, None]
    r /= np.linalg.norm(r, axis=2, keepdims=True)
    found = dipoles.scatter(ellipsoid(1.0, 0.7, 0.5), 20.0, d, depth=0.15)
    values = np.array([found.far_field(row)[:, number] for number, row in enumerate(r)])
    return {"incident": d, "directions": r, "values": values}


def edged_cylinder() -> Arrays:
    """Far fields, L, of the cylinder of radius 1 and height 2, at 30 and 90 degrees to its axis, k = 10."""
    profile = pieces_profile([(0.0, 1.0), (1.0, 1.0), (1.0, -1.0), (0.0, -1.0)])
    kinds: dict[str, Boundary | None] = {"hard": "hard", "soft": "soft", "impedance": ADMITTANCE, "pec": None}
    return _edged(profile, np.radians([30.0, 90.0]), kinds)


def edged_cone() -> Arrays:
    """Far fields of the cone of radius 1 and height 2, its base at z = 0, at 50 degrees to its axis, k = 10."""
    profile = pieces_profile([(0.0, 2.0), (1.0, 0.0), (0.0, 0.0)])
    return _edged(profile, np.radians([50.0]), {"hard": "hard", "soft": "soft", "pec": None})


def edged_ogive() -> Arrays:
    """Far field of the hard ogive of radius 0.5 and length 3, end on, k = 10."""
    radius, half = 0.5, 1.5
    middle = 0.5 * (radius**2 - half**2) / radius
    return _edged(pieces_profile([(0.0, half), (0.0, -half)], {0: (middle, 0.0)}), np.zeros(1), {"hard": "hard"})


def edged_half_ball() -> Arrays:
    """Far fields of the upper half of the unit ball, its flat face at z = 0, at 60 degrees to its axis, k = 10."""
    profile = pieces_profile([(0.0, 1.0), (1.0, 0.0), (0.0, 0.0)], {0: (0.0, 0.0)})
    return _edged(profile, np.radians([60.0]), {"soft": "soft", "pec": None})


def edged_cube() -> Arrays:
    """Far fields of the cube of side 2, met at an odd angle, k = 5."""
    d = np.array([[0.3, 0.5, -0.81]]) / np.linalg.norm([0.3, 0.5, -0.81])
    r = _about(d)
    kinds: tuple[Boundary, ...] = ("hard", "soft")
    far = {str(kind): scatter_box((1, 1, 1), 5.0, d, kind).far_field(r) for kind in kinds}
    return {"incident": d, "directions": r} | far


def two_spheres() -> Arrays:
    """Far fields of spheres of radii 1 and 0.7, a wavelength apart, the origin halfway, k = 6."""
    k, axis, d = 6.0, np.array([0.48, 0.6, 0.64]), np.array([[0.5, -0.3, 0.7]])
    d /= np.linalg.norm(d)
    r = _about(d)
    kinds: tuple[Kind, ...] = ("hard", "soft", "pec")
    centres = np.stack([-(1.0 + np.pi / k) * axis, (0.7 + np.pi / k) * axis])
    far = {str(kind): scatter_spheres(centres, (1.0, 0.7), k, d, kind).far_field(r) for kind in kinds}
    return {"incident": d, "directions": r} | far


def _edged(profile: Profile, polar: FloatArray, kinds: dict[str, Boundary | None]) -> Arrays:
    """Far fields of a body of revolution by the names of its boundaries: (m, d), of a conductor (m, d, 2, 2)."""
    d = wave_directions(polar)
    r, k = _about(d), 10.0
    found: Arrays = {"incident": d, "directions": r}
    for name, kind in kinds.items():
        if kind is None:
            found[name] = scatter_conductor(profile, k, polar, cuts=7).far_field(r)
        else:
            found[name] = scatter_by_modes(profile, k, polar, kind, cuts=7).far_field(r)
    return found


def _about(d: FloatArray) -> FloatArray:
    """Sixty directions all about, straight ahead of each incidence among them, four within `LOBE` of it: (60, 3)."""
    rng = np.random.default_rng(20261126)
    ahead = d[:, None] + LOBE / np.sqrt(3) * rng.uniform(-1, 1, (len(d), 5, 3)) * (np.arange(5) > 0)[:, None]
    r = np.concatenate([ahead.reshape(-1, 3), rng.normal(size=(60 - 5 * len(d), 3))])
    return np.asarray(r / np.linalg.norm(r, axis=1, keepdims=True))
