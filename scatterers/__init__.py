"""Bodies for `creeping`, one a file; each satisfies the Surface protocol by its structure alone."""

from scatterers.analytic import Ellipsoid, Sphere, Torus, TwistedEllipsoid
from scatterers.cad import Cad
from scatterers.facets import Bodies, Facets
from scatterers.implicit import Gridded, Implicit
from scatterers.mesh import Mesh, examined_mesh
from scatterers.revolution import Revolution
from scatterers.speed import Coating, ExpressionSpeed
from scatterers.turned import Almond, Capsule, Cone, ConeSphere, Cylinder, DoubleOgive, Ogive

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


def __getattr__(name: str) -> object:
    from difflib import get_close_matches

    names = {one.lower(): one for one in __all__}
    near = [names[one] for one in get_close_matches(name.lower(), names)]
    told = f"; did you mean {' or '.join(near)}?" if near else f"; it has {', '.join(__all__)}"
    raise AttributeError(f"scatterers has no {name!r}{told}", name=name)
