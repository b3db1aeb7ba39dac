"""`scatterers`, its named bodies made once for each set of parameters: what is prepared for a body is kept with it."""

from functools import cache, wraps

import pytest
from _pytest.doctest import DoctestItem

import scatterers


def _shared(kind):
    known = cache(kind)

    @wraps(kind, updated=())
    def body(*args, **options):
        try:
            return known(*args, **options)
        except TypeError:
            # parameters that cannot be looked up
            return kind(*args, **options)

    return body


SHARED = ("Sphere", "Ellipsoid", "Torus", "TwistedEllipsoid", "Implicit")
Sphere, Ellipsoid, Torus, TwistedEllipsoid, Implicit = (_shared(getattr(scatterers, name)) for name in SHARED)


class Metric(scatterers.Sphere):
    """A sphere that knows its unit, as bodies from files do."""

    unit = "m"


def __getattr__(name):
    return getattr(scatterers, name)


class SharedInExamples:
    """Registered with pytest: examples in docstrings and pages take the same bodies."""

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item):
        with pytest.MonkeyPatch.context() as patch:
            for name in SHARED if isinstance(item, DoctestItem) else ():
                patch.setattr(scatterers, name, globals()[name])
            return (yield)
