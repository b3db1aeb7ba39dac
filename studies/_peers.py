"""The peers that the engine is measured against: scipy's DOP853 ray by ray, and heyoka's Taylor series in batches.

Both integrate the plain flow from one closed form per body, and with ``carry_jacobi`` what a ray carries along:

    J'' = -K J,  J(0) = 1,  J'(0) = 0    how neighbours part
    A' = max(kappa_n, 0)^(2/3)           the decay of a creeping wave

Lanes are x(3), p(3), then J, J' and A. F and p.Hp are not shortened by F = 0 and |p| = 1, which hold on T1Q alone:
shortened, the flow would leave T1Q exponentially where kappa_n < 0. K, that nothing feeds back from, is shortened.
"""

import math
import time
from collections.abc import Callable
from importlib import import_module

import numpy as np
from scipy.integrate import solve_ivp

from creeping import IntegrationError
from creeping._typing import Any, FloatArray
from scatterers import Ellipsoid, Torus, TwistedEllipsoid

ORDERS = 3, 20
"""Lowest and highest order of heyoka's series; the highest is rounding level."""

Equations = Callable[..., tuple[Any, ...]]
"""From the six scalars of (x, p): the gradient g of a multiple of F, p.Hp of the same, g.g, and K."""


def equations(body: Any, functions: Any) -> Equations:
    """Closed form of a body, in floats (``functions`` = math) or expressions (``functions`` = heyoka).

    Raises
    ------
    TypeError
        If the body has none here, or a weight.
    """
    if getattr(body, "speed", None) is not None:
        raise TypeError("the peers integrate the plain flow; give a body without speed")
    match body:
        case Ellipsoid():
            return _ellipsoid(body)
        case Torus():
            return _torus(body)
        case TwistedEllipsoid():
            return _twisted(body, functions)
    raise TypeError(f"no closed form for {type(body).__name__}; give an Ellipsoid, Torus or TwistedEllipsoid")


def _ellipsoid(body: Ellipsoid) -> Equations:
    a, b, c = body.a**-2, body.b**-2, body.c**-2
    product = a * b * c

    def terms(x: Any, y: Any, z: Any, u: Any, v: Any, w: Any) -> tuple[Any, ...]:
        gx, gy, gz = a * x, b * y, c * z
        square = gx * gx + gy * gy + gz * gz
        return gx, gy, gz, a * u * u + b * v * v + c * w * w, square, product / (square * square)

    return terms


def _torus(body: Torus) -> Equations:
    major, curved = body.R, body.r**-2

    def terms(x: Any, y: Any, z: Any, u: Any, v: Any, w: Any) -> tuple[Any, ...]:
        inverse = (x * x + y * y) ** -0.5
        ratio = major * inverse
        radial = 1.0 - ratio
        around = (x * v - y * u) * inverse
        gx, gy = radial * x, radial * y
        bent = u * u + v * v + w * w - ratio * around * around
        return gx, gy, z, bent, gx * gx + gy * gy + z * z, curved * radial

    return terms


def _twisted(body: TwistedEllipsoid, functions: Any) -> Equations:
    a, b, c, d = body.a**-2, body.b**-2, body.c**-2, body.d
    cos, sin, pi = functions.cos, functions.sin, math.pi

    def terms(x: Any, y: Any, z: Any, u: Any, v: Any, w: Any) -> tuple[Any, ...]:
        shift = d * cos(pi * z)
        slope = (pi * d) * sin(pi * z)
        gx, gy, cz = a * x, b * (y - shift), c * z
        gz = gy * slope + cz
        along = v + slope * w
        bend = gy * (pi * pi) * shift + c
        square = gx * gx + gy * gy + gz * gz
        gauss = (a * b) * (bend * (1.0 - cz * z) + cz * cz) / (square * square)
        return gx, gy, gz, a * u * u + b * along * along + bend * w * w, square, gauss

    return terms


def scipy_flow(
    body: Any, states: FloatArray, times: FloatArray, *, rtol: float, carry_jacobi: bool = False
) -> FloatArray:
    """Flow ray by ray with scipy's DOP853, right-hand side in plain floats.

    Parameters
    ----------
    body : Ellipsoid, Torus or TwistedEllipsoid, without speed
    states : (n, 6 or more)
        (x, p) on T1Q; further lanes are not read.
    times : (m,), L
        Ascending, > 0 at the end.
    rtol : float
        Tolerance per step, relative and absolute.
    carry_jacobi : bool
        Carry J, J' and A too.

    Returns
    -------
    (n, m, 6 or 9)
    """
    terms = equations(body, math)

    def plain(_: float, lanes: FloatArray) -> list[float]:
        x, y, z, u, v, w = lanes.tolist()
        gx, gy, gz, bent, square, _gauss = terms(x, y, z, u, v, w)
        turn = -bent / square
        return [u, v, w, turn * gx, turn * gy, turn * gz]

    def carrying(_: float, lanes: FloatArray) -> list[float]:
        x, y, z, u, v, w, j, dj, _a = lanes.tolist()
        gx, gy, gz, bent, square, gauss = terms(x, y, z, u, v, w)
        turn = -bent / square
        decay = (-bent * turn) ** (1 / 3) if bent > 0 else 0.0
        return [u, v, w, turn * gx, turn * gy, turn * gz, dj, -gauss * j, decay]

    start = _start(states, 9 if carry_jacobi else 6)
    out = np.empty((len(start), len(times), start.shape[1]))
    rates, span = carrying if carry_jacobi else plain, (0.0, float(times[-1]))
    # the end of the last step needs no dense output, which costs three more evaluations
    outputs = None if len(times) == 1 else times
    for ray, state in enumerate(start):
        found = solve_ivp(rates, span, state, method="DOP853", t_eval=outputs, rtol=rtol, atol=rtol)
        if not found.success:
            raise IntegrationError(f"scipy stopped on ray {ray}: {found.message}")
        out[ray] = found.y.T[-len(times) :]
    return out


