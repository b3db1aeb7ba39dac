"""How far couplings of ports err, and whether their stated error holds: the sphere's series, fundamental solutions.

Sources and receivers are random; a pair counts where the reference's own extrapolation to the body is good to 1 %. The
factors of the error were set on the first two ellipsoids.

    python -m studies.port_coverage
"""

import sys
from typing import NamedTuple

import numpy as np

import creeping as cr
import scatterers as sc
from tests.reference.clouds import ellipsoid
from tests.reference.dipoles import coupled, sphere_coupling

CASES = (
    ((1.0, 0.8, 0.6), 20.0, 0.2, 1),
    ((1.2, 1.0, 0.8), 15.0, 0.25, 2),
    ((0.7, 0.9, 1.1), 18.0, 0.22, 6),
    ((0.8, 0.9, 1.1), 20.0, 0.25, 11),
)
"""Half-axes, k, depth of the fundamental solutions, and seed of the ports."""
HEIGHTS = (0.04, 0.07, 0.1, 0.13, 0.16)
GOOD = 0.01
"""Spread of the reference, as a share of the value, up to which it serves."""


class Row(NamedTuple):
    """Errors of one part of the pairs, as shares of the exact value, and the share of pairs that they cover."""

    part: str
    pairs: int
    median: float
    worst: float
    stated: float
    covered: float


def directions(count: int, rng: np.random.Generator) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Random unit vectors (count, 3)."""
    v = rng.normal(size=(count, 3))
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))


def ellipsoid_rows(
    axes: tuple[float, float, float], k: float, depth: float, seed: int, *, sources: int = 8, points: int = 150
) -> list[Row]:
    """Rows of rays and beams; ``worst`` is the quantile at 95 of 100."""
    rng = np.random.default_rng(seed)
    ports = directions(sources, rng)
    # off the planes of symmetry, where the reference's local solutions would meet their images
    ports = np.sign(ports) * np.maximum(np.abs(ports), 0.25)
    ports /= np.linalg.norm(ports, axis=1, keepdims=True)
    exact = coupled(ellipsoid(*axes), k, ports, directions(points, rng), depth=depth, heights=HEIGHTS)
    found = cr.coupling(sc.Ellipsoid(*axes), np.concatenate([exact.ports, exact.points]), wavenumber=k)
    part = slice(0, sources), slice(sources, None)
    size, off = np.abs(exact.values), np.abs(found.values[part].T - exact.values)
    error, method, ok = found.error[part].T, found.method[part].T, found.ok[part].T
    known = (exact.spread < GOOD * size) & ok
    rows = []
    for name in ("rays", "beams"):
        mine = known & (method == name)
        if np.any(mine):
            share = (off / size)[mine]
            covered = np.mean((off < error + exact.spread)[mine])
            stated = np.median((error / size)[mine])
            at = float(np.median(share)), float(np.quantile(share, 0.95))
            rows.append(Row(name, int(mine.sum()), *at, float(stated), float(covered)))
    return rows


def sphere_row(ka: float) -> Row:
    """Every degree from 5 to 175; ``worst`` is the largest."""
    s = np.radians(np.arange(5.0, 175.5))
    ports = np.stack([np.sin(s) * np.cos(0.3), np.sin(s) * np.sin(0.3), np.cos(s)], axis=1)
    found = cr.coupling(sc.Sphere(), np.concatenate([[[0, 0, 1.0]], ports]), wavenumber=ka)
    exact = sphere_coupling(ka, 1.0, s)
    off = np.abs(found.values[0, 1:] - exact)
    share, error = off / np.abs(exact), found.error[0, 1:]
    stated, covered = float(np.median(error / np.abs(exact))), float(np.mean(off < error))
    return Row("all", len(s), float(np.median(share)), float(share.max()), stated, covered)


def main() -> None:
    """Print all rows; the ellipsoids take a minute each, which ``--quick`` leaves out."""
    print("body, k, part, pairs, median error %, largest or at 95 of 100, stated %, covered %")
    table = [(f"sphere, {ka:g}", sphere_row(ka)) for ka in (10.0, 30.0, 100.0)]
    for case in () if "--quick" in sys.argv else CASES:
        table += [(f"{case[0]}, {case[1]:g}", row) for row in ellipsoid_rows(*case)]
    for name, row in table:
        shares = ", ".join(f"{100 * value:.2f}" for value in row[2:])
        print(f"{name}, {row.part}, {row.pairs}, {shares}")


if __name__ == "__main__":
    main()
