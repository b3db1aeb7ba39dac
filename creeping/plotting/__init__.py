"""Pictures of shadow lines, creeping rays, iso-phase curves and fields.

Every name is imported on first use, so that importing this package costs neither matplotlib nor pyvista.
``scene.plot_rays_3d`` draws with pyvista, ``axes3d.plot_rays_3d`` with matplotlib; ``picture`` chooses.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
