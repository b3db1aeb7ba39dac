"""Does the stated error of the far field cover the true one? Currents and rays against references, body by body.

Random incidences, 500 random directions and 100 about the forward lobe for each; each of a conductor's four amplitudes
counts as a direction. What the reference leaves on the body, as a share of the rms field, counts for nobody. Columns:

    ext       rms of what currents leave of the wave inside the body, per cent of it
    true      rms error of the far field over all directions, per cent of its rms
    cover     share of directions in which the true error is within the stated one, per cent; in brackets forward
    ratio     stated over true error, median
    off       directions in which currents err by more than 3 % of the largest |f|, per cent; in brackets isolated rays
    silent    of those of currents neither flagged nor covered, per cent
    false     directions flagged where the error is below 1 %, per cent
    residual  of the reference, the largest, per cent of the incident wave

Run ``python -m studies.field_coverage`` (half an hour), ``--quick`` for the lowest wavenumber alone.
"""

import sys
from collections.abc import Callable
from functools import cache, lru_cache

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, ComplexArray, FloatArray
from creeping.errors import SingularIncidenceError
from creeping.field.body_currents import cached_currents
from creeping.rays.fan import RayFan
from tests.reference import clouds, dipoles, fundamental, sphere

WAVENUMBERS = (8.0, 14.0, 24.0)
BOUNDARIES: tuple[Any, ...] = ("soft", "hard", 0.7, "pec")
INCIDENCES = 3
OFF, ALARM = 0.03, 0.01


def _two_balls(gap: float) -> tuple[str, Callable[[FloatArray], FloatArray], Callable[[FloatArray], FloatArray]]:
    """Smooth union of two balls with centres on x at plus and minus ``gap``: as an expression, F and grad F."""
    centres = np.array([[gap, 0, 0], [-gap, 0, 0]])

    def weights(x: FloatArray) -> FloatArray:
        return np.asarray(np.exp(-8 * (np.sum((x[..., None, :] - centres) ** 2, axis=-1) - 0.36)))

    def level(x: FloatArray) -> FloatArray:
        return np.asarray(-np.log(weights(x).sum(axis=-1)) / 8)

    def gradient(x: FloatArray) -> FloatArray:
        w = weights(x)
        return np.asarray(np.sum(w[..., None] * 2 * (x[..., None, :] - centres), axis=-2) / w.sum(axis=-1)[..., None])

    text = "+".join(f"exp(-8*((x-{c})**2+y**2+z**2-0.36))" for c in (gap, -gap))
    return f"-log({text})/8", level, gradient


def _egg_level(x: FloatArray) -> FloatArray:
    return np.asarray(np.sum(x**2, axis=-1) + 0.35 * x[..., 2] * (x[..., 0] ** 2 + x[..., 1] ** 2) - 1)


def _egg_gradient(x: FloatArray) -> FloatArray:
    grow = 2 + 0.7 * x[..., 2]
    up = 2 * x[..., 2] + 0.35 * (x[..., 0] ** 2 + x[..., 1] ** 2)
    return np.stack([grow * x[..., 0], grow * x[..., 1], up], axis=-1)


@cache
def bodies() -> dict[str, tuple[Any, clouds.Spread, float]]:
    """Body, the same for the reference, and the depth of the reference's sources, L."""
    peanut, level, gradient = _two_balls(0.5)
    return {
        "sphere": (sc.Ellipsoid(1, 1, 1), clouds.ellipsoid(1, 1, 1), 0.2),
        "triaxial": (sc.Ellipsoid(1, 0.8, 0.6), clouds.ellipsoid(1, 0.8, 0.6), 0.12),
        "slender": (sc.Ellipsoid(0.5, 0.5, 1.1), clouds.ellipsoid(0.5, 0.5, 1.1), 0.1),
        "flat": (sc.Ellipsoid(1, 1, 0.6), clouds.ellipsoid(1, 1, 0.6), 0.12),
        "egg": (
            sc.Implicit("x**2 + y**2 + z**2 + 0.35*z*(x**2 + y**2) - 1", bounds=[[-1.3] * 3, [1.3] * 3]),
            clouds.star(_egg_level, _egg_gradient, (0, 1)),
            0.12,
        ),
        "twisted": (sc.TwistedEllipsoid(), clouds.twisted_ellipsoid(), 0.12),
        "peanut": (sc.Implicit(peanut), clouds.star(level, gradient, (0, 1, 2)), 0.3),
        "torus": (sc.Torus(), clouds.Torus(1.0, 0.5), 0.12),
    }


