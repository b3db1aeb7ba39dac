"""One leap of a map in plain numpy, for each kind of coordinates."""

import numpy as np

from creeping.geodesics.bundle import project_bundle
from creeping.geometry.frames import polar_frame
from creeping.phaseflow.coordinates.quaternions import quaternion_product, quaternions
from creeping.phaseflow.coordinates.rotation import REACH
from creeping.phaseflow.splines import uniform_weights
from oracles.attenuation import extend


def evaluate(table, chart, grid, degree):
    """Evaluate at charts (n,) and grid coordinates (n, 3): (n, lanes). The numpy twin of the compiled contraction."""
    if table.shape[1] == 1:
        # a table without azimuth is that of any azimuth; B-spline weights add up to 1
        table = np.repeat(table, degree + 1, axis=1)
    cells = np.array([table.shape[1] - degree, table.shape[2] - degree, table.shape[3] - degree])
    cell = np.clip(np.floor(grid).astype(np.int64), 0, cells - 1)
    w = uniform_weights(grid - cell, degree)
    steps = np.arange(degree + 1)
    out = np.empty((len(grid), table.shape[-1]))
    # the stencils of a batch are gathered at once, so batches stay small
    for start in range(0, len(grid), 2048):
        part = slice(start, start + 2048)
        iu, iv, ia = (cell[part, k, None] + steps for k in range(3))
        stencil = table[chart[part, None, None, None], iu[:, :, None, None], iv[:, None, :, None], ia[:, None, None, :]]
        out[part] = np.einsum("ni,nj,nk,nijkl->nl", w[part, 0], w[part, 1], w[part, 2], stencil, optimize=True)
    return out


def carry_jacobi_and_curvatures(grid, leap, chart, place, states, out):
    """Fill lanes 6 to 9 of out with M times those of states, lanes 10 and 11 with attenuation and detachment.

    Times of detachment count from the start of the leap.
    """
    lanes = states.shape[1]
    if lanes > 6:
        m = evaluate(leap.jacobi, chart, place, grid.degree) + leap.matrix
        trusted = np.zeros(len(states), dtype=bool)
        if leap.is_packed:
            cell = np.floor(place).astype(int)
            cells = np.maximum(np.array(leap.jacobi.shape[1:4]) - grid.degree, 1)
            trusted = leap.flagged[chart, *np.clip(cell, 0, cells - 1).T] == 0
            m, attenuation = m[:, 3:7], m[:, 7]
        for first in (6, 8):
            i, j = states[:, first], states[:, first + 1]
            out[:, first] = m[:, 0] * i + m[:, 2] * j
            out[:, first + 1] = m[:, 1] * i + m[:, 3] * j
    if lanes > 10:
        out[:, 10:] = states[:, 10:]
        values = evaluate(leap.curvature, chart, place, grid.degree)
        creeping = np.isinf(states[:, 11])
        extend(values, leap.time, np.zeros(len(states)), out[:, 10], out[:, 11])
        if leap.is_packed:
            quick = trusted & creeping
            out[quick, 10], out[quick, 11] = states[quick, 10] + attenuation[quick], np.inf


def leap(flow, states):
    """One leap of a phase map on states (n, 6, 10 or 12)."""
    model, grid, table = flow.model, flow.grid, flow.leaps[-1]
    if model.name == "ambient":
        return _ambient(model, grid, table, states)
    locate, move = {
        "rotation": (_locate_rotation, _move_rotation),
        "octant": (_locate_octant, _move_octant),
        "angles": (_locate_angles, _move_angles),
        "meridian": (_locate_meridian, _move_rotation),
        "ring": (_locate_angles, _move_angles),
    }[model.name]
    inner, chart, located = locate(model, states)
    scale, shift = model.placement(grid)
    # the axis of revolution may follow the shift
    place = shift[:3] + scale * located
    d = evaluate(table.state, chart, place, grid.degree) + table.centre
    if table.is_packed and states.shape[1] > 6:
        q = (evaluate(table.jacobi, chart, place, grid.degree) + table.matrix)[:, :3]
        first = np.sqrt(1 - np.sum(q**2, axis=1, keepdims=True))
        d = np.concatenate([q, 0 * first] if model.name in ("angles", "ring") else [first, q], axis=1)
    out = np.empty_like(states)
    out[:, :3], out[:, 3:6] = move(model, inner, d)
    carry_jacobi_and_curvatures(grid, table, chart, place, states, out)
    return out


