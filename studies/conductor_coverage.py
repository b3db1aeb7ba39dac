"""Do the stated errors of fields near conductors cover the true ones? Against Mie and electric dipoles, part by part.

Random incidences and both polarisations; points as in `studies.near_coverage`. For each part of the points whose status
is OK: share in which the true error is within the stated one, per cent, stated over true error in the median, and the
true error that 95 of 100 points keep to, per cent of the incident wave. Parts:

    lit, close, shadow, axis    E and H off the body, the larger error of the two, as in `studies.near_coverage`
    J lit, J dark               the current on the lit side, and in the shadow, the penumbra included
    charge                      n.E, judged by its own error
    not OK                      per cent of the points off the body, and on it

Factors were set on the first four bodies, at k = 10, 20 and 30; the others have no share in them.

Run ``python -m studies.conductor_coverage`` (ten minutes), ``--quick`` for the sphere at the lowest wavenumber alone.
"""

import sys
from dataclasses import replace

import numpy as np

import creeping as cr
from creeping._typing import Any, ComplexArray, FloatArray
from studies._point_coverage import bright, cases, coverage, not_ok, parts_off, places, print_table, random_fan
from studies.field_coverage import DIPOLE_DEPTHS, bodies
from tests.reference import dipoles, sphere

WAVENUMBERS = (10.0, 20.0)
BODIES = ("sphere", "triaxial", "slender", "flat", "egg", "twisted", "peanut")
PARTS = ("lit", "close", "shadow", "axis", "J lit", "J dark", "charge")


def exact_fields(name: str, k: float, d: FloatArray, points: FloatArray) -> tuple[ComplexArray, ComplexArray, float]:
    """Total E and H (n, 3, 2) at points on or off the body, and the reference's residual."""
    if name == "sphere":
        each = [sphere.pec_total_field(k, 1.0, points, d, e) for e in dipoles.frames(d[None])[0]]
        return np.stack([E for E, _ in each], -1), np.stack([H for _, H in each], -1), 0.0
    body, depth = bodies()[name][1], DIPOLE_DEPTHS[name]
    solution = dipoles.scatter(body, k, d[None], depth=depth, per_wavelength=8.0 if k < 15 else 6.0)
    E, H = solution.total(points)
    return E[:, :, 0], H[:, :, 0], float(solution.residual.max())


def row(name: str, k: float, seed: int) -> dict[str, float]:
    """Coverage, ratio and true error of each part, and what is not OK, per cent."""
    rng = np.random.default_rng(seed)
    fan = random_fan(name, rng)
    points, on, normals, axis = places(name, fan.line.direction, rng)
    E, H, residual = exact_fields(name, k, fan.line.direction, np.concatenate([points, on]))
    near = cr.conductor_field(fan, points, wavenumber=k)
    current = cr.conductor_current(fan, on, wavenumber=k)
    count = len(points)
    off = np.maximum(np.linalg.norm(near.E - E[:count], axis=1), np.linalg.norm(near.H - H[:count], axis=1))
    J = np.cross(normals[:, :, None], H[count:], axis=1)
    charge = np.einsum("nc,nci->ni", normals, E[count:])
    wrong, mistaken = np.linalg.norm(current - J, axis=1), np.abs(current.charge - charge)
    lit = bright(fan, on, normals)[:, None] & np.ones(2, bool)
    masks: dict[str, tuple[Any, Any, Any]] = {
        part: (off, near, mask) for part, mask in parts_off(fan, points, axis, near.method == "layer").items()
    }
    masks |= {"J lit": (wrong, current, lit), "J dark": (wrong, current, ~lit)}
    masks["charge"] = (mistaken, replace(current, error=current.charge_error), np.ones(wrong.shape, bool))
    found = not_ok(near, current) | {"residual": residual}
    for part, (true, field, mask) in masks.items():
        found |= coverage(part, true, field, mask, residual=residual, quantile=0.95)
    return found


def main(arguments: list[str] | None = None) -> None:
    """Print the table."""
    quick = "--quick" in (sys.argv[1:] if arguments is None else arguments)
    head = "body        k  " + "".join(f"{part + ' (ratio, error)':>24}" for part in PARTS) + "   not OK off, on; rays"
    rows = ((f"{name:9} {k:4g}", row(name, k, seed)) for seed, (name, k) in cases(BODIES, WAVENUMBERS, quick=quick))
    print_table(head, PARTS, rows, _cell)


def _cell(found: dict[str, float], part: str) -> str:
    return f"{found[part]:10.1f} ({found[f'{part} ratio']:5.1f},{found[f'{part} error']:5.1f})"


if __name__ == "__main__":
    main()
