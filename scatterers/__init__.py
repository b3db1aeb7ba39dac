"""Bodies for `creeping`, one a file; each satisfies the Surface protocol by its structure alone."""

from scatterers.cad import Cad
from scatterers.ellipsoid import Ellipsoid
from scatterers.gridded import Gridded
from scatterers.implicit import Implicit
from scatterers.mesh import Mesh, examined_mesh
from scatterers.speed import ExpressionSpeed
from scatterers.sphere import Sphere
from scatterers.torus import Torus
from scatterers.twisted_ellipsoid import TwistedEllipsoid

__all__ = [
    "Cad",
    "Ellipsoid",
    "ExpressionSpeed",
    "Gridded",
    "Implicit",
    "Mesh",
    "Sphere",
    "Torus",
    "TwistedEllipsoid",
    "examined_mesh",
]
