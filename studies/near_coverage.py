"""Do the stated errors of near and surface fields cover the true ones? Against references, body and part by part.

Random incidences; 600 points at heights of 0.03 to 3 over the body, 100 about the axis behind it, 700 on it. For each
part of the points whose status is OK: share in which the true error is within the stated one, per cent, and stated over
true error in the median. Parts:

    lit        off the body, where the incident wave comes; by currents
    close      within a quarter of a wavelength of the body; between currents and the field on it
    shadow     off the body, behind it; by rays or currents, whichever states less
    axis       about the axis behind it, where rays merge
    on lit     on the lit side
    on dark    on the body in the shadow, the penumbra included
    not OK     per cent of the points off the body, and on it

Run ``python -m studies.near_coverage`` (four minutes), ``--quick`` for the sphere at the lowest wavenumber alone.
"""

import sys

import numpy as np

import creeping as cr
from creeping._typing import Any, ComplexArray, FloatArray
from studies._point_coverage import bright, cases, coverage, not_ok, parts_off, places, print_table, random_fan
from studies.field_coverage import bodies
from tests.reference import fundamental, sphere

WAVENUMBERS = (10.0, 20.0, 30.0)
BOUNDARIES: tuple[Any, ...] = ("soft", "hard", 0.7)
BODIES = ("sphere", "triaxial", "slender", "flat", "twisted", "peanut")
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


def row(name: str, k: float, boundary: Any, seed: int) -> dict[str, float]:
    """Coverage, per cent, and ratio of each part, what is not OK, and the median of the true error, per cent."""
    rng = np.random.default_rng(seed)
    kind: Any = boundary if isinstance(boundary, str) else cr.ImpedanceBoundary(boundary)
    fan = random_fan(name, rng)
    points, on, normals, axis = places(name, fan.line.direction, rng)
    exact, there, residual = exact_fields(name, k, boundary, fan.line.direction, points, on, normals)
    near = cr.near_field(fan, points, wavenumber=k, boundary=kind)
    surface = cr.surface_field(fan, on, wavenumber=k, boundary=kind)
    lit = bright(fan, on, normals)
    unit = k if boundary == "soft" else 1.0
    found = not_ok(near, surface)
    for field, truth, scale, masks in (
        (near, exact, 1.0, parts_off(fan, points, axis, near.method == "layer")),
        (surface, there, unit, {"on lit": lit, "on dark": ~lit}),
    ):
        off = np.abs(field - truth)
        for part, mask in masks.items():
            found |= coverage(part, off, field, mask, residual=residual * scale, unit=scale, quantile=0.5)
    return found


def main(arguments: list[str] | None = None) -> None:
    """Print the table."""
    quick = "--quick" in (sys.argv[1:] if arguments is None else arguments)
    head = "body      boundary   k  " + "".join(f"{part + ' (ratio)':>17}" for part in PARTS) + "   not OK off, on"
    rows = (
        (f"{name:9} {boundary!s:8} {k:4g}", row(name, k, boundary, seed))
        for seed, (name, boundary, k) in cases(BODIES, BOUNDARIES, WAVENUMBERS, quick=quick)
    )
    print_table(head, PARTS, rows, lambda found, part: f"{found[part]:8.1f} ({found[f'{part} ratio']:5.1f}) ")


if __name__ == "__main__":
    main()
