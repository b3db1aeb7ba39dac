"""Compiled composition of maps on bodies x = psi(s), s on the unit sphere.

The state of a ray is the unit quaternion r = (w, x, y, z) of the rotation R = [s, q, s x q], q the direction

    A = d psi [e1, e2],  G = A^T A,   q = [e1, e2] G^(-1/2) A^T p,   p = A G^(-1/2) [e1, e2]^T q

for any orthonormal basis e1, e2 of the plane across s. A map stores the displacement Q(s, q) of the flow, r' = r Q, on
six stereographic charts: with (a, b, c) cyclic, a the largest component of s, (s_a, s_b) both multiplied by its sign,

    u = s_b/(1 + s_a),  v = s_c/(1 + s_a),   angle = atan2(q_c - v q_a, q_b - u q_a),   |u|, |v| <= sqrt(2) - 1.

Also here: block functions of maps on bodies with one doubly periodic chart (the torus).

The tangent frames of the chart cover the body, so (u, v, angle), all in turns and none of them cut, are coordinates of
the whole bundle, and a map stores their displacement. The frame is the orthogonal polar factor of (x_u, x_v).

Sources: Derivations, R15 and B2.
"""

import math

from numba import njit

from creeping.kernels.block import BLOCK, aligned, entry_options, options
from creeping.kernels.exponential import cosine_sine, inverse_root, turns

REACH = math.sqrt(2) - 1
"""Largest |u|, |v| that a chart must cover."""


@njit(**options)
def columns(r, s, q):
    """First two columns s, q (3, BLOCK) of the rotations r (4, BLOCK), all flat."""
    for i in range(BLOCK):
        w, x, y, z = r[i], r[BLOCK + i], r[2 * BLOCK + i], r[3 * BLOCK + i]
        s[i] = 1.0 - 2.0 * (y * y + z * z)
        s[BLOCK + i] = 2.0 * (x * y + w * z)
        s[2 * BLOCK + i] = 2.0 * (x * z - w * y)
        q[i] = 2.0 * (x * y - w * z)
        q[BLOCK + i] = 1.0 - 2.0 * (x * x + z * z)
        q[2 * BLOCK + i] = 2.0 * (y * z + w * x)


@njit(**options)
def face(s, q, chart, u, v, along, across):
    """Chart, u and v of s, and the components of q along the coordinate lines there; all of a block, s and q flat."""
    for i in range(BLOCK):
        sx, sy, sz = s[i], s[BLOCK + i], s[2 * BLOCK + i]
        qx, qy, qz = q[i], q[BLOCK + i], q[2 * BLOCK + i]
        ax, ay, az = abs(sx), abs(sy), abs(sz)
        is_x = (ax >= ay) & (ax >= az)
        is_y = (ay >= az) & (not is_x)
        sa = sx if is_x else (sy if is_y else sz)
        sb = sy if is_x else (sz if is_y else sx)
        sc = sz if is_x else (sx if is_y else sy)
        qa = qx if is_x else (qy if is_y else qz)
        qb = qy if is_x else (qz if is_y else qx)
        qc = qz if is_x else (qx if is_y else qy)
        sign = -1.0 if sa < 0.0 else 1.0
        sb, qa, qb = sign * sb, sign * qa, sign * qb
        inverse = 1.0 / (1.0 + abs(sa))
        one, other = sb * inverse, sc * inverse
        chart[i] = (0 if is_x else (2 if is_y else 4)) + (1 if sa < 0.0 else 0)
        u[i], v[i] = one, other
        along[i], across[i] = qb - one * qa, qc - other * qa


@njit(**options)
def _fold(s, q, odd):
    """Reflect a block's s and q (3, BLOCK), flat, to s >= 0; odd (BLOCK,) is 1 where the number of mirrors is odd."""
    for i in range(BLOCK):
        odd[i] = 0.0
    for axis in range(3):
        at = axis * BLOCK
        for i in range(BLOCK):
            turned = s[at + i] < 0.0
            s[at + i] = abs(s[at + i])
            q[at + i] = -q[at + i] if turned else q[at + i]
            odd[i] = 1.0 - odd[i] if turned else odd[i]


