"""Pictures of shadow lines, creeping rays, iso-phase curves and fields.

Every name is imported on first use, so that importing this package costs neither matplotlib nor pyvista.
``picture`` draws in space, with pyvista or matplotlib.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
