"""E and H at points off a conductor by the currents of its whole body, with their error.

    E_s(y) = ik int [J + grad_y grad_y.J/k^2] G dS,   H_s(y) = int grad_y G x J dS

Errors are those of `creeping.field.currents.total`, with what currents leave of E and of H inside for epsilon, and with
the second order's E and H for u'; the larger of the two counts for both.

Sources: [CK13, sec. 6.2]; Derivations, F17, F20 and F26.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.field.currents.conductor import ConductorCurrents
from creeping.field.currents.total import level_at

LIT_LEVEL, DARK_LEVEL, SHAPE = 2.3, 4.6, 2.3
"""Factors L and S of the error, set on the first four bodies of `studies.conductor_coverage`."""


def incident_fields(direction: FloatArray, electric: ComplexArray, points: FloatArray, k: float) -> ComplexArray:
    """E and H (m, 6, p) of incident waves E0 (3, p) at points (m, 3), L."""
    both = np.concatenate([electric, np.cross(direction, electric, axisb=0).T])
    return np.asarray(np.multiply.outer(np.exp(1j * k * (points @ direction)), both))


def total_fields(
    currents: ConductorCurrents, points: FloatArray, dark: BoolArray
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Incident and scattered E and H (m, 6, p) at points (m, 3), L, some in the dark, and their error (m, p)."""
    k = currents.wavenumber
    incident = incident_fields(currents.direction, currents.incident_electric, points, k)
    scattered = np.concatenate([currents.scattered_electric(points), currents.scattered(points)], axis=1)
    left = currents.left_of_each
    shapes = currents.changed_electric(points), currents.changed_magnetic(points)
    error = np.empty((len(points), incident.shape[2]))
    for i, mean in enumerate(currents.amplitudes):
        level = level_at(currents, points, dark, float(mean), LIT_LEVEL, DARK_LEVEL)
        each = [left[j, i] * np.hypot(level, SHAPE * shape[:, i]) for j, shape in enumerate(shapes)]
        error[:, i] = np.maximum(*each)
    return incident, scattered, error
