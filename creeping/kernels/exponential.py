"""The exponential by a polynomial, which compilers vectorise where they only call a library's function.

    e^x = 2^n e^r,   n = floor(x/ln 2 + 1/2),   r = x - n ln 2 in two parts of ln 2,   |r| <= (ln 2)/2

with Taylor's polynomial of e^r, which ends below rounding; 2^n is put together from its bits.

Also here: the cube root by Newton's method without a division, which compilers vectorise: a library's power they only
call.

    r <- r (4 - x r^3)/3 tends to x^(-1/3),   x^(1/3) = x r^2

from a guess whose bits are about those of x over -3.

Also here: what kernels need of the gradient g and the Hessian H of F at a point; see `creeping.geometry.curvature`.

    p.Hp       = p_i p_j H_ij        kappa_n = p.Hp/|g|
    g.adj(H)g  = g_i g_j adj(H)_ij   K = (g.adj(H)g)/|g|^4
    G^(-1/2)   of a 2 x 2 matrix G, which makes the tangents of a chart its polar frame

Scalars in, scalars out: they are inlined, and the loops over a block around them vectorise. The first two take
`creeping.kernels.vectors` as well, which know no constants.

Also here: angles in turns by polynomials, which compilers vectorise where they only call a library's functions.

With t reduced to -1/2..1/2, s = sin(pi t) and c = cos(pi t) by their Taylor polynomials, which end below rounding,
cos 2 pi t = 1 - 2 s^2 and sin 2 pi t = 2 s c. The angle of a vector by arctan z = z + z^3 P(z^2), |z| <= tan(pi/8);
both are good to rounding.

Sources: [AS64, sec. 4.2]; [AS64, sec. 3.9] for Newton's method; [G05], [H86]; Derivations, R1 and B2; [AS64, sec. 4.3].
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import options, strict_options

INVERSE_FACTORIALS = tuple(1 / math.factorial(n) for n in range(14))
LEAST = 1e-90
"""Cube roots are of no less: the root of less is one of 0, to 1e-30."""
SINE = tuple((-1.0) ** j * math.pi ** (2 * j + 1) / math.factorial(2 * j + 1) for j in range(10))
COSINE = tuple((-1.0) ** j * math.pi ** (2 * j) / math.factorial(2 * j) for j in range(11))
"""Coefficients of sin(pi t)/t and cos(pi t) in powers of t^2."""


# to the letter: sums that may be reordered would put the two parts of ln 2 together
@njit(**strict_options, forceinline=True)
def exponential(x):
    """e^x, to 4e-16 of itself."""
    # beyond, e^x is no number, or nothing
    x = min(max(x, -700.0), 700.0)
    n = math.floor(x * (1 / math.log(2.0)) + 0.5)
    # the upper part of ln 2 has 32 zeros at its end: n times it is exact
    r = (x - n * 0.693147180369123816490) - n * 1.90821492927058770002e-10
    c = INVERSE_FACTORIALS
    p = c[8] + r * (c[9] + r * (c[10] + r * (c[11] + r * (c[12] + r * c[13]))))
    p = 1.0 + r * (1.0 + r * (c[2] + r * (c[3] + r * (c[4] + r * (c[5] + r * (c[6] + r * (c[7] + r * p)))))))
    # a whole number added to 1.5 2^52 stands in its last bits
    power = (np.float64(n + 1.5 * 2.0**52).view(np.int64) << 52) + (np.int64(1023) << 52)
    return p * np.int64(power).view(np.float64)


@njit(**options)
def wave(real, imaginary):
    """Real and imaginary part of e^(a + ib)."""
    size = exponential(real)
    cosine, sine = cosine_sine(imaginary * (0.5 / math.pi))
    return size * cosine, size * sine


# to the letter: sums that may be reordered would undo the guess
@njit(**strict_options, forceinline=True)
def cube_root(x):
    """x^(1/3) to 8e-16 of itself for LEAST <= x <= 1e90, 0 below."""
    inside = min(max(x, LEAST), 1e90)
    # a whole number added to 2^52 stands in its last bits
    whole = 2.0**52
    bits = (np.float64(inside).view(np.int64) >> 32) + np.float64(whole).view(np.int64)
    high = np.int64(bits).view(np.float64) - whole
    # upper half of the guess's bits at x whose own are 0; the last term makes errors of both signs alike
    most = 4.0 / 3.0 * 1023 * 2.0**20 - 0.1035 * 2.0**20
    guess = np.float64(np.floor(most - high * (1 / 3)) + whole).view(np.int64) << 32
    r = np.int64(guess).view(np.float64)
    for _ in range(5):
        r = r * (4.0 - inside * r * r * r) * (1 / 3)
    root = inside * r * r
    return root if x >= LEAST else 0.0


@njit(**options)
def second_form(px, py, pz, xx, yy, zz, yz, xz, xy):
    """p.Hp, with the entries of H in the order of the evaluators."""
    mixed = py * pz * yz + px * pz * xz + px * py * xy
    return px * px * xx + py * py * yy + pz * pz * zz + (mixed + mixed)


@njit(**options)
def adjugate_form(gx, gy, gz, xx, yy, zz, yz, xz, xy):
    """g.adj(H) g, with the entries of H in the order of the evaluators."""
    total = gx * gx * (yy * zz - yz * yz) + gy * gy * (xx * zz - xz * xz) + gz * gz * (xx * yy - xy * xy)
    mixed = gy * gz * (xy * xz - xx * yz) + gx * gz * (xy * yz - yy * xz) + gx * gy * (xz * yz - zz * xy)
    return total + (mixed + mixed)


@njit(**options)
def inverse_root(g11, g12, g22):
    """Entries 11, 12, 22 of G^(-1/2): (adj G + s)/(s t) with s = sqrt(det G), t = sqrt(tr G + 2 s)."""
    s = math.sqrt(g11 * g22 - g12 * g12)
    scale = 1.0 / (s * math.sqrt(g11 + g22 + 2.0 * s))
    return (g22 + s) * scale, -g12 * scale, (g11 + s) * scale


@njit(**options)
def turns(across, along):
    """Angle atan2(across, along) in turns, in [0, 1); libm's atan2 does not vectorise."""
    a, b = abs(across), abs(along)
    low, high = min(a, b), max(a, b)
    # atan(low/high) = pi/4 + atan((low - high)/(low + high)) keeps the argument below tan(pi/8)
    steep = low > (math.sqrt(2.0) - 1.0) * high
    top = low - high if steep else low
    bottom = low + high if steep else high
    z = top / (bottom if bottom > 0.0 else 1.0)
    s = z * z
    r = -0.04347919839046537 + s * 0.021133752033748364
    r = 0.0568830340363325 + s * r
    r = -0.066402251735395 + s * r
    r = 0.07689952488233016 + s * r
    r = -0.09090773003240828 + s * r
    r = 0.11111106177375227 + s * r
    r = -0.14285714180900647 + s * r
    r = 0.19999999998854168 + s * r
    r = -0.33333333333328435 + s * r
    angle = (z + z * s * r) * (0.5 / math.pi)
    angle = angle + 0.125 if steep else angle
    angle = 0.25 - angle if a > b else angle
    angle = 0.5 - angle if along < 0.0 else angle
    angle = 1.0 - angle if across < 0.0 else angle
    return angle - 1.0 if angle >= 1.0 else angle


@njit(**options)
def cosine_sine(turns):
    """Cosine and sine of an angle in turns."""
    t = turns - math.floor(turns + 0.5)
    z = t * t
    a, b = SINE, COSINE
    s = a[4] + z * (a[5] + z * (a[6] + z * (a[7] + z * (a[8] + z * a[9]))))
    s = a[0] + z * (a[1] + z * (a[2] + z * (a[3] + z * s)))
    c = b[5] + z * (b[6] + z * (b[7] + z * (b[8] + z * (b[9] + z * b[10]))))
    c = b[0] + z * (b[1] + z * (b[2] + z * (b[3] + z * (b[4] + z * c))))
    s *= t
    return 1.0 - 2.0 * s * s, 2.0 * s * c
