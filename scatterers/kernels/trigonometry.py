"""cos(pi z), sin(pi z) and the angle of a vector by polynomials: compilers vectorise them, and only call a library's.

z = k + r with k the nearest integer, |r| <= 1/2 exactly; cos(pi z) = (-1)^k sum_j (-1)^j (pi r)^(2j)/(2j)!, the sine
likewise. The Taylor sums end where (pi/2)^m/m! < 2e-17, so rounding, some 2e-16, is all that is left.

The angle is 1/2 pi times arctan z = z - z^3/3 + ..., |z| <= tan(pi/8), by a polynomial with an error below rounding:
arctan(a/b) = pi/4 + arctan((a - b)/(a + b)) for larger ones.

The series are those of [AS64, sec. 4.3].
"""

import math

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
