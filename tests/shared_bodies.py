"""`scatterers`, its named bodies made once for each set of parameters: what is prepared for a body is kept with it."""

from functools import cache

import scatterers


def _shared(kind):
    known = cache(kind)

    def body(*args, **options):
        try:
            return known(*args, **options)
        except TypeError:
            # parameters that cannot be looked up
            return kind(*args, **options)

    return body


Sphere, Ellipsoid, Torus, TwistedEllipsoid, Implicit = map(
    _shared,
    (scatterers.Sphere, scatterers.Ellipsoid, scatterers.Torus, scatterers.TwistedEllipsoid, scatterers.Implicit),
)


def __getattr__(name):
    return getattr(scatterers, name)
