"""How far couplings of ports err, and whether their stated error holds: the sphere's series, fundamental solutions.

Sources and receivers are random; a pair counts where the reference's own extrapolation to the body is good to 1 %. The
factors of the error were set on the first two ellipsoids. Errors are per cent of the exact value.

Run ``python -m studies port_coverage`` (a minute for each ellipsoid), ``--quick`` for spheres alone.
"""

from collections.abc import Iterator

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import FloatArray
from studies import Row, main
from studies.accuracy.bodies import random_directions
from tests.reference.clouds import ellipsoid
from tests.reference.hard_ports import coupled, sphere_coupling


def _row(part: str, off: FloatArray, size: FloatArray, stated: FloatArray, spread: FloatArray, most: float) -> Row:
    """Errors of one part of the pairs; ``worst`` is that which a share ``most`` of them keeps to."""
    share = 100 * off / size
    return {
        "part": part,
        "pairs": len(off),
        "median": float(np.median(share)),
        "worst": float(np.quantile(share, most)),
        "stated": float(np.median(100 * stated / size)),
        "covered": 100 * float(np.mean(off < stated + spread)),
    }


def ellipsoid_rows(
    axes: tuple[float, float, float], k: float, depth: float, seed: int, *, sources: int = 8, points: int = 150
) -> list[Row]:
    """Rows of rays and beams; ``worst`` is the quantile at 95 of 100."""
    rng = np.random.default_rng(seed)
    ports = random_directions(rng, sources)
    # off the planes of symmetry, where the reference's local solutions would meet their images
    ports = np.sign(ports) * np.maximum(np.abs(ports), 0.25)
    ports /= np.linalg.norm(ports, axis=1, keepdims=True)
    heights = (0.04, 0.07, 0.1, 0.13, 0.16)
    exact = coupled(ellipsoid(*axes), k, ports, random_directions(rng, points), depth=depth, heights=heights)
    found = cr.coupling(sc.Ellipsoid(*axes), np.concatenate([exact.ports, exact.points]), wavenumber=k)
    part = slice(0, sources), slice(sources, None)
    size, off = np.abs(exact.values), np.abs(found.values[part].T - exact.values)
    error, method, ok = found.error[part].T, found.method[part].T, found.ok[part].T
    # the reference serves up to a spread of 1 %
    known = (exact.spread < 0.01 * size) & ok
    masks = [(name, known & (method == name)) for name in ("rays", "beams")]
    return [_row(name, off[at], size[at], error[at], exact.spread[at], 0.95) for name, at in masks if np.any(at)]


def sphere_row(ka: float) -> Row:
    """Every degree from 5 to 175; ``worst`` is the largest."""
    s = np.radians(np.arange(5.0, 175.5))
    ports = np.stack([np.sin(s) * np.cos(0.3), np.sin(s) * np.sin(0.3), np.cos(s)], axis=1)
    found = cr.coupling(sc.Sphere(), np.concatenate([[[0, 0, 1.0]], ports]), wavenumber=ka)
    exact = sphere_coupling(ka, 1.0, s)
    off = np.abs(found.values[0, 1:] - exact)
    return _row("all", off, np.abs(exact), found.error[0, 1:], np.zeros(len(s)), 1.0)


def spheres() -> Iterator[Row]:
    """Spheres: median and largest error, stated error in the median, share covered."""
    return ({"ka": str(ka)} | sphere_row(ka) for ka in (10.0, 30.0, 100.0))


def ellipsoids(most: int = 4) -> Iterator[Row]:
    """Ellipsoids: median error and that of 95 of 100 pairs, stated error in the median, share covered."""
    # half-axes, k, depth of the fundamental solutions, and seed of the ports
    cases = (
        ((1.0, 0.8, 0.6), 20.0, 0.2, 1),
        ((1.2, 1.0, 0.8), 15.0, 0.25, 2),
        ((0.7, 0.9, 1.1), 18.0, 0.22, 6),
        ((0.8, 0.9, 1.1), 20.0, 0.25, 11),
    )
    for case in cases[:most]:
        axes, k, *_ = case
        yield from ({"half-axes": ", ".join(map(str, axes)), "k": k} | row for row in ellipsoid_rows(*case))


if __name__ == "__main__":
    main((spheres, ellipsoids), {"ellipsoids": {"most": 0}})
