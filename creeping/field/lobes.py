"""The step of a cut that fits the lobes of its pattern: lambda/D wide if bistatic, half of that in backscatter."""

import numpy as np

from creeping.field.arguments import checked
from creeping.geometry.surface import Surface

PER_LOBE = 4
"""Angles for each lobe of a pattern."""
NICE = (1.0, 0.5, 0.25, 0.2, 0.1, 0.05, 0.025, 0.02, 0.01, 0.005, 0.002, 0.001)
"""Steps of a cut, degrees, the largest that fits is taken."""


def lobe_step(body: Surface, wavenumber: float, *, monostatic: bool) -> float:
    """Step of a cut, degrees, with PER_LOBE angles for each lobe: lambda/D of a bistatic pattern, half in backscatter.

    Examples
    --------
    >>> import scatterers as sc
    >>> lobe_step(sc.Sphere(), 60.0, monostatic=True)
    0.25
    """
    longest = float(np.max(np.ptp(body.bounds, axis=0)))
    lobe = 2 * np.pi / (float(checked(wavenumber, 2)) * longest) / (2 if monostatic else 1)
    wanted = np.degrees(lobe) / PER_LOBE
    return next((step for step in NICE if step <= wanted), NICE[-1])
