"""Compiled twins of `scatterers._radial.RadialMap`; importing this module imports numba.

Parameters are those of the spline, `scatterers._tensor_spline`: entries 9 to 11 are the centre, 12 to 14 the half axes.
"""

import math

from numba import njit

from scatterers._compile import OPTIONS
from scatterers._frames import cube_tangents, fill_frame
from scatterers._spline_constants import ITERATIONS, SMALL
from scatterers._tensor_kernels import value_and_gradient


@njit(**OPTIONS)
def _exit(y, parameters):  # type: ignore[no-untyped-def]
    """Largest r for which c + r y is in the grid's box."""
    largest = math.inf
    for axis in range(3):
        below = parameters[3 + axis] - parameters[9 + axis]
        above = below + (parameters[axis] - 5.0) / parameters[6 + axis]
        if y[axis] > 0.0:
            largest = min(largest, above / y[axis])
        elif y[axis] < 0.0:
            largest = min(largest, below / y[axis])
    return largest


@njit(**OPTIONS)
def _radius(y, parameters):  # type: ignore[no-untyped-def]
    """Root r of F(c + r y), NaN if none is found."""
    cx, cy, cz = parameters[9], parameters[10], parameters[11]
    low, high = 0.0, _exit(y, parameters)
    r = min(1.0, 0.5 * high)
    for _ in range(ITERATIONS):
        value, gx, gy, gz = value_and_gradient(cx + r * y[0], cy + r * y[1], cz + r * y[2], parameters)
        if value > 0.0:
            high = min(high, r)
        else:
            low = max(low, r)
        step = -value / (gx * y[0] + gy * y[1] + gz * y[2])
        if abs(step) <= SMALL * r:
            return r + step
        inside = r + step > low and r + step < high
        r = r + step if inside else 0.5 * (low + high)
    return math.nan


def forward(s, points, derivatives, parameters):  # type: ignore[no-untyped-def]
    """Points and derivatives of psi for a block; the compiled twin of forward and derivative."""
    cx, cy, cz = parameters[9], parameters[10], parameters[11]
    a, b, c = parameters[12], parameters[13], parameters[14]
    for i in range(s.shape[1]):
        y = (a * s[0, i], b * s[1, i], c * s[2, i])
        r = _radius(y, parameters)
        x0, x1, x2 = cx + r * y[0], cy + r * y[1], cz + r * y[2]
        # the gradient anew: at the last iterate it is off by a Newton step
        _, gx, gy, gz = value_and_gradient(x0, x1, x2, parameters)
        scale = r / (gx * y[0] + gy * y[1] + gz * y[2])
        gx, gy, gz = scale * a * gx, scale * b * gy, scale * c * gz
        points[0, i], points[1, i], points[2, i] = x0, x1, x2
        derivatives[0, i], derivatives[1, i], derivatives[2, i] = r * a - y[0] * gx, -y[0] * gy, -y[0] * gz
        derivatives[3, i], derivatives[4, i], derivatives[5, i] = -y[1] * gx, r * b - y[1] * gy, -y[1] * gz
        derivatives[6, i], derivatives[7, i], derivatives[8, i] = -y[2] * gx, -y[2] * gy, r * c - y[2] * gz


def inverse(points, s, parameters):  # type: ignore[no-untyped-def]
    """psi^-1 of a block; the compiled twin of inverse."""
    cx, cy, cz = parameters[9], parameters[10], parameters[11]
    a, b, c = 1 / parameters[12], 1 / parameters[13], 1 / parameters[14]
    for i in range(points.shape[1]):
        x, y, z = a * (points[0, i] - cx), b * (points[1, i] - cy), c * (points[2, i] - cz)
        scale = 1.0 / math.sqrt(x * x + y * y + z * z)
        s[0, i], s[1, i], s[2, i] = scale * x, scale * y, scale * z


def locate(points, chart, uv, frame, parameters):  # type: ignore[no-untyped-def]
    """Chart, chart variables and isometric frame of points on the body; the compiled twin of locate and polar_frame.

    The frame does not see the factor r of d psi/ds, nor the length of y, so x - c serves for y.
    """
    a, b, c = parameters[12], parameters[13], parameters[14]
    for i in range(points.shape[1]):
        x, y, z = points[0, i], points[1, i], points[2, i]
        _, gx, gy, gz = value_and_gradient(x, y, z, parameters)
        x, y, z = x - parameters[9], y - parameters[10], z - parameters[11]
        chart[i], uv[0, i], uv[1, i], tx, ty, tz, wx, wy, wz = cube_tangents(x / a, y / b, z / c)
        tx, ty, tz, wx, wy, wz = a * tx, b * ty, c * tz, a * wx, b * wy, c * wz
        scale = 1.0 / (gx * x + gy * y + gz * z)
        t, w = scale * (gx * tx + gy * ty + gz * tz), scale * (gx * wx + gy * wy + gz * wz)
        fill_frame(frame, i, tx - t * x, ty - t * y, tz - t * z, wx - w * x, wy - w * y, wz - w * z)
