"""Where the body of an expression lies: the smallest cube about the origin that holds one body, and nothing beyond."""

import numpy as np
from numpy.typing import NDArray

from scatterers.expression.space import ExpressionSpace
from scatterers.spline.samples import Samples

FloatArray = NDArray[np.float64]
SIZES = 2.0 ** np.arange(-8, 13)
"""Half widths of the cubes about the origin in which a body is looked for."""
COARSE, FINE = 33, 65
"""Nodes along a side of those cubes, and along the longest side of the box that is examined."""
SLACK = 0.12
"""By which the box is wider than the body, in its own half widths."""


def samples_of(space: ExpressionSpace, box: FloatArray, nodes: int) -> Samples:
    """F on a grid of nearly cubic cells with so many nodes along the longest side."""
    side = box[1] - box[0]
    counts = np.clip(np.ceil(side / side.max() * (nodes - 1)).astype(int) + 1, 17, nodes)
    axes = [np.linspace(box[0, k], box[1, k], counts[k]) for k in range(3)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    with np.errstate(all="ignore"):
        values = np.asarray(space.functions.value(x, y, z)[0], dtype=float)
    return Samples(np.broadcast_to(values, x.shape).copy(), box[0], side / (counts - 1))


def found_box(space: ExpressionSpace) -> FloatArray:
    """Box (2, 3), L, around the one body, from the smallest cube about the origin that holds it.

    Raises
    ------
    ValueError
        If there is no body, it is open, or no cube of a known size holds it alone.
    """
    open_cubes = 0
    for k, half in enumerate(SIZES):
        samples = samples_of(space, np.array([[-half] * 3, [half] * 3]), COARSE)
        if not np.any(samples.values < 0):
            continue
        if np.any(samples.on_faces() < 0):
            open_cubes += 1
            continue
        for larger in SIZES[k + 1 : k + 6]:
            around = samples_of(space, np.array([[-larger] * 3, [larger] * 3]), COARSE)
            away = np.any(around.values < 0, axis=(1, 2)).sum()
            if np.any(around.on_faces() < 0) or (away > 0 and _beyond(around, half)):
                raise ValueError(
                    f"F < 0 inside the cube of half width {half:g} about the origin, and again beyond it: "
                    "several bodies or an unbounded one; give bounds around the one you mean"
                )
        return tightened(space, samples)
    if open_cubes:
        raise ValueError(
            f"F < 0 reaches the faces of every cube about the origin up to half width {SIZES[-1]:g}: F = 0 is open, "
            "unbounded or has the sign turned; F must be positive outside the body, or give bounds"
        )
    raise ValueError(
        f"F is nowhere negative on grids of {COARSE} nodes a side about the origin, half widths {SIZES[0]:g} to "
        f"{SIZES[-1]:g}: no body, the sign turned, or a body too small or too far off; give bounds"
    )


def _beyond(samples: Samples, half: float) -> bool:
    """Whether F < 0 at a node outside the cube of this half width."""
    where = samples.origin + np.argwhere(samples.values < 0) * samples.spacing
    return bool(np.any(np.abs(where) > half))


def tightened(space: ExpressionSpace, samples: Samples) -> FloatArray:
    """Box (2, 3), L, around the nodes inside, sampled anew until it fits."""
    for _ in range(4):
        low, high = samples.inside
        reach = SLACK * 0.5 * (high - low) + 1.5 * samples.spacing
        box = np.stack([low - reach, high + reach])
        samples = samples_of(space, box, COARSE)
    return box


def examine(expression: str, samples: Samples, given: bool) -> None:
    """ValueError unless F is finite in the box, positive on its faces, and F < 0 and F > 0 are connected."""
    values = samples.values
    if bad := int(np.sum(~np.isfinite(values))):
        raise ValueError(
            f"F = {expression} is not finite at {bad} of {values.size} points of its box; "
            "write it without poles and roots of negative numbers around the body, or give bounds"
        )
    if not np.any(values < 0):
        raise ValueError(f"F is nowhere negative at {values.size} points of the bounds: no body, or the sign turned")
    if bad := int(np.sum(samples.on_faces() < 0)):
        remedy = "give wider bounds, or turn the sign" if given else "give bounds"
        raise ValueError(f"F < 0 at {bad} points on the faces of the bounds: F = 0 is open or cut there; {remedy}")
    if len(bodies := samples.middles()) > 1:
        places = "; ".join(f"{count} grid points about {tuple(m.round(4).tolist())}" for count, m in bodies[:4])
        raise ValueError(f"F = 0 has {len(bodies)} bodies ({places}); give bounds around one of them")
    if samples.has_cavity():
        raise ValueError("F > 0 in a cavity inside the body; its wall is a body of its own: give F of the outer wall")
