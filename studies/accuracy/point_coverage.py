"""Do the stated errors of near and surface fields cover the true ones? Against references, body and part by part.

Random incidences; 600 points at heights of 0.03 to 3 over the body, 100 about the axis behind it, 700 on it. For each
part of the points whose status is OK: share in which the true error is within the stated one, per cent, and in brackets
stated over true error in the median and the true error that 95 of 100 keep to, per cent of the incident wave. Parts:

    lit             off the body, where the incident wave comes; of a conductor the larger error of E and H
    close           within a quarter of a wavelength of the body; between currents and the field on it
    shadow          off the body, behind it; by rays or currents, whichever states less
    axis            about the axis behind it, where rays merge
    on lit, dark    on the lit side, and in the shadow, the penumbra included; of a conductor the current
    charge          n.E of a conductor, judged by its own error
    off, on; rays   per cent of the points off the body and on it that are not OK, and of those off it by rays

Factors of errors were set on the first four bodies at k = 10, 20 and 30; the others have no share in them.

Run ``python -m studies point_coverage`` (a quarter of an hour), ``--quick`` for the sphere at k = 10 alone.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

import creeping as cr
from creeping._typing import Any, BoolArray, FloatArray
from creeping.errors import SingularIncidenceError
from creeping.geometry.quadrature import body_nodes
from creeping.rays.fan import RayFan
from creeping.shadow.attachment import occluded
from studies import Row, main
from studies.accuracy.bodies import bodies, kind_of, random_directions, reference_of

BODIES = ("sphere", "triaxial", "slender", "flat", "egg", "twisted", "peanut")
Part = tuple[FloatArray, Any, BoolArray, float]
"""True errors, what states them, which of them belong to the part, and the unit of the error."""


def random_fan(name: str, rng: np.random.Generator) -> RayFan:
    """Fan of a random incidence on a body that is not singular."""
    body = bodies()[name][0]
    while True:
        try:
            line = cr.shadow_line(body, direction=random_directions(rng, 1)[0])
            break
        except SingularIncidenceError:
            continue
    return cr.launch(cr.DirectFlow(body), line, length=4.0, n_rays=128)


def places(name: str, d: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Points off the body, points on it with their normals, and which of the first are about the axis."""
    body = bodies()[name][0]
    nodes = body_nodes(body, 20.0)
    pick = rng.choice(len(nodes.points), 700, p=nodes.weights / nodes.weights.sum())
    on, normals = nodes.points[pick], nodes.normals[pick]
    height = np.exp(rng.uniform(np.log(0.03), np.log(3.0), 600))
    off = on[:600] + height[:, None] * normals[:600]
    axis = rng.uniform(1.1, 4.0, 100)[:, None] * d + 0.1 * rng.normal(size=(100, 3))
    points = np.concatenate([off, axis])
    outside = body.level(points) > 0
    return points[outside], on, normals, (np.arange(700) >= 600)[outside]


def parts_off(fan: RayFan, points: FloatArray, axis: BoolArray, close: BoolArray) -> dict[str, BoolArray]:
    """Which points off the body (n,) are of which part; ``close`` of the layer (n,), or (n, 2) for polarisations."""
    # one column for each polarisation
    columns = (-1, *[1] * (close.ndim - 1))
    dark = occluded(fan.body, points, fan.line.direction).reshape(columns)
    behind = axis.reshape(columns)
    return {
        "lit": ~dark & ~close,
        "close": close,
        "shadow": dark & ~behind & ~close,
        "axis": dark & behind & ~close,
    }


def bright(fan: RayFan, on: FloatArray, normals: FloatArray) -> BoolArray:
    """Which points on the body (n,) are lit."""
    found = np.asarray(normals @ fan.line.direction < 0)
    found[found] = ~occluded(fan.body, on[found], fan.line.direction)
    return found


def coverage(name: str, part: Part, residual: float) -> Row:
    """Coverage, per cent, ratio and error of a part: NaN if it is empty. The reference's residual counts for nobody."""
    true, field, mask, unit = part
    at = mask & field.ok
    if not np.any(at):
        return dict.fromkeys((name, f"{name} ratio", f"{name} error"), np.nan)
    return {
        name: 100 * float(np.mean(true[at] <= field.error[at] + residual * unit)),
        f"{name} ratio": float(np.median(field.error[at] / true[at])),
        f"{name} error": 100 * float(np.quantile(true[at], 0.95)) / unit,
    }


