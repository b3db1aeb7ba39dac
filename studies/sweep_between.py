"""What does interpolation of fields between incidences save, and how far off is it? Cuts and patches.

Each row is one sweep with ``accuracy``, and one of some of its incidences without: processor times on one thread, least
of two, by the public call, results in memory. Errors of fields are differences of the two over the median of the field,
of its creeping part over that of the part. Maps are tuned for 3e-5 and built beforehand. Run ``python -m
studies.sweep_between [--quick]`` (five minutes).
"""

import argparse

import numpy as np

import creeping as cr
from creeping._typing import Any, FloatArray
from studies._flow_cases import Row, body, show, threads
from studies._peers import seconds_of

LENGTH, RAYS = 4.0, 256
WAVENUMBERS = tuple(np.linspace(15.0, 60.0, 8))
ASKED: dict[str, Any] = {
    "wavenumbers": WAVENUMBERS,
    "boundary": ["soft", "hard"],
    "length": LENGTH,
    "n_rays": RAYS,
}
ACCURACY = 1e-3
TILTED, SINGULAR = (0.3, 0.5, 0.81), (1.0, 0.0, 0.05)
"""Axes of cuts: of a general one, and of one that passes through singular directions of the twisted ellipsoid."""


def cut(count: int, axis: tuple[float, ...]) -> FloatArray:
    """Great circle about an axis: (count, 3)."""
    unit = np.array(axis) / np.linalg.norm(axis)
    first = np.cross(unit, (1.0, 0.0, 0.1))
    first /= np.linalg.norm(first)
    turn = 2 * np.pi * np.arange(count)[:, None] / count
    return np.asarray(np.cos(turn) * first + np.sin(turn) * np.cross(unit, first))


def patch(count: int, height: float) -> FloatArray:
    """Directions that so many on the whole sphere have on a cap."""
    found = cr.fibonacci_directions(count)
    return np.asarray(found[found @ np.array([0.6, 0.48, 0.64]) > height])


def row(name: str, directions: FloatArray, few: int) -> Row:
    """Ratio, rates and errors of one sweep."""
    flow = cr.build_phase_map(body(name), tolerance=3e-5, length=LENGTH)
    some = np.sort(np.random.default_rng(0).choice(len(directions), min(few, len(directions)), replace=False))
    known = cr.sweep_directions(flow, directions[some], **ASKED)
    alone = seconds_of(lambda: cr.sweep_directions(flow, directions[some], **ASKED), 2) / len(some)
    found: Any = cr.sweep_directions(flow, directions, accuracy=ACCURACY, **ASKED)
    between = seconds_of(lambda: cr.sweep_directions(flow, directions, accuracy=ACCURACY, **ASKED), 2) / len(directions)
    out = {"computed per s": 1 / alone, "between per s": 1 / between, "ratio": alone / between}
    out["interpolated"] = float(found.interpolated.mean())
    found = found.isel(incidence=some)
    inside = found.interpolated.values
    for part, pair in (
        ("total", [ds.total.values for ds in (known, found)]),
        ("creeping", [ds.creeping.values for ds in (known, found)]),
    ):
        off = (np.abs(pair[0] - pair[1]) / np.median(np.abs(pair[0]), axis=0))[inside]
        out |= {f"{part} {share:.0%}": float(np.quantile(off, share)) for share in (0.5, 0.99)}
        if part == "total":
            stated = found.interpolation_error.values[inside]
            out["covered"] = float(np.mean(np.abs(pair[0] - pair[1])[inside] <= stated + 1e-15))
    return out


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a tenth of the incidences")
    quick = 10 if parser.parse_args().quick else 1
    few = 512 // quick
    cases = {
        "0.1 deg": cut(3600 // quick, TILTED),
        "0.025 deg": cut(14_400 // quick, TILTED),
        "singular": cut(3600 // quick, SINGULAR),
    }
    with threads(1):
        rows = []
        for name in ("triaxial", "twisted"):
            for case, directions in cases.items():
                if name == "twisted" or case != "singular":
                    rows.append({"body": name, "cut": case, **row(name, directions, few)})
        show("cuts", rows)
        caps = [("1e5", patch(100_000 // quick, 0.8)), ("1e6", patch(1_000_000 // quick, 0.97))]
        rows = [{"body": "twisted", "sphere": case, **row("twisted", some, few)} for case, some in caps]
        show("a cap of the sphere", rows)


if __name__ == "__main__":
    main()
