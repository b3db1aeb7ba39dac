"""Whether a body is star-shaped, upright or along a bent spine, and the sphere map that follows.

Sources: Derivations, B4.
"""

import numpy as np
from numpy.typing import NDArray

from scatterers.sphere_map.radial import RadialMap, SpaceLevel, Spine
from scatterers.spline.samples import Samples
from scatterers.spline.tensor import evaluated

FloatArray = NDArray[np.float64]
CHECKED = 20000
"""Points of the body at which the centre is checked."""


def star_map(space: SpaceLevel, samples: Samples, centre: FloatArray | None) -> tuple[RadialMap | None, str]:
    """Sphere map with a spine if the body is not upright and that does, without one otherwise.

    Returns
    -------
    RadialMap or None
        None if the body is not star-shaped.
    str
        What is wrong then.
    """
    points = samples.crossings()
    spines = [Spine.through(samples.values < 0, samples.origin, samples.spacing), Spine.none()]
    failure = ""
    for spine in spines[spines[0].upright :]:
        upright = points - spine.shift(points)
        low, high = upright.min(0), upright.max(0)
        middle = 0.5 * (low + high) if centre is None else centre - spine.shift(centre)
        sphere_map = RadialMap(space, middle, 0.5 * (high - low), spine)
        if not (failure := _hidden(sphere_map, points)):
            return sphere_map, ""
    return None, failure


def _hidden(sphere_map: RadialMap, points: FloatArray) -> str:
    """What is wrong unless F < 0 at the centre and rays from it leave the body at its points."""
    box, centre = sphere_map.space.box, sphere_map.centre + sphere_map.spine.shift(sphere_map.centre)
    remedy = "give a centre from which every point of the body is in sight, or another body"
    where = tuple(centre.round(6).tolist())
    inside = np.all(centre > box[0]) and np.all(centre < box[1])
    if not inside or not evaluated(sphere_map.compiled_level, centre)[0] < 0:
        return f"the centre {where} is not inside the body; {remedy}"
    points = points[:: -(-len(points) // CHECKED)]
    hidden = int(np.sum(~(sphere_map.facing(points) > 0)))
    if not hidden:
        return ""
    return f"the body is not star-shaped about {where}: {hidden} of {len(points)} directions fail; {remedy}"
