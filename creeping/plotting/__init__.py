"""Pictures of shadow lines, creeping rays, iso-phase curves and fields.

Every name is imported on first use, so that importing this package costs neither matplotlib nor pyvista.
``picture`` draws in space, with pyvista or matplotlib.

Also here: how results draw themselves: what `creeping._presenting` asks, answered type by type. Types are known by
their names, so that to draw one result does not import the modules of all others.
"""

from importlib import import_module
from typing import Any

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

_PLOTS = {
    "line_plots.plot_line": "ShadowLine ShadowCurve RayFan",
    "line_plots.plot_curve": "IsoPhaseCurve",
    "line_plots.plot_growth": "PhaseMap",
    "far_cuts.plot_far": "FarField",
    "plane_pictures.plot_field_cut": "FieldCut",
    "coupling_pictures.plot_coupling": "Coupling",
    "coupling_pictures.plot_pattern": "SourcePattern",
    "echo_pictures.plot_impulse": "ImpulseResponse",
    "echo_pictures.plot_profile": "RangeProfile",
    "echo_pictures.plot_echo": "Echo",
    "echo_pictures.plot_t_matrix": "TMatrix",
}
"""What draws results, and their types."""


def plot(result: object, ax: Any = None, **options: Any) -> Any:
    """Matplotlib axes with the picture of a result; options are those of its ``plot_*`` function."""
    known = {kind: function for function, kinds in _PLOTS.items() for kind in kinds.split()}
    module, name = _of_type(known, result).split(".")
    return getattr(import_module(f"{__name__}.{module}"), name)(result, ax, **options)


def to_polydata(result: object) -> Any:
    """Curves of a result as a ``pyvista.PolyData``."""
    from creeping.files.arrays import polydata
    from creeping.plotting.line_plots import line_of

    known = {
        "ShadowLine": polydata,
        "ShadowCurve": lambda curve: polydata(line_of(curve)),
        "RayFan": lambda fan: polydata(fan=fan),
        "IsoPhaseCurve": lambda curve: polydata(curves=[curve]),
    }
    return _of_type(known, result)(result)


def _of_type(known: dict[str, Any], result: object) -> Any:
    """What is known of the result's class, or of the nearest one that it is derived from."""
    from creeping.errors import InvalidInputError

    for kind in type(result).__mro__:
        if kind.__name__ in known:
            return known[kind.__name__]
    raise InvalidInputError(f"a {type(result).__name__} cannot be shown so; only {', '.join(known)} can")
