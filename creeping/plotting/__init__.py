"""Pictures of shadow lines, creeping rays and iso-phase curves, and files of them for other programs.

Every name is imported on first use, so that importing this package costs neither matplotlib nor pyvista.
``scene.plot_rays_3d`` draws with pyvista, ``axes3d.plot_rays_3d`` with matplotlib; ``picture`` chooses.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from creeping.plotting.display import GLProbe, gl_available
    from creeping.plotting.export import write_csv, write_text, write_vtp
    from creeping.plotting.parameter_plane import plot_parameters
    from creeping.plotting.pictures import parameter_picture, picture

__all__ = [
    "GLProbe",
    "gl_available",
    "parameter_picture",
    "picture",
    "plot_parameters",
    "write_csv",
    "write_text",
    "write_vtp",
]

_HOMES = {
    "GLProbe": "display",
    "gl_available": "display",
    "parameter_picture": "pictures",
    "picture": "pictures",
    "plot_parameters": "parameter_plane",
    "write_csv": "export",
    "write_text": "export",
    "write_vtp": "export",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
