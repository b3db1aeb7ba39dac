"""cos(pi z) and sin(pi z) by polynomials, which compilers vectorise where they only call a library's cos and sin.

z = k + r with k the nearest integer, |r| <= 1/2 exactly; cos(pi z) = (-1)^k sum_j (-1)^j (pi r)^(2j)/(2j)!, the sine
likewise. The Taylor sums end where (pi/2)^m/m! < 2e-17, so rounding, some 2e-16, is all that is left.

The series are those of [AS64, sec. 4.3].
"""

import math

from scatterers.kernels.compiled import helper

_COS: tuple[float, ...] = tuple((-1) ** j * math.pi ** (2 * j) / math.factorial(2 * j) for j in range(12))
_SIN: tuple[float, ...] = tuple((-1) ** j * math.pi ** (2 * j + 1) / math.factorial(2 * j + 1) for j in range(11))


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