@njit(**options)
def unfold(d, odd):
    """Turn displacements d (BLOCK, 4), flat, of reflected rays into those of the rays themselves.

    With the mirrors' product D = diag(1, 1, -1) in the ray's own frame it is D Q D, the quaternion (w, -x, -y, z).
    """
    for i in range(BLOCK):
        sign = 1.0 - 2.0 * odd[i]
        d[4 * i + 1] *= sign
        d[4 * i + 2] *= sign


@njit(**options)
def locate(r, work, chart, u, v, angle, folded):
    """Chart, u/REACH, v/REACH in [-1, 1] and angle in turns of a block.

    Folded, only the charts around +x, +y and +z are left, numbered 0 to 2, with u, v >= 0; row 7 of the work space
    says which rays an odd number of mirrors has reflected.
    """
    s, q, along, across = work[0:3].reshape(-1), work[3:6].reshape(-1), work[6], work[8]
    columns(r, s, q)
    if folded:
        _fold(s, q, work[7])
    face(s, q, chart, u, v, along, across)
    if folded:
        for i in range(BLOCK):
            chart[i] = chart[i] // 2
    else:
        for i in range(BLOCK):
            work[7, i] = 0.0
    for i in range(BLOCK):
        u[i] *= 1 / REACH
        v[i] *= 1 / REACH
    for i in range(BLOCK):
        angle[i] = turns(across[i], along[i])


@njit(**options)
def move_rotations(r, d, centre):
    """Compose the rotations r (4, BLOCK), flat, with displacements d (BLOCK, 4), flat, and normalise them."""
    c0, c1, c2, c3 = centre[0], centre[1], centre[2], centre[3]
    for i in range(BLOCK):
        w, x, y, z = r[i], r[BLOCK + i], r[2 * BLOCK + i], r[3 * BLOCK + i]
        a, b, c, e = d[4 * i] + c0, d[4 * i + 1] + c1, d[4 * i + 2] + c2, d[4 * i + 3] + c3
        nw = w * a - x * b - y * c - z * e
        nx = w * b + x * a + y * e - z * c
        ny = w * c - x * e + y * a + z * b
        nz = w * e + x * c - y * b + z * a
        scale = 1.0 / math.sqrt(nw * nw + nx * nx + ny * ny + nz * nz)
        r[i], r[BLOCK + i], r[2 * BLOCK + i], r[3 * BLOCK + i] = nw * scale, nx * scale, ny * scale, nz * scale


@njit(**options)
def _shape(derivative, s, q, first, second, root):
    """Columns A = d psi [q, s x q] of a block and the distinct entries of G^(-1/2), rows of the outputs."""
    for i in range(BLOCK):
        sx, sy, sz, qx, qy, qz = s[0, i], s[1, i], s[2, i], q[0, i], q[1, i], q[2, i]
        bx, by, bz = sy * qz - sz * qy, sz * qx - sx * qz, sx * qy - sy * qx
        g11, g12, g22 = 0.0, 0.0, 0.0
        for row in range(3):
            jx, jy, jz = derivative[3 * row, i], derivative[3 * row + 1, i], derivative[3 * row + 2, i]
            one, other = jx * qx + jy * qy + jz * qz, jx * bx + jy * by + jz * bz
            first[row, i], second[row, i] = one, other
            g11 += one * one
            g12 += one * other
            g22 += other * other
        root[0, i], root[1, i], root[2, i] = inverse_root(g11, g12, g22)


@njit(**options)
def read_block(rows, start, first, out):
    """Numbers rows[start:, first:] of a block into out (m, BLOCK); the last ray fills what is left of a block."""
    count = min(BLOCK, rows.shape[0] - start)
    for i in range(BLOCK):
        source = start + min(i, count - 1)
        for k in range(out.shape[0]):
            out[k, i] = rows[source, first + k]
    return count


