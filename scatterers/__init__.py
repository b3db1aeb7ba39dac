"""Bodies for `creeping`, one a file; each satisfies the Surface protocol by its structure alone."""

from scatterers.almond import Almond
from scatterers.bodies import Bodies
from scatterers.cad import Cad
from scatterers.capsule import Capsule
from scatterers.coating import Coating
from scatterers.cone import Cone
from scatterers.cone_sphere import ConeSphere
from scatterers.cylinder import Cylinder
from scatterers.ellipsoid import Ellipsoid
from scatterers.facets import Facets
from scatterers.gridded import Gridded
from scatterers.implicit import Implicit
from scatterers.mesh import Mesh, examined_mesh
from scatterers.ogive import DoubleOgive, Ogive
from scatterers.revolution import Revolution
from scatterers.speed import ExpressionSpeed
from scatterers.sphere import Sphere
from scatterers.torus import Torus
from scatterers.twisted_ellipsoid import TwistedEllipsoid

__all__ = [
    "Almond",
    "Bodies",
    "Cad",
    "Capsule",
    "Coating",
    "Cone",
    "ConeSphere",
    "Cylinder",
    "DoubleOgive",
    "Ellipsoid",
    "ExpressionSpeed",
    "Facets",
    "Gridded",
    "Implicit",
    "Mesh",
    "Ogive",
    "Revolution",
    "Sphere",
    "Torus",
    "TwistedEllipsoid",
    "examined_mesh",
]
