"""cos(pi z), sin(pi z) and the angle of a vector by polynomials: compilers vectorise them, and only call a library's.

z = k + r with k the nearest integer, |r| <= 1/2 exactly; cos(pi z) = (-1)^k sum_j (-1)^j (pi r)^(2j)/(2j)!, the sine
likewise. The Taylor sums end where (pi/2)^m/m! < 2e-17, so rounding, some 2e-16, is all that is left.

The angle is 1/2 pi times arctan z = z - z^3/3 + ..., |z| <= tan(pi/8), by a polynomial with an error below rounding:
arctan(a/b) = pi/4 + arctan((a - b)/(a + b)) for larger ones.

The series are those of [AS64, sec. 4.3].

Also here: parts of compiled locators: chart variables and tangents of the cube sphere, and the polar frame.

With t = tan xi, t' = tan eta of the face (see `scatterers.sphere_map.star`) and a common factor left out, which no
frame sees,

    s_u = (-p, du - t p, -t' p) in (a, b, c) up to signs,  p = t du/(1 + t^2 + t'^2),  du = 1 + t^2,

and s_v likewise. The frame of tangents T is T (T^T T)^(-1/2), by the closed root of a 2 x 2 matrix.

Sources: Derivations, B1 and B2.
"""

import math

import numpy as np
from numpy.typing import NDArray

from scatterers.kernels.compiled import helper

_COS: tuple[float, ...] = tuple((-1) ** j * math.pi ** (2 * j) / math.factorial(2 * j) for j in range(12))
_SIN: tuple[float, ...] = tuple((-1) ** j * math.pi ** (2 * j + 1) / math.factorial(2 * j + 1) for j in range(11))

_TAN_PI_8 = math.tan(math.pi / 8)
_ATAN: tuple[float, ...] = (
    -0.33333333333328435,
    0.19999999998854168,
    -0.14285714180900647,
    0.11111106177375227,
    -0.09090773003240828,
    0.07689952488233016,
    -0.066402251735395,
    0.0568830340363325,
    -0.04347919839046537,
    0.021133752033748364,
)


@helper
def cos_pi(z: float) -> float:
    """cos(pi z) of a number."""
    nearest = math.floor(z + 0.5)
    r = z - nearest
    r2 = r * r
    total = _COS[11]
    for j in range(10, -1, -1):
        total = total * r2 + _COS[j]
    return total * (1.0 - 2.0 * (nearest - 2.0 * math.floor(0.5 * nearest)))


@helper
def sin_pi(z: float) -> float:
    """sin(pi z) of a number."""
    nearest = math.floor(z + 0.5)
    r = z - nearest
    r2 = r * r
    total = _SIN[10]
    for j in range(9, -1, -1):
        total = total * r2 + _SIN[j]
    return total * r * (1.0 - 2.0 * (nearest - 2.0 * math.floor(0.5 * nearest)))


@helper
def turns(across: float, along: float) -> float:
    """atan2(across, along) in turns, in [-1/2, 1/2]; 0 of a vector that vanishes."""
    a, b = abs(across), abs(along)
    low, high = min(a, b), max(a, b)
    steep = low > _TAN_PI_8 * high
    top = low - high if steep else low
    bottom = low + high if steep else high
    z = top / (bottom if bottom > 0.0 else 1.0)
    s = z * z
    total = _ATAN[9]
    for j in range(8, -1, -1):
        total = total * s + _ATAN[j]
    angle = (z + z * s * total) * (0.5 / math.pi)
    angle = angle + 0.125 if steep else angle
    angle = 0.25 - angle if a > b else angle
    angle = 0.5 - angle if along < 0.0 else angle
    return -angle if across < 0.0 else angle


@helper
def cube_tangents(
    sx: float, sy: float, sz: float
) -> tuple[int, float, float, float, float, float, float, float, float]:
    """Chart number, u, v and the directions s_u and s_v at a point of the sphere, whose length is free."""
    s = (sx, sy, sz)
    size = (abs(sx), abs(sy), abs(sz))
    a = 0 if size[0] >= size[1] and size[0] >= size[2] else (1 if size[1] >= size[2] else 2)
    b, c = (a + 1) % 3, (a + 2) % 3
    sign = -1.0 if s[a] < 0 else 1.0
    tan_u, tan_v = s[b] / s[a], s[c] / size[a]
    number = 2 * a + (1 if s[a] < 0 else 0)
    u = math.atan(tan_u) / (math.pi / 2) + 0.5
    v = math.atan(tan_v) / (math.pi / 2) + 0.5
    # tangents of the cube, (0, sign du, 0) and (0, 0, dv), less their part along s
    norm2 = 1.0 + tan_u * tan_u + tan_v * tan_v
    du, dv = 1.0 + tan_u * tan_u, 1.0 + tan_v * tan_v
    p = tan_u * du / norm2
    q = tan_v * dv / norm2
    ta, tb, tc = -sign * p, sign * (du - tan_u * p), -tan_v * p
    wa, wb, wc = -sign * q, -sign * tan_u * q, dv - tan_v * q
    if a == 0:
        return number, u, v, ta, tb, tc, wa, wb, wc
    if a == 1:
        return number, u, v, tc, ta, tb, wc, wa, wb
    return number, u, v, tb, tc, ta, wb, wc, wa


@helper
def fill_frame(
    frame: NDArray[np.float64], i: int, tx: float, ty: float, tz: float, wx: float, wy: float, wz: float
) -> None:
    """Write the polar frame of two tangents into column i of frame (6, n)."""
    g11 = tx * tx + ty * ty + tz * tz
    g12 = tx * wx + ty * wy + tz * wz
    g22 = wx * wx + wy * wy + wz * wz
    root = math.sqrt(g11 * g22 - g12 * g12)
    scale = 1.0 / (root * math.sqrt(g11 + g22 + 2 * root))
    m11, m12, m22 = (g22 + root) * scale, -g12 * scale, (g11 + root) * scale
    frame[0, i] = tx * m11 + wx * m12
    frame[1, i] = ty * m11 + wy * m12
    frame[2, i] = tz * m11 + wz * m12
    frame[3, i] = tx * m12 + wx * m22
    frame[4, i] = ty * m12 + wy * m22
    frame[5, i] = tz * m12 + wz * m22
