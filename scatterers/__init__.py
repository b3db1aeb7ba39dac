"""Bodies for `creeping`, one a file; each satisfies the Surface protocol by its structure alone."""

from scatterers.ellipsoid import Ellipsoid
from scatterers.gridded import Gridded
from scatterers.speed import ExpressionSpeed
from scatterers.sphere import Sphere
from scatterers.torus import Torus
from scatterers.twisted_ellipsoid import TwistedEllipsoid

__all__ = ["Ellipsoid", "ExpressionSpeed", "Gridded", "Sphere", "Torus", "TwistedEllipsoid"]