class HeyokaFlow:
    """The flow by heyoka's adaptive Taylor series, eight rays at a time in the lanes of AVX-512.

    Lanes with ``carry_jacobi`` are x, p, J, J' and, on the convex ellipsoid, A. On the other bodies A is left out, to
    heyoka's advantage: with ``heyoka.select`` its series step over the kink of max(kappa_n, 0)^(2/3) without seeing
    it, and A is off by up to 5e-2 at t = 8 whatever the tolerance.

    Parameters
    ----------
    body : Ellipsoid, Torus or TwistedEllipsoid, without speed
    tolerance : float
        Sets the order of the series, ceil(1 - log(tolerance)/2); steps follow from the series alone.
    carry_jacobi : bool
        Carry J, J' and, where kappa_n > 0 everywhere, A too.
    batch : int
        Rays that advance together; 8 is ``heyoka.recommended_simd_size()`` with AVX-512.
    """

    def __init__(self, body: Any, *, tolerance: float, carry_jacobi: bool = False, batch: int = 8) -> None:
        heyoka = import_module("heyoka")
        self.tolerance, self.batch = tolerance, batch
        x, y, z, u, v, w, j, dj, _a = lanes = heyoka.make_vars("x", "y", "z", "u", "v", "w", "j", "dj", "a")
        gx, gy, gz, bent, square, gauss = equations(body, heyoka)(x, y, z, u, v, w)
        turn = bent / square
        rates = [u, v, w, -turn * gx, -turn * gy, -turn * gz]
        if carry_jacobi:
            rates += [dj, -gauss * j]
            if isinstance(body, Ellipsoid):
                rates.append((bent * turn) ** (1 / 3))
        self.lanes = len(rates)
        self._integrator = heyoka.taylor_adaptive_batch(
            list(zip(lanes, rates, strict=False)),
            np.zeros((self.lanes, batch)),
            tol=tolerance,
            compact_mode=False,
            # a tenth faster, the errors the same to eight digits
            fast_math=True,
            force_avx512=True,
        )
        self.order = int(self._integrator.order)

    def flow(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """Advance (x, p) in lanes 0 to 5 to the ascending times (m,), the last > 0: (n, 6 or more) -> (n, m, lanes)."""
        start = _start(states, self.lanes)
        # the last batch is filled up with its last ray
        padded = np.pad(start, ((0, -len(start) % self.batch), (0, 0)), mode="edge")
        out = np.empty((len(padded), len(times), self.lanes))
        # heyoka's grid begins at the present time
        first = 0 if times[0] == 0 else 1
        grid = np.repeat(np.concatenate([np.zeros(first), times])[:, None], self.batch, axis=1)
        integrator, end = self._integrator, float(times[-1])
        for k in range(0, len(padded), self.batch):
            block = slice(k, k + self.batch)
            integrator.state[:] = padded[block].T
            integrator.set_time(0.0)
            if len(times) == 1:
                integrator.propagate_until(end)
                out[block, 0] = integrator.state.T
            else:
                out[block] = integrator.propagate_grid(grid)[1][first:].transpose(2, 0, 1)
        if not np.all(np.isfinite(out)):
            raise IntegrationError(f"heyoka left the finite numbers at tolerance {self.tolerance:g}")
        return out[: len(start)]


def heyoka_at_error(
    body: Any, states: FloatArray, times: FloatArray, exact: FloatArray, target: float, carry_jacobi: bool
) -> HeyokaFlow:
    """HeyokaFlow of the lowest order whose rms error of (x, p) at the last time, against exact, is <= target.

    Raises
    ------
    ValueError
        If rounding keeps it from the target.
    """
    (low, high), best = ORDERS, None
    while low <= high:
        order = (low + high) // 2
        # steps depend on the tolerance through the order only: one tolerance per order says all
        flow = HeyokaFlow(body, tolerance=math.exp(2.5 - 2 * order), carry_jacobi=carry_jacobi)
        gap = flow.flow(states, times[-1:])[:, -1, :6] - exact[:, -1, :6]
        if float(np.sqrt(np.mean(np.sum(gap * gap, axis=1)))) <= target:
            high, best = order - 1, flow
        else:
            low = order + 1
    if best is None:
        raise ValueError(f"no order up to {ORDERS[1]} reaches an rms error of {target:g}")
    return best


def seconds_of(call: Callable[[], object], repeats: int) -> float:
    """Least processor time of the calls after one for warming up, s."""
    call()
    least = math.inf
    for _ in range(repeats):
        started = time.process_time()
        call()
        least = min(least, time.process_time() - started)
    return least


def _start(states: FloatArray, lanes: int) -> FloatArray:
    """States (n, lanes) of (x, p) with J = 1, J' = 0 and A = 0."""
    start = np.zeros((len(states), lanes))
    start[:, :6] = states[:, :6]
    start[:, 6:7] = 1.0
    return start
