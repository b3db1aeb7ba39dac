"""Compiled matrices of the sums over nodes y at points x, by all pairs.

f_x g_y times one of

    dG/dn_y + s_y G,    dG/dn_x,    s_y G,    p.[grad_x G (n_x.q) - q (n_x.grad_x G)]

G = e^{ikR}/R, R = |x - y|; p is one of two tangents at x, q one of two at y. A node that is x itself gives nothing.

Sources: [CK13, sec. 3.1 and 6.2]; Derivations, F36.
"""

import math

from numba import njit

from creeping.kernels.block import entry_options
from creeping.kernels.turns import cosine_sine


@njit(**entry_options)
def scalar_pairs(x, n, f, y, sides, g, single, k, tilt, first, last, out):
    """Fill rows first..last of out (m, nodes, 2): real and imaginary parts.

    Points x and normals n (3, m), nodes y and theirs ``sides`` (3, nodes). ``tilt`` is 0 for G alone, 1 for dG/dn_y, 2
    for dG/dn_x; ``single`` (2, nodes) is s, or has no column.
    """
    per, count, layer = k / (2 * math.pi), y.shape[1], single.shape[1] > 0
    for i in range(first, last):
        x0, x1, x2 = x[0, i], x[1, i], x[2, i]
        n0, n1, n2 = n[0, i], n[1, i], n[2, i]
        for j in range(count):
            d0, d1, d2 = x0 - y[0, j], x1 - y[1, j], x2 - y[2, j]
            square = d0 * d0 + d1 * d1 + d2 * d2
            there = 1.0 if square > 0.0 else 0.0
            inverse = there / math.sqrt(square if square > 0.0 else 1.0)
            c, s = cosine_sine(per * square * inverse)
            c, s = c * inverse, s * inverse
            # grad_x G = (ik - 1/R) G (x - y)/R
            lean = 0.0
            if tilt == 1:
                lean = -(sides[0, j] * d0 + sides[1, j] * d1 + sides[2, j] * d2) * inverse
            elif tilt == 2:
                lean = (n0 * d0 + n1 * d1 + n2 * d2) * inverse
            real, imaginary = lean * (-c * inverse - k * s), lean * (k * c - s * inverse)
            if layer:
                real += single[0, j] * c - single[1, j] * s
                imaginary += single[0, j] * s + single[1, j] * c
            scale = f[i] * g[j]
            out[i, j, 0], out[i, j, 1] = scale * real, scale * imaginary


@njit(**entry_options)
def vector_pairs(x, n, a, b, f, y, c, e, g, k, first, last, out):
    """Fill rows first..last of out (m, 2, nodes, 2, 2): p = a, b (3, m) and q = c, e (3, nodes), and both parts."""
    per, count = k / (2 * math.pi), y.shape[1]
    for i in range(first, last):
        for j in range(count):
            d0, d1, d2 = x[0, i] - y[0, j], x[1, i] - y[1, j], x[2, i] - y[2, j]
            square = d0 * d0 + d1 * d1 + d2 * d2
            there = 1.0 if square > 0.0 else 0.0
            inverse = there / math.sqrt(square if square > 0.0 else 1.0)
            cosine, sine = cosine_sine(per * square * inverse)
            scale = f[i] * g[j] * inverse * inverse
            real, imaginary = scale * (-cosine * inverse - k * sine), scale * (k * cosine - sine * inverse)
            lean = n[0, i] * d0 + n[1, i] * d1 + n[2, i] * d2
            ad, bd = a[0, i] * d0 + a[1, i] * d1 + a[2, i] * d2, b[0, i] * d0 + b[1, i] * d1 + b[2, i] * d2
            nc = n[0, i] * c[0, j] + n[1, i] * c[1, j] + n[2, i] * c[2, j]
            ne = n[0, i] * e[0, j] + n[1, i] * e[1, j] + n[2, i] * e[2, j]
            ac = a[0, i] * c[0, j] + a[1, i] * c[1, j] + a[2, i] * c[2, j]
            ae = a[0, i] * e[0, j] + a[1, i] * e[1, j] + a[2, i] * e[2, j]
            bc = b[0, i] * c[0, j] + b[1, i] * c[1, j] + b[2, i] * c[2, j]
            be = b[0, i] * e[0, j] + b[1, i] * e[1, j] + b[2, i] * e[2, j]
            h0, h1, h2, h3 = ad * nc - ac * lean, ad * ne - ae * lean, bd * nc - bc * lean, bd * ne - be * lean
            out[i, 0, j, 0, 0], out[i, 0, j, 0, 1] = real * h0, imaginary * h0
            out[i, 0, j, 1, 0], out[i, 0, j, 1, 1] = real * h1, imaginary * h1
            out[i, 1, j, 0, 0], out[i, 1, j, 0, 1] = real * h2, imaginary * h2
            out[i, 1, j, 1, 0], out[i, 1, j, 1, 1] = real * h3, imaginary * h3