def _ambient(model, grid, leap, states):
    x, p = states[:, :3], states[:, 3:6]
    chart, uv = model.body.atlas.locate(x)
    angle = np.empty(len(x))
    for index, one in enumerate(model.body.atlas.charts):
        mine = chart == index
        along = np.einsum("ni,nik->nk", p[mine], polar_frame(one.tangents(uv[mine])))
        angle[mine] = np.arctan2(along[:, 1], along[:, 0])
    place = np.concatenate([uv, angle[:, None] / (2 * np.pi) % 1.0], axis=1) * grid.cells
    place[:, :2] += grid.origin
    d = evaluate(leap.state, chart, place, grid.degree)
    out = np.empty_like(states)
    out[:, :3], out[:, 3:6] = project_bundle(model.body, x + leap.time * p + d[:, :3], p + d[:, 3:6])
    carry_jacobi_and_curvatures(grid, leap, chart, place, states, out)
    return out


def _locate_rotation(model, states):
    source = model.body.atlas.sphere_map
    s = source.inverse(states[:, :3])
    s = s / np.linalg.norm(s, axis=1, keepdims=True)
    basis = _across(s)
    frame = polar_frame(source.derivative(s) @ basis)
    q = np.einsum("nik,nk->ni", basis, np.einsum("nik,ni->nk", frame, states[:, 3:6]))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    axis = np.argmax(np.abs(s), axis=1)
    order = (axis[:, None] + np.arange(3)) % 3
    s_abc, q_abc = np.take_along_axis(s, order, 1), np.take_along_axis(q, order, 1)
    sign = np.where(s_abc[:, 0] < 0, -1.0, 1.0)
    s_abc[:, :2] *= sign[:, None]
    q_abc[:, :2] *= sign[:, None]
    uv = s_abc[:, 1:] / (1 + s_abc[:, :1])
    along = q_abc[:, 1:] - uv * q_abc[:, :1]
    angle = np.arctan2(along[:, 1], along[:, 0]) / (2 * np.pi) % 1.0
    located = np.concatenate([uv / REACH, angle[:, None]], axis=1)
    return quaternions(s, q), 2 * axis + (sign < 0), located


def _move_rotation(model, inner, d):
    source = model.body.atlas.sphere_map
    r = quaternion_product(inner, d)
    r /= np.linalg.norm(r, axis=1, keepdims=True)
    w, x, y, z = r.T
    s = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1)
    q = np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=1)
    basis = np.stack([q, np.cross(s, q)], axis=-1)
    return source.forward(s), polar_frame(source.derivative(s) @ basis)[..., 0]


def _locate_octant(model, states):
    source = model.body.atlas
    s = source.sphere_map.inverse(states[:, :3])
    mirrors = np.where(s < 0, -1.0, 1.0)
    _, chart, located = _locate_rotation(model, states[:, :6] * np.tile(mirrors, 2))
    inner, _, _ = _locate_rotation(model, states)
    return (inner, np.prod(mirrors, axis=1)), chart // 2, located


def _move_octant(model, inner, d):
    rotation, parity = inner
    own = d.copy()
    own[:, 1:3] *= parity[:, None]
    return _move_rotation(model, rotation, own)


def _locate_meridian(model, states):
    inner, chart, _ = _locate_rotation(model, states)
    w, x, y, z = inner.T
    s = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1)
    q = np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=1)
    # away from the axis, the direction in which theta grows and the one across it
    across = np.cross(model.axis, s)
    theta = np.arctan2(np.linalg.norm(across, axis=1), s @ model.axis)
    south = np.cross(across, s)
    angle = np.arctan2(np.sum(q * across, axis=1) * np.linalg.norm(s, axis=1), np.sum(q * south, axis=1))
    located = np.stack([0 * theta, theta / np.pi, angle / (2 * np.pi) % 1.0], axis=1)
    return inner, 0 * chart, located


def _locate_angles(model, states):
    chart, uv = model.body.atlas.locate(states[:, :3])
    frame = polar_frame(model.body.atlas.charts[0].tangents(uv))
    along = np.einsum("nik,ni->nk", frame, states[:, 3:6])
    angle = np.arctan2(along[:, 1], along[:, 0]) / (2 * np.pi) % 1.0
    located = np.concatenate([uv, angle[:, None]], axis=1)
    return located, chart, located


def _move_angles(model, inner, d):
    chart = model.body.atlas.charts[0]
    moved = inner + d[:, :3]
    frame = polar_frame(chart.tangents(moved[:, :2]))
    angle = 2 * np.pi * moved[:, 2:]
    return chart.point(moved[:, :2]), np.cos(angle) * frame[..., 0] + np.sin(angle) * frame[..., 1]


def _across(s):
    """Orthonormal basis of the planes across unit vectors: (n, 3) -> (n, 3, 2)."""
    other = np.eye(3)[np.argmin(np.abs(s), axis=1)]
    first = np.cross(other, s)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(s, first)], axis=-1)