def row(name: str, k: float, boundary: Any, seed: int) -> Row:
    """Coverage, ratio and true error of each part, and what is not OK, per cent."""
    rng = np.random.default_rng(seed)
    fan = random_fan(name, rng)
    d = fan.line.direction
    points, on, normals, axis = places(name, d, rng)
    lit = bright(fan, on, normals)
    measured = _conductor if boundary == "pec" else _scalar
    off, near, surface, parts, residual = measured(name, k, boundary, fan, points, on, normals, lit)
    close = near.method == "layer"
    every = {part: (off, near, mask, 1.0) for part, mask in parts_off(fan, points, axis, close).items()} | parts
    found = {
        "off": 100 * float(np.mean(~near.ok)),
        "on": 100 * float(np.mean(~surface.ok)),
        "rays": 100 * float(np.mean((near.method == "rays") & near.ok)),
    }
    for part, one in every.items():
        found |= coverage(part, one, residual)
    return found


def _scalar(
    name: str, k: float, boundary: Any, fan: RayFan, points: FloatArray, on: FloatArray, normals: FloatArray, lit: Any
) -> tuple[FloatArray, Any, Any, dict[str, Part], float]:
    """True errors off the body, the fields off it and on it, parts on it, and the reference's residual."""
    solution, soft = reference_of(name, k, boundary, fan.line.direction[None]), boundary == "soft"
    exact = solution.total(points)[:, 0]
    there = (solution.normal_derivative(on, normals) if soft else solution.total(on))[:, 0]
    near = cr.near_field(fan, points, wavenumber=k, boundary=kind_of(boundary))
    surface = cr.surface_field(fan, on, wavenumber=k, boundary=kind_of(boundary))
    wrong, unit = np.abs(surface - there), k if soft else 1.0
    parts: dict[str, Part] = {"on lit": (wrong, surface, lit, unit), "dark": (wrong, surface, ~lit, unit)}
    return np.abs(near - exact), near, surface, parts, float(solution.residual[0])


def _conductor(
    name: str, k: float, _: Any, fan: RayFan, points: FloatArray, on: FloatArray, normals: FloatArray, lit: Any
) -> tuple[FloatArray, Any, Any, dict[str, Part], float]:
    """The same of E and H, the current and the charge, of both polarisations."""
    solution = reference_of(name, k, "pec", fan.line.direction[None])
    E, H = (field[:, :, 0] for field in solution.total(np.concatenate([points, on])))
    near, current = cr.conductor_field(fan, points, wavenumber=k), cr.conductor_current(fan, on, wavenumber=k)
    count, of_both = len(points), np.ones(2, bool)
    off = np.maximum(np.linalg.norm(near.E - E[:count], axis=1), np.linalg.norm(near.H - H[:count], axis=1))
    wrong = np.linalg.norm(current - np.cross(normals[:, :, None], H[count:], axis=1), axis=1)
    mistaken = np.abs(current.charge - np.einsum("nc,nci->ni", normals, E[count:]))
    of_charge = replace(current, error=current.charge_error)
    parts: dict[str, Part] = {
        "on lit": (wrong, current, lit[:, None] & of_both, 1.0),
        "dark": (wrong, current, ~lit[:, None] & of_both, 1.0),
        "charge": (mistaken, of_charge, np.ones(wrong.shape, bool), 1.0),
    }
    return off, near, current, parts, float(solution.residual.max())


def _table(names: Sequence[str], boundaries: Sequence[Any], wavenumbers: Sequence[float]) -> Iterator[Row]:
    """Rows of all cases, and what all of them come to."""
    every = []
    for number, name in enumerate(names):
        for boundary in boundaries:
            for k in wavenumbers:
                found = row(name, k, boundary, 100 * number + int(k))
                every.append(found)
                yield {"body": name, "boundary": boundary, "k": k} | _cells(found)
    for what, of in (("mean", np.nanmean), ("least", np.nanmin)):
        together = {key: float(of([r[key] for r in every])) for key in every[0]}
        yield {"body": what, "boundary": "", "k": ""} | _cells(together)


def _cells(found: Row) -> Row:
    cells = {what: found[what] for what in ("off", "on", "rays")}
    for part in (part for part in found if f"{part} ratio" in found):
        cells[part] = "{:.1f} ({:.1f}, {:.1f})".format(*(found[part + of] for of in ("", " ratio", " error")))
    return cells


def scalar(
    names: Sequence[str] = BODIES,
    boundaries: Sequence[Any] = ("soft", "hard", 0.7),
    wavenumbers: Sequence[float] = (10, 20, 30),
) -> Iterator[Row]:
    """Soft, hard and eta = 0.7: share covered (stated over true error, true error)."""
    return _table([name for name in names if name != "egg"], boundaries, wavenumbers)


def conductor(names: Sequence[str] = BODIES, wavenumbers: Sequence[float] = (10, 20)) -> Iterator[Row]:
    """Conductors: share covered (stated over true error, true error)."""
    return _table(names, ("pec",), wavenumbers)


if __name__ == "__main__":
    quick = {"names": BODIES[:1], "wavenumbers": (10,)}
    main((scalar, conductor), {"scalar": quick, "conductor": quick})
