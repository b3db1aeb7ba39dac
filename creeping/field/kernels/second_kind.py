"""Compiled sums over currents at nodes y of what the rest of a body sends to points x of its surface.

    u(x) = sum_y h [a_y + b_y n.(x - y) (1/R - ik)/R] e^{ikR}/R,   R = |x - y|

with n that of y, or of x for du/dn of a soft body, which asks for -dG/dn_x. h is 1 for nodes that share the phase of
x; of others h = 1 - e^{-(kR)^2} leaves out those that x stands on. Of a node that is x itself the static part, 1/R, is
left out.

Source: Derivations, F30.
"""

import math

from numba import njit

from creeping.kernels.block import entry_options
from creeping.kernels.turns import cosine_sine

TOUCHING = 1e-6
"""Distance, over 1/k, below which a node is the point itself."""


@njit(**entry_options)
def from_nodes(x, normals, y, sides, alike, single, double, k, near, soft, first, last, out):
    """Fill rows first..last of out (m, 2): the real and imaginary part of u.

    Points x and their normals (3, m), nodes y and theirs ``sides`` (3, n), single and double (2, n) the weights a and
    b, real before imaginary parts; ``alike`` (n,) matters up to the distances ``near`` (m,).
    """
    per, touching = k / (2 * math.pi), (TOUCHING / k) ** 2
    for j in range(first, last):
        close = max(near[j] ** 2, touching)
        x0, x1, x2 = x[0, j], x[1, j], x[2, j]
        n0, n1, n2 = normals[0, j], normals[1, j], normals[2, j]
        p, q = 0.0, 0.0
        for i in range(y.shape[1]):
            dx, dy, dz = x0 - y[0, i], x1 - y[1, i], x2 - y[2, i]
            square = dx * dx + dy * dy + dz * dz
            inverse = 1.0 / math.sqrt(max(square, close))
            w = inverse if square > close else 0.0
            across = sides[0, i] * dx + sides[1, i] * dy + sides[2, i] * dz
            lean = (n0 * dx + n1 * dy + n2 * dz if soft else across) * inverse
            c, s = cosine_sine(per / inverse)
            a = single[0, i] + lean * (double[0, i] * inverse + double[1, i] * k)
            b = single[1, i] + lean * (double[1, i] * inverse - double[0, i] * k)
            p += w * (a * c - b * s)
            q += w * (a * s + b * c)
        for i in range(y.shape[1]):
            dx, dy, dz = x0 - y[0, i], x1 - y[1, i], x2 - y[2, i]
            square = dx * dx + dy * dy + dz * dz
            if square > close:
                continue
            if square <= touching:
                # (e^{ikR} - 1)/R is ik there
                if alike[i]:
                    p -= k * single[1, i]
                    q += k * single[0, i]
                continue
            inverse = 1.0 / math.sqrt(square)
            across = sides[0, i] * dx + sides[1, i] * dy + sides[2, i] * dz
            lean = (n0 * dx + n1 * dy + n2 * dz if soft else across) * inverse
            c, s = cosine_sine(per / inverse)
            a = single[0, i] + lean * (double[0, i] * inverse + double[1, i] * k)
            b = single[1, i] + lean * (double[1, i] * inverse - double[0, i] * k)
            h = inverse * (1.0 if alike[i] else 1.0 - math.exp(-square * k * k))
            p += h * (a * c - b * s)
            q += h * (a * s + b * c)
        out[j, 0], out[j, 1] = p, q
