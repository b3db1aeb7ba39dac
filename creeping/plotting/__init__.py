"""Pictures of shadow lines, creeping rays, iso-phase curves and fields, and files of them for other programs.

Every name is imported on first use, so that importing this package costs neither matplotlib nor pyvista.
``scene.plot_rays_3d`` draws with pyvista, ``axes3d.plot_rays_3d`` with matplotlib; ``picture`` chooses.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from creeping.files.ffe import write_ffe
    from creeping.files.polylines import polydata
    from creeping.files.tables import write_csv, write_text, write_vtp
    from creeping.plotting.display import GLProbe, gl_available
    from creeping.plotting.far_cuts import far_cut_picture
    from creeping.plotting.field_pictures import decay_picture, surface_field_picture
    from creeping.plotting.parameter_plane import plot_parameters
    from creeping.plotting.pictures import parameter_picture, picture

__all__ = [
    "GLProbe",
    "decay_picture",
    "far_cut_picture",
    "gl_available",
    "parameter_picture",
    "picture",
    "plot_parameters",
    "polydata",
    "surface_field_picture",
    "write_csv",
    "write_ffe",
    "write_text",
    "write_vtp",
]

_HOMES = {
    "GLProbe": "creeping.plotting.display",
    "decay_picture": "creeping.plotting.field_pictures",
    "far_cut_picture": "creeping.plotting.far_cuts",
    "gl_available": "creeping.plotting.display",
    "parameter_picture": "creeping.plotting.pictures",
    "picture": "creeping.plotting.pictures",
    "plot_parameters": "creeping.plotting.parameter_plane",
    "polydata": "creeping.files.polylines",
    "surface_field_picture": "creeping.plotting.field_pictures",
    "write_csv": "creeping.files.tables",
    "write_ffe": "creeping.files.ffe",
    "write_text": "creeping.files.tables",
    "write_vtp": "creeping.files.tables",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
