"""Far fields of given values, and bodies with names that are none of ours."""

import numpy as np

import creeping as cr
import scatterers as sc
from creeping.field.results.comparison import Echo

HOSTILE = "<script>alert('x')</script>&\"$\\frac"


class Awkward(sc.Sphere):
    """A body of the user's with a name that is none of ours."""

    def __repr__(self):
        return f"{HOSTILE}\n" * 3


def far_of(directions, total, **changes):
    """A FarField of given values."""
    total = np.asarray(total, dtype=complex)
    values = {
        "directions": np.asarray(directions, dtype=float),
        "total": total,
        "parts": {"creeping": total, "reflected": 0 * total, "forward": 0 * total},
        "method": np.full(len(total), "rays"),
        "unresolved": np.zeros(len(total), dtype=bool),
        "error": 0.01 * np.abs(total),
        "error_by": "extinction",
        "wavenumber": 20.0,
        "boundary": "hard",
        "order": 2,
    }
    return cr.FarField(**values | changes)


def echo_of(amplitude, error, quantity="rcs"):
    """Echo of one channel at two angles, a quarter of it creeping."""
    f = np.full((1, 2, 1), amplitude, dtype=complex)
    flags = np.zeros(f.shape, dtype=bool)
    angles = np.array([0.0, 90.0])
    return Echo(
        quantity,
        ("VV",),
        "azimuth",
        angles,
        0 * angles,
        None,
        np.array([20.0]),
        f,
        {"creeping": 0.25 * f, "reflected": 0.75 * f},
        np.full(f.shape, error),
        flags,
        flags,
    )
