"""The normal equations of a spline in plain numpy, all samples at once."""

import numpy as np

from scatterers.spline.tensor import weights


def accumulate(places, values, slopes, weight, shape, c, out):
    """What `scatterers.kernels.normal_equations.accumulate` does."""
    cell = places.astype(np.int64)
    w = weights(places - cell, 1)
    value, slope = w[..., 0], w[..., 1]
    steps = np.arange(6)
    i, j, k = (cell[:, axis, None] + steps for axis in range(3))
    index = (i[:, :, None, None] * shape[1] + j[:, None, :, None]) * shape[2] + k[:, None, None, :]
    triples = [(value, value, value), (slope, value, value), (value, slope, value), (value, value, slope)]
    rows = np.stack([np.einsum("na,nb,nc->nabc", a[:, 0], b[:, 1], d[:, 2]) for a, b, d in triples], axis=1)
    left = np.column_stack([values, slopes]) - np.einsum("nqabc,nabc->nq", rows, c[index])
    scale = np.array([weight[0], *3 * [weight[1]]])
    np.add.at(out, index, np.einsum("nq,nqabc->nabc", scale * left, rows))
    return float(np.sum(scale * left**2))