@njit(**options)
def write_block(values, count, start, first, rows):
    """Numbers (m, BLOCK) of a block into rows[start:, first:]."""
    for i in range(count):
        for k in range(values.shape[0]):
            rows[start + i, first + k] = values[k, i]


@njit(**entry_options)
def to_rotations(there, there_par, back, back_par, states, rays):
    """Rotations rays[:, :4] of states (n, 6 or more)."""
    x, p, r, s, q = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK), aligned(3, BLOCK), aligned(3, BLOCK)
    image, derivative = aligned(3, BLOCK), aligned(9, BLOCK)
    first, second, root = aligned(3, BLOCK), aligned(3, BLOCK), aligned(3, BLOCK)
    for start in range(0, states.shape[0], BLOCK):
        count = read_block(states, start, 0, x)
        read_block(states, start, 3, p)
        back(x, s, back_par)
        there(s, image, derivative, there_par)
        for i in range(BLOCK):
            # any unit vector across s; the smallest component of s is the safest to cross with
            sx, sy, sz = s[0, i], s[1, i], s[2, i]
            if abs(sx) <= abs(sy) and abs(sx) <= abs(sz):
                ex, ey, ez = 0.0, sz, -sy
            elif abs(sy) <= abs(sz):
                ex, ey, ez = -sz, 0.0, sx
            else:
                ex, ey, ez = sy, -sx, 0.0
            norm = 1.0 / math.sqrt(ex * ex + ey * ey + ez * ez)
            q[0, i], q[1, i], q[2, i] = ex * norm, ey * norm, ez * norm
        _shape(derivative, s, q, first, second, root)
        for i in range(BLOCK):
            one = first[0, i] * p[0, i] + first[1, i] * p[1, i] + first[2, i] * p[2, i]
            other = second[0, i] * p[0, i] + second[1, i] * p[1, i] + second[2, i] * p[2, i]
            along = root[0, i] * one + root[1, i] * other
            across = root[1, i] * one + root[2, i] * other
            norm = 1.0 / math.sqrt(along * along + across * across)
            along, across = along * norm, across * norm
            sx, sy, sz = s[0, i], s[1, i], s[2, i]
            ex, ey, ez = q[0, i], q[1, i], q[2, i]
            qx = along * ex + across * (sy * ez - sz * ey)
            qy = along * ey + across * (sz * ex - sx * ez)
            qz = along * ez + across * (sx * ey - sy * ex)
            quaternion(sx, sy, sz, qx, qy, qz, r, i)
        write_block(r, count, start, 0, rays)


@njit(**options)
def quaternion(sx, sy, sz, qx, qy, qz, r, i):
    """Quaternion of the rotation with columns s, q, s x q, from the largest of its four components."""
    bx, by, bz = sy * qz - sz * qy, sz * qx - sx * qz, sx * qy - sy * qx
    w, x, y, z = 1.0 + sx + qy + bz, 1.0 + sx - qy - bz, 1.0 - sx + qy - bz, 1.0 - sx - qy + bz
    if w >= x and w >= y and w >= z:
        x, y, z = qz - by, bx - sz, sy - qx
    elif x >= y and x >= z:
        w, y, z = qz - by, qx + sy, bx + sz
    elif y >= z:
        w, x, z = bx - sz, qx + sy, by + qz
    else:
        w, x, y = sy - qx, bx + sz, by + qz
    norm = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
    r[0, i], r[1, i], r[2, i], r[3, i] = w * norm, x * norm, y * norm, z * norm


@njit(**entry_options)
def from_rotations(there, there_par, rows):
    """States rows[:, :6] of the rotations that stand in rows[:, :4]."""
    x, p, r, s, q = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK), aligned(3, BLOCK), aligned(3, BLOCK)
    derivative = aligned(9, BLOCK)
    first, second, root = aligned(3, BLOCK), aligned(3, BLOCK), aligned(3, BLOCK)
    for start in range(0, rows.shape[0], BLOCK):
        count = read_block(rows, start, 0, r)
        columns(r.reshape(-1), s.reshape(-1), q.reshape(-1))
        there(s, x, derivative, there_par)
        _shape(derivative, s, q, first, second, root)
        for i in range(BLOCK):
            for k in range(3):
                p[k, i] = root[0, i] * first[k, i] + root[1, i] * second[k, i]
        write_block(x, count, start, 0, rows)
        write_block(p, count, start, 3, rows)


