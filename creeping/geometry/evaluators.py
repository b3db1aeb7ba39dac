"""F and the speed of any body as kernels take them: its compiled functions, or its numpy methods called back.

    level      x (3, n) -> F, grad F, Hessian (xx, yy, zz, yz, xz, xy)
    speed      x (3, n) -> c, grad c, Hessian of c, in the same order
    locator    x, grad F (3, n) -> chart, (u, v), polar frame of the chart (rows e1, e2)

A body with numpy methods only goes through the same kernels as a compiled one, a hundred times slower.

Also here: orthonormal frames of tangent planes.

The polar frame of a chart with tangents T = [x_u, x_v] (3 x 2) is the orthogonal polar factor
E = T (T^T T)^(-1/2): orthonormal, tangent, and nearest to T.

Also here: speed c of a body's weighted flow.

Sources: [H86]; Derivations, R1 and B2.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple
from weakref import ref

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.geometry.surface import Surface, memo, size


class Evaluators(NamedTuple):
    """Arguments of the kernels: level and speed, each with its parameters, and whether the body is weighted.

    Without a speed the level stands in its place and is not called for it.
    """

    level: Any
    level_parameters: FloatArray
    speed: Any
    speed_parameters: FloatArray
    weighted: bool


@contextmanager
def evaluators(body: Surface) -> Iterator[Evaluators]:
    """Evaluators of a body for the kernels called inside; what its methods raise there is raised at the end."""
    speed = speed_of(body)
    level = _offered(body, "level", lambda: _called_back(body, weight=False), body)
    weight = level if speed is None else _offered(body, "speed", lambda: _called_back(body, weight=True), speed)
    with _told(level, weight):
        yield Evaluators(level.function, level.parameters, weight.function, weight.parameters, speed is not None)


@contextmanager
def locator(body: Surface) -> Iterator[tuple[Any, FloatArray]]:
    """Locator of a body's atlas for the kernels called inside, with its parameters."""
    found = _offered(body, "locator", lambda: _locator(body), body.atlas)
    with _told(found):
        yield found.function, found.parameters


def is_compiled(body: Surface) -> bool:
    """Whether kernels evaluate the body without calling back."""
    speed = speed_of(body)
    parts = (body,) if speed is None else (body, speed)
    return all(getattr(part, "compiled", None) is not None for part in parts)


def _offered(body: Surface, role: str, make: Callable[[], Any], source: Any) -> Any:
    """The compiled function that the source offers, or the callback of this body, cached."""
    compiled = getattr(source, "compiled", None)
    if compiled is not None:
        return compiled
    return memo(body, role, make)


@contextmanager
def _told(*functions: Any) -> Iterator[None]:
    """Raise at the end what callbacks have raised, unless something else ends the calls."""
    callbacks = [function for function in functions if hasattr(function, "raise_failure")]
    if not callbacks:
        yield
        return
    from creeping.kernels.callback import noted_interrupts

    try:
        with noted_interrupts():
            yield
    except BaseException:
        for callback in callbacks:
            callback.forget_failure()
        raise
    for callback in callbacks:
        callback.raise_failure()


def entries_of(hessian: FloatArray) -> FloatArray:
    """The six entries of symmetric matrices: (n, 3, 3) -> (6, n)."""
    return np.stack([hessian[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))])


def _called_back(body: Surface, *, weight: bool) -> Any:
    """F of a body, or its speed, as a function that kernels call."""
    from creeping.kernels.callback import level_callback

    known: Any = _reference(body)

    def level(
        points: FloatArray, values: FloatArray, gradients: FloatArray, hessians: FloatArray, _: FloatArray
    ) -> None:
        one, x = known(), np.ascontiguousarray(points.T)
        values[:] = one.speed.value(x) if weight else one.level(x)
        gradients[:] = np.asarray((one.speed if weight else one).gradient(x)).T
        hessians[:] = entries_of(speed_hessian(one, x) if weight else np.asarray(one.hessian(x)))

    return level_callback(level)


def _locator(body: Surface) -> Any:
    from creeping.kernels.callback import locator_callback

    known: Any = _reference(body)

    def locate(
        points: FloatArray, gradients: FloatArray, chart: IntArray, uv: FloatArray, frame: FloatArray, _: FloatArray
    ) -> None:
        atlas = known().atlas
        chart[:], found = atlas.locate(np.ascontiguousarray(points.T))
        uv[:] = found.T
        for number in np.unique(chart):
            mine = chart == number
            axes = polar_frame(atlas.charts[number].tangents(found[mine]))
            frame[:3, mine], frame[3:, mine] = axes[..., 0].T, axes[..., 1].T

    return locator_callback(locate)


def _reference(body: Surface) -> Callable[[], Any]:
    """A weak reference, so that a callback kept by the body's identity does not keep the body; itself where not."""
    try:
        return ref(body)
    except TypeError:
        return lambda: body


def polar_frame(tangents: FloatArray) -> FloatArray:
    """Polar frame E = T (T^T T)^(-1/2) of chart tangents, of any unit: (..., 3, 2) -> (..., 3, 2).

    The 2 x 2 root is closed: G^(1/2) = (G + s)/t with s = sqrt(det G), t = sqrt(tr G + 2 s).

    Examples
    --------
    >>> polar_frame(np.array([[2.0, 1.0], [0.0, 1.0], [0.0, 0.0]])).round(4)
    array([[ 0.9487,  0.3162],
           [-0.3162,  0.9487],
           [ 0.    ,  0.    ]])
    """
    gram = np.swapaxes(tangents, -1, -2) @ tangents
    p, q, r = gram[..., 0, 0], gram[..., 0, 1], gram[..., 1, 1]
    s = np.sqrt(p * r - q * q)
    t = np.sqrt(p + r + 2 * s)
    # inverse of (G + s)/t; its determinant is s t^2
    scale = 1.0 / (s * t)
    root = np.empty_like(gram)
    root[..., 0, 0] = (r + s) * scale
    root[..., 1, 1] = (p + s) * scale
    root[..., 0, 1] = root[..., 1, 0] = -q * scale
    return np.asarray(tangents @ root)


def speed_of(body: Surface) -> Any:
    """Speed c of the body's weighted flow, or None."""
    return getattr(body, "speed", None)


def speed_values(body: Surface, points: FloatArray) -> FloatArray:
    """Speed c, 1 without a weight: (..., 3) -> (...)."""
    speed = speed_of(body)
    return np.ones(np.shape(points)[:-1]) if speed is None else np.asarray(speed.value(points), dtype=float)


def speed_hessian(body: Surface, points: FloatArray) -> FloatArray:
    """Hessian of c: (..., 3) -> (..., 3, 3), by central differences where the speed offers none."""
    speed = speed_of(body)
    if hasattr(speed, "hessian"):
        return np.asarray(speed.hessian(points), dtype=float)
    # rounding and truncation balance near eps^(1/3): relative error about 1e-10
    step = 6e-6 * size(body)
    columns = [(speed.gradient(points + step * e) - speed.gradient(points - step * e)) / (2 * step) for e in np.eye(3)]
    hessian = np.stack(columns, axis=-1)
    return np.asarray(0.5 * (hessian + np.swapaxes(hessian, -1, -2)))
