"""Body whose F is given by samples on a Cartesian grid: F = quintic tensor-product B-spline through them.

F and its derivatives are those of the spline, exactly.

Sources: [B78]; Derivations, B7.
"""

import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from scatterers.body import box_of, numbers, numbers_of, positive
from scatterers.charts.level_body import LevelBody
from scatterers.charts.samples import Samples
from scatterers.charts.star import star_map
from scatterers.fits.tensor import TensorSpline, coefficients

MOST = 1000
"""Nodes along an axis of a body that is sampled."""
FEWEST = 8


class Gridded(LevelBody):
    """Body F < 0 from samples of F on a regular grid, interpolated by splines.

    Parameters
    ----------
    samples : (n0, n1, n2) array_like
        F at the nodes, positive outside the body; at least 8 nodes along each axis.
    bounds : (2, 3) array_like
        Box spanned by the grid, L; the outermost nodes lie on its faces.
    centre : (3,) array_like, optional
        Interior point from which the whole surface is visible, L; by default the centre of the bounding box. If slices
        across the longest side are shifted against each other, the body is sheared first, provided that makes it
        star-shaped. A body that is not star-shaped needs no centre.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If the samples are too few or not finite, no node lies inside the body, a node on the faces of the grid does not
        lie outside, or the body is not star-shaped about the given centre.

    Examples
    --------
    >>> import numpy as np
    >>> import scatterers as sc
    >>> axis = np.linspace(-1.25, 1.25, 21)
    >>> x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    >>> ball = sc.Gridded(x**2 + y**2 + z**2 - 1, [[-1.25] * 3, [1.25] * 3])
    >>> float(abs(ball.level([0.6, 0.0, 0.8])).round(12))       # quintics are reproduced
    0.0
    """

    def __init__(
        self, samples: ArrayLike, bounds: ArrayLike, *, centre: ArrayLike | None = None, speed: Any = None
    ) -> None:
        box = box_of(bounds)
        nodes = _checked(samples)
        spacing = (box[1] - box[0]) / (np.array(nodes.shape) - 1)
        given = None if centre is None else numbers_of("centre", centre, (3,))
        self.speed = speed
        self._set_speed()
        spline = TensorSpline(coefficients(nodes), box[0], spacing)
        sampled = Samples(nodes, box[0], spacing)
        sphere_map, failure = star_map(spline, sampled, given)
        if sphere_map is None and given is not None:
            raise ValueError(failure)
        self._place(spline, sampled, sphere_map)
        self._spline = spline
        digest = hashlib.blake2b(nodes.tobytes(), digest_size=8)
        # what is stored by the sphere map depends on it, too
        header = np.zeros(0) if sphere_map is None else sphere_map.header
        digest.update(np.concatenate([box.ravel(), header, np.array(nodes.shape, dtype=float)]).tobytes())
        self._digest = digest.hexdigest()

    @classmethod
    def sampled(
        cls,
        body: Any,
        nodes: int | Sequence[int] = 64,
        margin: float = 0.15,
        *,
        centre: ArrayLike | None = None,
    ) -> "Gridded":
        """Sample F of another body on a grid; the speed of that body is copied.

        Parameters
        ----------
        body : object with ``level`` and ``bounds``
        nodes : int or three ints
            Nodes along each axis.
        margin : float
            Margin added on every side of the bounding box, as a fraction of its half width.
        centre : (3,) array_like, optional
            Interior point, L, as for `Gridded`.

        Raises
        ------
        ValueError
            On the conditions of `Gridded`, or if the nodes or the margin are not usable.

        Examples
        --------
        >>> import scatterers as sc
        >>> body = sc.Gridded.sampled(sc.Ellipsoid(1.0, 0.8, 0.6), nodes=24)
        >>> float(abs(body.level([0.0, 0.8, 0.0])).round(9))
        0.0
        """
        counts = np.broadcast_to(nodes, 3).tolist()
        if not all(FEWEST <= n <= MOST for n in counts):
            raise ValueError(f"nodes = {nodes!r}; give one or three whole numbers from {FEWEST} to {MOST}")
        positive(margin=margin)
        box = numbers_of("bounds", body.bounds, (2, 3))
        widened = margin * 0.5 * (box[1] - box[0])
        box = np.stack([box[0] - widened, box[1] + widened])
        x, y, z = (np.linspace(box[0, k], box[1, k], counts[k]) for k in range(3))
        # plane by plane, so that large grids do not fill the memory
        planes = [body.level(np.stack(np.broadcast_arrays(v, y[:, None], z), axis=-1)) for v in x]
        return cls(np.stack(planes), box, centre=centre, speed=getattr(body, "speed", None))

    def __repr__(self) -> str:
        nodes = " x ".join(str(n - 4) for n in self._spline.coefficients.shape)
        return f"Gridded({nodes} nodes, {self._digest}, speed={self.speed!r})"

    def _identity(self) -> str:
        return self._digest


def _checked(samples: ArrayLike) -> FloatArray:
    """Samples as an array, or ValueError."""
    try:
        nodes = np.ascontiguousarray(numbers(samples))
    except (TypeError, ValueError):
        raise ValueError("the samples are not numbers; give F at the nodes, an array (n0, n1, n2)") from None
    if nodes.ndim != 3 or min(nodes.shape) < FEWEST:
        raise ValueError(f"samples have shape {nodes.shape}; give (n0, n1, n2), each at least {FEWEST}")
    if bad := int(np.sum(~np.isfinite(nodes))):
        raise ValueError(f"{bad} of {nodes.size} samples are not finite; give F at every node, also far away")
    if not np.any(nodes < 0):
        raise ValueError(f"none of {nodes.size} samples is negative: no body; give F < 0 inside, or more nodes")
    edge = np.ones(nodes.shape, dtype=bool)
    edge[1:-1, 1:-1, 1:-1] = False
    if bad := int(np.sum(~(nodes[edge] > 0))):
        raise ValueError(
            f"F <= 0 at {bad} of {edge.sum()} nodes on the grid's faces: the body leaves the grid or F is negative "
            "outside; widen the box or change the sign"
        )
    return nodes
