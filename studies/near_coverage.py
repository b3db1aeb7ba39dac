"""Do the stated errors of near and surface fields cover the true ones? Against references, body and part by part.

Random incidences; 600 points at heights of 0.03 to 3 over the body, 100 about the axis behind it, 700 on it. For each
part of the points whose status is OK: share in which the true error is within the stated one, per cent, and stated over
true error in the median. Parts:

    lit        off the body, where the incident wave comes; by currents
    close      within a quarter of a wavelength of the body; between currents and the field on it
    shadow     off the body, behind it; by rays or currents, whichever states less
    axis       about the axis behind it, where rays merge
    on lit     on lit ground
    on dark    on the body in the shadow, the penumbra included
    not OK     per cent of the points off the body, and on it

Run ``python -m studies.near_coverage`` (four minutes), ``--quick`` for the sphere at the lowest wavenumber alone.
"""

import sys

import numpy as np

import creeping as cr
from creeping._typing import Any, BoolArray, ComplexArray, FloatArray
from creeping.errors import SingularIncidenceError
from creeping.geometry.quadrature import body_nodes
from creeping.shadow.occlusion import occluded
from studies.field_coverage import bodies
from studies.reference import fundamental, sphere

WAVENUMBERS = (10.0, 20.0, 30.0)
BOUNDARIES: tuple[Any, ...] = ("soft", "hard", 0.7)
BODIES = ("sphere", "triaxial", "slender", "flat", "twisted", "peanut")
HEIGHTS = (0.03, 3.0)
PARTS = ("lit", "close", "shadow", "axis", "on lit", "on dark")


def exact_fields(
    name: str, k: float, boundary: Any, d: FloatArray, points: FloatArray, on: FloatArray, normals: FloatArray
) -> tuple[ComplexArray, ComplexArray, float]:
    """Total field at points off the body, u or du/dn at points on it, and the reference's residual."""
    if name == "sphere":
        surface = sphere.surface_derivative if boundary == "soft" else sphere.surface_field
        return sphere.total_field(k, 1.0, points, d, boundary), surface(k, 1.0, on @ d, boundary), 0.0
    _, body, depth = bodies()[name]
    solution = fundamental.scatter(body, k, d[None], boundary, depth=depth, per_wavelength=8.0 if k < 15 else 6.0)
    there = solution.normal_derivative(on, normals) if boundary == "soft" else solution.total(on)
    return solution.total(points)[:, 0], there[:, 0], float(solution.residual[0])


def places(name: str, d: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Points off the body, points on it with their normals, and which of the first are about the axis."""
    body = bodies()[name][0]
    nodes = body_nodes(body, 20.0)
    pick = rng.choice(len(nodes.points), 700, p=nodes.weights / nodes.weights.sum())
    on, normals = nodes.points[pick], nodes.normals[pick]
    height = np.exp(rng.uniform(np.log(HEIGHTS[0]), np.log(HEIGHTS[1]), 600))
    off = on[:600] + height[:, None] * normals[:600]
    axis = rng.uniform(1.1, 4.0, 100)[:, None] * d + 0.1 * rng.normal(size=(100, 3))
    points = np.concatenate([off, axis])
    outside = body.level(points) > 0
    return points[outside], on, normals, (np.arange(700) >= 600)[outside]


def row(name: str, k: float, boundary: Any, seed: int) -> dict[str, float]:
    """Coverage, per cent, and ratio of each part, what is not OK, and epsilon, per cent."""
    rng = np.random.default_rng(seed)
    body = bodies()[name][0]
    kind: Any = boundary if isinstance(boundary, str) else cr.ImpedanceBoundary(boundary)
    while True:
        d = rng.normal(size=3)
        d /= np.linalg.norm(d)
        try:
            line = cr.shadow_line(body, direction=d)
            break
        except SingularIncidenceError:
            continue
    fan = cr.launch(cr.DirectFlow(body), line, length=4.0, n_rays=128)
    points, on, normals, axis = places(name, d, rng)
    exact, there, residual = exact_fields(name, k, boundary, d, points, on, normals)
    near = cr.near_field(fan, points, wavenumber=k, boundary=kind)
    surface = cr.surface_field(fan, on, wavenumber=k, boundary=kind)
    dark = occluded(body, points, d)
    bright = normals @ d < 0
    bright[bright] = ~occluded(body, on[bright], d)
    found = {"off": 100 * float(np.mean(~near.ok)), "on": 100 * float(np.mean(~surface.ok))}
    close = near.method == "layer"
    parts = {"lit": ~dark & ~close, "close": close, "shadow": dark & ~axis & ~close, "axis": dark & axis & ~close}
    unit = k if boundary == "soft" else 1.0
    for field, truth, scale, masks in (
        (near, exact, 1.0, parts),
        (surface, there, unit, {"on lit": bright, "on dark": ~bright}),
    ):
        off = np.abs(field - truth)
        for part, mask in masks.items():
            at = mask & field.ok
            # the reference's own error counts for nobody
            covered = off[at] <= field.error[at] + residual * scale
            found[part] = 100 * float(np.mean(covered)) if np.any(at) else np.nan
            found[f"{part} ratio"] = float(np.median(field.error[at] / off[at])) if np.any(at) else np.nan
            found[f"{part} error"] = 100 * float(np.median(off[at] / scale)) if np.any(at) else np.nan
    found["rays"] = 100 * float(np.mean((near.method == "rays") & near.ok))
    return found


def main(arguments: list[str] | None = None) -> None:
    """Print the table."""
    given = sys.argv[1:] if arguments is None else arguments
    quick = "--quick" in given
    print("body      boundary   k  " + "".join(f"{part + ' (ratio)':>17}" for part in PARTS) + "   not OK off, on")
    every = []
    for number, name in enumerate(BODIES[:1] if quick else BODIES):
        for boundary in BOUNDARIES:
            for k in WAVENUMBERS[:1] if quick else WAVENUMBERS:
                found = row(name, k, boundary, 100 * number + int(k))
                every.append(found)
                cells = "".join(f"{found[part]:8.1f} ({found[f'{part} ratio']:5.1f}) " for part in PARTS)
                print(f"{name:9} {boundary!s:8} {k:4g} {cells}   {found['off']:5.1f} {found['on']:5.1f}", flush=True)
    for part in PARTS:
        covers, ratios = ([found[f"{part}{what}"] for found in every] for what in ("", " ratio"))
        print(f"{part:8} covered {np.nanmean(covers):.1f} %, least {np.nanmin(covers):.1f}", end="; ")
        print(f"ratio {np.nanmedian(ratios):.1f}")


if __name__ == "__main__":
    main()