DIPOLE_DEPTHS = {
    "triaxial": 0.2,
    "slender": 0.15,
    "flat": 0.2,
    "egg": 0.2,
    "twisted": 0.12,
    "peanut": 0.3,
    "torus": 0.2,
}
"""Depths of a conductor's dipoles, L."""


def exact_fields(
    name: str, k: float, boundary: Any, incidences: FloatArray, r: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Far fields (d, m), of a conductor (d, m, 2, 2), by a body's reference, and residuals (d,), shares of the wave.

    ``r`` (d, m, 3) are the directions of each incidence.
    """
    if name == "sphere":
        ball = conducting_ball if boundary == "pec" else _scalar_ball
        return np.stack([ball(k, d, s, boundary) for d, s in zip(incidences, r, strict=True)]), np.zeros(len(r))
    _, body, depth = bodies()[name]
    solution: Any
    if boundary == "pec":
        dense = 7.0 if k < 20 else 5.0
        solution = dipoles.scatter(body, k, incidences, depth=DIPOLE_DEPTHS[name], per_wavelength=dense)
    else:
        dense = 8.0 if k < 20 else 6.0
        solution = fundamental.scatter(body, k, incidences, boundary, depth=depth, per_wavelength=dense)
    fields = np.stack([solution.far_field(s)[:, i] for i, s in enumerate(r)])
    return fields, solution.residual.reshape(len(r), -1).max(axis=1)


def _scalar_ball(k: float, d: FloatArray, r: FloatArray, boundary: Any) -> ComplexArray:
    return sphere.far_field(k, 1.0, r @ d, boundary)


def conducting_ball(k: float, d: FloatArray, r: FloatArray, boundary: Any = "pec") -> ComplexArray:
    """Far field of the unit ball, theta and phi scattered by theta and phi incident: (3,), (m, 3) -> (m, 2, 2)."""
    across = np.cross(r, d)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    before, after = dipoles.frames(d[None])[0], dipoles.frames(r)
    total = np.zeros((len(r), 2, 2), dtype=complex)
    # across and in the plane of scattering, as `tests.reference.sphere` has them
    for amplitude, e, s in zip(
        sphere.pec_far_field(k, 1.0, r @ d),
        (across, np.cross(across, d)),
        (across, np.cross(across, r)),
        strict=True,
    ):
        total += amplitude[:, None, None] * np.einsum("moc,mc->mo", after, s)[:, :, None] * (e @ before.T)[:, None]
    return total


def row(name: str, k: float, boundary: Any, seed: int) -> list[FloatArray]:
    """The columns of the head for each incidence, cover ahead and off by rays as columns of their own."""
    rng = np.random.default_rng(seed)
    drawn = []
    for _ in range(INCIDENCES):
        d, r = _random(rng, 1)[0], _random(rng, 500)
        ahead = d + 2 / k * rng.normal(size=(100, 3))
        drawn.append((d, np.concatenate([r, ahead / np.linalg.norm(ahead, axis=1, keepdims=True)])))
    incidences, observers = (np.stack(each) for each in zip(*drawn, strict=True))
    exact, residual = exact_fields(name, k, boundary, incidences, observers)
    found = (_columns(name, k, boundary, *one) for one in zip(incidences, observers, exact, residual, strict=True))
    return [columns for columns in found if columns is not None]


@lru_cache(INCIDENCES * len(WAVENUMBERS))
def _fan(name: str, d: tuple[float, float, float]) -> RayFan:
    """Fan of an incidence, the same for every boundary: it keeps where its rays leave towards the observers."""
    body = bodies()[name][0]
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction=d), length=4.0, n_rays=128)


def _columns(
    name: str, k: float, boundary: Any, d: FloatArray, r: FloatArray, exact: ComplexArray, residual: float
) -> FloatArray | None:
    """The columns of `row` for one incidence; None where it is singular."""
    kind: Any = boundary if isinstance(boundary, str) else cr.ImpedanceBoundary(boundary)
    try:
        fan = _fan(name, tuple(d))
    except SingularIncidenceError:
        return None
    far = cr.far_field(fan, r, wavenumber=k, boundary=kind, method="currents")
    rays = cr.far_field(fan, r, wavenumber=k, boundary=kind, method="rays").total
    off, largest = np.abs(far.total - exact), np.abs(exact).max()
    flagged = far.unresolved.reshape(-1, *[1] * (off.ndim - 1))
    covered = off <= far.error + residual * _rms(exact)
    bad = off > OFF * largest
    return np.array(
        [
            100 * cached_currents(fan, k, kind).extinction,
            100 * _rms(off[:500]) / _rms(exact[:500]),
            100 * np.mean(covered[:500]),
            100 * np.mean(covered[500:]),
            np.median(far.error / off),
            100 * np.mean(bad),
            100 * np.mean(np.abs(rays - exact) > OFF * largest),
            100 * np.mean(bad & ~covered & ~flagged),
            100 * np.mean(flagged & (off < ALARM * largest)),
            100 * residual,
        ]
    )


def _random(rng: np.random.Generator, count: int) -> FloatArray:
    r = rng.normal(size=(count, 3))
    return np.asarray(r / np.linalg.norm(r, axis=1, keepdims=True))


def _rms(values: ComplexArray | FloatArray) -> float:
    return float(np.sqrt(np.mean(np.abs(values) ** 2)))


def main(arguments: list[str] | None = None) -> None:
    """Print the table."""
    given = sys.argv[1:] if arguments is None else arguments
    wavenumbers = WAVENUMBERS[:1] if "--quick" in given else WAVENUMBERS
    print("body      boundary   k    ext   true  cover (ahead)  ratio   off (rays)  silent  false  residual")
    every: dict[Any, list[FloatArray]] = {boundary: [] for boundary in BOUNDARIES}
    for number, name in enumerate(bodies()):
        for boundary in BOUNDARIES:
            for k in wavenumbers:
                rows = np.array(row(name, k, boundary, 100 * number + int(k)))
                every[boundary].append(rows)
                ext, true, cover, ahead, ratio, off, rays, silent, false, residual = rows.mean(axis=0)
                print(
                    f"{name:9} {boundary!s:8} {k:4g} {ext:6.2f} {true:6.2f} {cover:5.1f} ({ahead:5.1f}) {ratio:5.1f}  "
                    f"{off:5.2f} ({rays:5.1f})   {silent:5.2f}  {false:5.2f}  {residual:.2g}",
                    flush=True,
                )
    for boundary, found in every.items():
        print(f"{boundary}: {_summary(np.concatenate(found))}")
    print(f"all: {_summary(np.concatenate([rows for found in every.values() for rows in found]))}")


def _summary(rows: FloatArray) -> str:
    """What rows of columns (n, 10) say together."""
    within = rows[:, 1] / rows[:, 0]
    shares = " and ".join(
        f"{100 * np.mean((within < factor) & (within > 1 / factor)):.0f} % within {factor:g}" for factor in (1.4, 2)
    )
    cover, ahead, ratio, off, rays, silent, false = rows[:, 2:9].mean(axis=0)
    return (
        f"true/ext from {within.min():.2f} to {within.max():.2f}, {shares}, of {len(rows)}; cover {cover:.1f}, least "
        f"{rows[:, 2].min():.1f}, ahead {ahead:.1f}, least {rows[:, 3].min():.1f}; ratio {np.median(rows[:, 4]):.1f} "
        f"({ratio:.1f} in the mean); off {off:.2f} (rays {rays:.1f}), silent {silent:.2f}, false {false:.2f} %"
    )


if __name__ == "__main__":
    main()
