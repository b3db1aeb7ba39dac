"""Do the stated errors of fields near conductors cover the true ones? Against Mie and electric dipoles, part by part.

Random incidences and both polarisations; points as in `studies.near_coverage`. For each part of the points whose status
is OK: share in which the true error is within the stated one, per cent, stated over true error in the median, and the
true error that 95 of 100 points keep to, per cent of the incident wave. Parts:

    lit, close, shadow, axis    E and H off the body, the larger error of the two, as in `studies.near_coverage`
    J lit, J dark               the current on lit ground, and in the shadow, the penumbra included
    charge                      n.E, judged by the error of J
    not OK                      per cent of the points off the body, and on it

Factors were set on the first four bodies, at k = 10, 20 and 30; the others have no share in them.

Run ``python -m studies.conductor_coverage`` (ten minutes), ``--quick`` for the sphere at the lowest wavenumber alone.
"""

import sys

import numpy as np

import creeping as cr
from creeping._typing import Any, ComplexArray, FloatArray
from creeping.errors import SingularIncidenceError
from creeping.shadow.occlusion import occluded
from studies.field_coverage import DIPOLE_DEPTHS, bodies
from studies.near_coverage import places
from studies.reference import dipoles, sphere

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
    body: Any = bodies()[name][0]
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
    E, H, residual = exact_fields(name, k, d, np.concatenate([points, on]))
    near = cr.conductor_field(fan, points, wavenumber=k)
    current = cr.conductor_current(fan, on, wavenumber=k)
    count = len(points)
    off = np.maximum(np.linalg.norm(near.E - E[:count], axis=1), np.linalg.norm(near.H - H[:count], axis=1))
    J = np.cross(normals[:, :, None], H[count:], axis=1)
    charge = np.einsum("nc,nci->ni", normals, E[count:])
    wrong, mistaken = np.linalg.norm(current - J, axis=1), np.abs(current.charge - charge)
    dark = occluded(body, points, d)
    bright = normals @ d < 0
    bright[bright] = ~occluded(body, on[bright], d)
    close = near.method == "layer"
    found = {"off": 100 * float(np.mean(~near.ok)), "on": 100 * float(np.mean(~current.ok)), "residual": residual}
    masks: dict[str, tuple[Any, Any, Any]] = {
        "lit": (off, near, ~dark[:, None] & ~close),
        "close": (off, near, close),
        "shadow": (off, near, (dark & ~axis)[:, None] & ~close),
        "axis": (off, near, (dark & axis)[:, None] & ~close),
        "J lit": (wrong, current, bright[:, None] | np.zeros(2, bool)),
        "J dark": (wrong, current, ~bright[:, None] | np.zeros(2, bool)),
        "charge": (mistaken, current, np.ones(wrong.shape, bool)),
    }
    for part, (true, field, mask) in masks.items():
        at = mask & field.ok
        some = bool(np.any(at))
        # the reference's own error counts for nobody
        found[part] = 100 * float(np.mean(true[at] <= field.error[at] + residual)) if some else np.nan
        found[f"{part} ratio"] = float(np.median(field.error[at] / true[at])) if some else np.nan
        found[f"{part} error"] = 100 * float(np.quantile(true[at], 0.95)) if some else np.nan
    found["rays"] = 100 * float(np.mean((near.method == "rays") & near.ok))
    return found


def main(arguments: list[str] | None = None) -> None:
    """Print the table."""
    given = sys.argv[1:] if arguments is None else arguments
    quick = "--quick" in given
    print("body        k  " + "".join(f"{part + ' (ratio, error)':>24}" for part in PARTS) + "   not OK off, on; rays")
    every = []
    for number, name in enumerate(BODIES[:1] if quick else BODIES):
        for k in WAVENUMBERS[:1] if quick else WAVENUMBERS:
            found = row(name, k, 100 * number + int(k))
            every.append(found)
            cells = "".join(
                f"{found[part]:10.1f} ({found[f'{part} ratio']:5.1f},{found[f'{part} error']:5.1f})" for part in PARTS
            )
            print(f"{name:9} {k:4g} {cells}   {found['off']:5.1f} {found['on']:5.1f} {found['rays']:5.1f}", flush=True)
    for part in PARTS:
        covers, ratios = ([found[f"{part}{what}"] for found in every] for what in ("", " ratio"))
        print(f"{part:8} covered {np.nanmean(covers):.1f} %, least {np.nanmin(covers):.1f}", end="; ")
        print(f"ratio {np.nanmedian(ratios):.1f}")


if __name__ == "__main__":
    main()
