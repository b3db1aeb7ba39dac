"""Does the stated error of the far field cover the true one? Currents and rays against references, body by body.

Random incidences, 500 random directions and 100 about the forward lobe for each. Columns:

    ext       rms of what currents leave of the wave inside the body, per cent of it
    true      rms error of the far field over all directions, per cent of its rms
    cover     share of directions in which the true error is within the stated one, per cent; in brackets forward
    ratio     stated over true error, median
    off       directions in which currents err by more than 3 % of the largest |f|, per cent; in brackets isolated rays
    silent    of those of currents neither flagged nor covered, per cent
    false     directions flagged where the error is below 1 %, per cent

Run ``python -m studies.field_coverage`` (six minutes), ``--quick`` for the lowest wavenumber alone.
"""

import sys
from collections.abc import Callable
from functools import cache

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, ComplexArray, FloatArray
from creeping.errors import SingularIncidenceError
from creeping.field.currents.assembly import surface_currents
from studies.reference import clouds, fundamental, sphere

WAVENUMBERS = (8.0, 14.0, 24.0)
BOUNDARIES: tuple[Any, ...] = ("soft", "hard", 0.7)
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
def bodies() -> dict[str, tuple[Any, clouds.Body, float]]:
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
        "peanut": (sc.Implicit(peanut), clouds.star(level, gradient, (0, 1, 2)), 0.12),
    }


def exact_fields(
    name: str, k: float, boundary: Any, incidences: FloatArray, r: FloatArray
) -> tuple[ComplexArray, FloatArray]:
    """Far fields (m, d) of a body by its reference, and residuals (d,), shares of the incident wave."""
    if name == "sphere":
        fields = [sphere.far_field(k, 1.0, r @ d, boundary) for d in incidences]
        return np.stack(fields, axis=1), np.zeros(len(incidences))
    _, body, depth = bodies()[name]
    solution = fundamental.scatter(body, k, incidences, boundary, depth=depth, per_wavelength=8.0 if k < 20 else 6.0)
    return solution.far_field(r), solution.residual


def row(name: str, k: float, boundary: Any, seed: int) -> list[FloatArray]:
    """The columns of the head for each incidence: ext, true, cover, forward, ratio, off, rays, silent, false."""
    rng = np.random.default_rng(seed)
    body = bodies()[name][0]
    kind: Any = boundary if isinstance(boundary, str) else cr.ImpedanceBoundary(boundary)
    found = []
    for _ in range(INCIDENCES):
        d, r = _random(rng, 1)[0], _random(rng, 500)
        ahead = d + 2 / k * rng.normal(size=(100, 3))
        r = np.concatenate([r, ahead / np.linalg.norm(ahead, axis=1, keepdims=True)])
        exact, residual = exact_fields(name, k, boundary, d[None], r)
        try:
            line = cr.shadow_line(body, direction=d)
        except SingularIncidenceError:
            continue
        fan = cr.launch(cr.DirectFlow(body), line, length=4.0, n_rays=128)
        currents = surface_currents(fan, wavenumber=k, boundary=kind)
        far = cr.far_field(fan, r, wavenumber=k, boundary=kind, method="currents")
        rays = cr.far_field(fan, r, wavenumber=k, boundary=kind, method="rays").total
        ex = exact[:, 0]
        off, largest = np.abs(far.total - ex), np.abs(ex).max()
        covered = off <= far.error + residual[0] * _rms(ex)
        bad = off > OFF * largest
        found.append(
            np.array(
                [
                    100 * currents.extinction,
                    100 * _rms(off[:500]) / _rms(ex[:500]),
                    100 * np.mean(covered[:500]),
                    100 * np.mean(covered[500:]),
                    np.median(far.error / off),
                    100 * np.mean(bad),
                    100 * np.mean(np.abs(rays - ex) > OFF * largest),
                    100 * np.mean(bad & ~covered & ~far.unresolved),
                    100 * np.mean(far.unresolved & (off < ALARM * largest)),
                ]
            )
        )
    return found


def _random(rng: np.random.Generator, count: int) -> FloatArray:
    r = rng.normal(size=(count, 3))
    return np.asarray(r / np.linalg.norm(r, axis=1, keepdims=True))


def _rms(values: ComplexArray | FloatArray) -> float:
    return float(np.sqrt(np.mean(np.abs(values) ** 2)))


def main(arguments: list[str] | None = None) -> None:
    """Print the table."""
    given = sys.argv[1:] if arguments is None else arguments
    wavenumbers = WAVENUMBERS[:1] if "--quick" in given else WAVENUMBERS
    print("body      boundary   k    ext   true  cover (ahead)  ratio   off (rays)  silent  false")
    every = []
    for number, name in enumerate(bodies()):
        for boundary in BOUNDARIES:
            for k in wavenumbers:
                rows = np.array(row(name, k, boundary, 100 * number + int(k)))
                every.append(rows)
                ext, true, cover, ahead, ratio, off, rays, silent, false = rows.mean(axis=0)
                print(
                    f"{name:9} {boundary!s:8} {k:4g} {ext:6.2f} {true:6.2f} {cover:5.1f} ({ahead:5.1f}) {ratio:5.1f}  "
                    f"{off:5.2f} ({rays:5.1f})   {silent:5.2f}  {false:5.2f}",
                    flush=True,
                )
    whole = np.concatenate(every)
    within = whole[:, 1] / whole[:, 0]
    print(
        f"all: true/ext from {within.min():.2f} to {within.max():.2f}, "
        f"{100 * np.mean((within < 1.4) & (within > 1 / 1.4)):.0f} % of {len(within)} within 1.4; "
        f"cover {whole[:, 2].mean():.1f}, silent {whole[:, 7].mean():.2f} %, false {whole[:, 8].mean():.2f} %"
    )


if __name__ == "__main__":
    main()