@njit(**options)
def locate_angles(r, chart, u, v, angle):
    """Chart 0 and u, v and angle in [0, 1) of a block."""
    for i in range(BLOCK):
        chart[i] = 0
    for i in range(BLOCK):
        u[i] = r[i] - math.floor(r[i])
    for i in range(BLOCK):
        v[i] = r[BLOCK + i] - math.floor(r[BLOCK + i])
    for i in range(BLOCK):
        angle[i] = r[2 * BLOCK + i] - math.floor(r[2 * BLOCK + i])


@njit(**options)
def move_angles(r, d, centre):
    """Add displacements d (BLOCK, 4), flat, to the coordinates r (4, BLOCK), flat."""
    c0, c1, c2 = centre[0], centre[1], centre[2]
    for i in range(BLOCK):
        r[i] += d[4 * i] + c0
        r[BLOCK + i] += d[4 * i + 1] + c1
        r[2 * BLOCK + i] += d[4 * i + 2] + c2


@njit(**options)
def _frame(derivative, frame):
    """Isometric frame (6, BLOCK) of a block's tangents, rows 0, 3, 6 and 1, 4, 7 of the derivative (9, BLOCK)."""
    for i in range(BLOCK):
        ux, uy, uz = derivative[0, i], derivative[3, i], derivative[6, i]
        vx, vy, vz = derivative[1, i], derivative[4, i], derivative[7, i]
        g11 = ux * ux + uy * uy + uz * uz
        g12 = ux * vx + uy * vy + uz * vz
        g22 = vx * vx + vy * vy + vz * vz
        m11, m12, m22 = inverse_root(g11, g12, g22)
        frame[0, i], frame[1, i], frame[2, i] = m11 * ux + m12 * vx, m11 * uy + m12 * vy, m11 * uz + m12 * vz
        frame[3, i], frame[4, i], frame[5, i] = m12 * ux + m22 * vx, m12 * uy + m22 * vy, m12 * uz + m22 * vz


@njit(**entry_options)
def to_angles(there, there_par, back, back_par, states, rays):
    """Coordinates rays[:, :4], the last 0, of states (n, 6 or more)."""
    x, p, r = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK)
    image, derivative, frame = aligned(3, BLOCK), aligned(9, BLOCK), aligned(6, BLOCK)
    for start in range(0, states.shape[0], BLOCK):
        count = read_block(states, start, 0, x)
        read_block(states, start, 3, p)
        back(x, r[0:3], back_par)
        there(r[0:3], image, derivative, there_par)
        _frame(derivative, frame)
        for i in range(BLOCK):
            along = p[0, i] * frame[0, i] + p[1, i] * frame[1, i] + p[2, i] * frame[2, i]
            across = p[0, i] * frame[3, i] + p[1, i] * frame[4, i] + p[2, i] * frame[5, i]
            r[2, i], r[3, i] = turns(across, along), 0.0
        write_block(r, count, start, 0, rays)


@njit(**entry_options)
def from_angles(there, there_par, rows):
    """States rows[:, :6] of the coordinates that stand in rows[:, :4]."""
    x, p, r = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK)
    derivative, frame = aligned(9, BLOCK), aligned(6, BLOCK)
    for start in range(0, rows.shape[0], BLOCK):
        count = read_block(rows, start, 0, r)
        there(r[0:3], x, derivative, there_par)
        _frame(derivative, frame)
        for i in range(BLOCK):
            c, s = cosine_sine(r[2, i])
            for k in range(3):
                p[k, i] = c * frame[k, i] + s * frame[3 + k, i]
        write_block(x, count, start, 0, rows)
        write_block(p, count, start, 3, rows)
