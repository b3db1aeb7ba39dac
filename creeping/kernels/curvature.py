"""What kernels need of the gradient g and the Hessian H of F at a point; see `creeping.geometry.curvature`.

    p.Hp       = p_i p_j H_ij        kappa_n = p.Hp/|g|
    g.adj(H)g  = g_i g_j adj(H)_ij   K = (g.adj(H)g)/|g|^4
    G^(-1/2)   of a 2 x 2 matrix G, which makes the tangents of a chart its polar frame

Scalars in, scalars out: they are inlined, and the loops over a block around them vectorise. The first two take
`creeping.kernels.vectors` as well, which know no constants.

Sources: [G05], [H86]; Derivations, R1 and B2.
"""

import math

from numba import njit

from creeping.kernels.block import options


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
