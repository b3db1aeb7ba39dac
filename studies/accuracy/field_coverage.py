"""Does the stated error of the far field cover the true one? Currents and rays against references, body by body.

Random incidences, 500 random directions and 100 about the forward lobe for each; each of a conductor's four amplitudes
counts as a direction. What the reference leaves on the body, as a share of the rms field, counts for nobody. Columns:

    ext       rms of what currents leave of the wave inside the body, per cent of it
    true      rms error of the far field over all directions, per cent of its rms
    cover     share of directions in which the true error is within the stated one, per cent
    ahead     the same about the forward lobe
    ratio     stated over true error, median
    off       directions in which currents err by more than 3 % of the largest |f|, per cent
    rays off  the same of isolated rays
    silent    of those of currents neither flagged nor covered, per cent
    false     directions flagged where the error is below 1 %, per cent
    residual  of the reference, the largest, per cent of the incident wave

Run ``python -m studies field_coverage`` (half an hour), ``--quick`` for the lowest wavenumber alone.
"""

from collections.abc import Iterator
from functools import cache, lru_cache

import numpy as np

import creeping as cr
from creeping._typing import Any, ComplexArray, FloatArray
from creeping.errors import SingularIncidenceError
from creeping.field.body_currents import cached_currents
from creeping.rays.fan import RayFan
from studies import Row, main
from studies.accuracy.bodies import bodies, kind_of, random_directions, reference_of, rms

WAVENUMBERS = (8.0, 14.0, 24.0)
BOUNDARIES: tuple[Any, ...] = ("soft", "hard", 0.7, "pec")
INCIDENCES = 3


@cache
def rows(name: str, k: float, boundary: Any, seed: int) -> list[Row]:
    """The columns of the head for each incidence that is not singular."""
    rng = np.random.default_rng(seed)
    drawn = []
    for _ in range(INCIDENCES):
        d, r = random_directions(rng, 1)[0], random_directions(rng, 500)
        ahead = d + 2 / k * rng.normal(size=(100, 3))
        drawn.append((d, np.concatenate([r, ahead / np.linalg.norm(ahead, axis=1, keepdims=True)])))
    incidences, observers = (np.stack(each) for each in zip(*drawn, strict=True))
    solution = reference_of(name, k, boundary, incidences)
    exact = np.stack([solution.far_field(r)[:, i] for i, r in enumerate(observers)])
    residual = solution.residual.reshape(INCIDENCES, -1).max(axis=1)
    found = (_columns(name, k, boundary, *one) for one in zip(incidences, observers, exact, residual, strict=True))
    return [columns for columns in found if columns is not None]


@lru_cache(INCIDENCES * len(WAVENUMBERS))
def _fan(name: str, d: tuple[float, float, float]) -> RayFan:
    """Fan of an incidence, the same for every boundary: it keeps where its rays leave towards the observers."""
    body = bodies()[name][0]
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, direction=d), length=4.0, n_rays=128)


def _columns(
    name: str, k: float, boundary: Any, d: FloatArray, r: FloatArray, exact: ComplexArray, residual: float
) -> Row | None:
    """The columns for one incidence; None where it is singular."""
    kind = kind_of(boundary)
    try:
        fan = _fan(name, tuple(d))
    except SingularIncidenceError:
        return None
    far = cr.far_field(fan, r, wavenumber=k, boundary=kind, method="currents")
    rays = cr.far_field(fan, r, wavenumber=k, boundary=kind, method="rays").total
    off, largest = np.abs(far.total - exact), np.abs(exact).max()
    flagged = far.unresolved.reshape(-1, *[1] * (off.ndim - 1))
    covered = off <= far.error + residual * rms(exact)
    bad = off > 0.03 * largest
    shares = {
        "cover": covered[:500],
        "ahead": covered[500:],
        "off": bad,
        "rays off": np.abs(rays - exact) > 0.03 * largest,
        "silent": bad & ~covered & ~flagged,
        "false": flagged & (off < 0.01 * largest),
    }
    return {
        "ext": 100 * cached_currents(fan, k, kind).extinction,
        "true": 100 * rms(off[:500]) / rms(exact[:500]),
        "ratio": float(np.median(far.error / off)),
        **{key: 100 * float(np.mean(share)) for key, share in shares.items()},
        "residual": 100 * float(residual),
    }


def _cases(wavenumbers: tuple[float, ...]) -> Iterator[tuple[str, Any, float, list[Row]]]:
    for number, name in enumerate(bodies()):
        for boundary in BOUNDARIES:
            for k in wavenumbers:
                yield name, boundary, k, rows(name, k, boundary, 100 * number + int(k))


def coverage(wavenumbers: tuple[float, ...] = WAVENUMBERS) -> Iterator[Row]:
    """Means over the incidences of each body, boundary and wavenumber."""
    for name, boundary, k, found in _cases(wavenumbers):
        means = {key: float(np.mean([row[key] for row in found])) for key in found[0]}
        yield {"body": name, "boundary": str(boundary), "k": k, **means}


def together(wavenumbers: tuple[float, ...] = WAVENUMBERS) -> Iterator[Row]:
    """All incidences of each boundary: true over ext, the least coverage, means."""
    every = [(kind, row) for _, kind, _, found in _cases(wavenumbers) for row in found]
    for boundary in (*BOUNDARIES, "all"):
        mine = [row for kind, row in every if boundary in (kind, "all")]
        column = {key: np.array([row[key] for row in mine]) for key in mine[0]}
        within = column["true"] / column["ext"]
        row = {"boundary": str(boundary), "incidences": len(mine)}
        row |= {"true/ext least": float(within.min()), "largest": float(within.max())}
        for factor in (1.4, 2):
            row[f"% within {factor:g}"] = 100 * float(np.mean((within < factor) & (within > 1 / factor)))
        row |= {f"least {key}": float(column[key].min()) for key in ("cover", "ahead")}
        yield row | {key: float(column[key].mean()) for key in column if key not in ("ext", "true", "residual")}


if __name__ == "__main__":
    quick = {"wavenumbers": WAVENUMBERS[:1]}
    main((coverage, together), {"coverage": quick, "together": quick})
