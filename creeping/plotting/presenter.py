"""How results draw themselves: what `creeping._presenting` asks, answered type by type.

Types are known by their names, so that to draw one result does not import the modules of all others.
"""

from creeping._typing import Any
from creeping.errors import InvalidInputError
from creeping.files.polylines import polydata
from creeping.plotting import coupling_pictures, echo_pictures, far_cuts, line_plots, plane_pictures


def plot(result: object, ax: Any = None, **options: Any) -> Any:
    """Matplotlib axes with the picture of a result; options are those of its ``plot_*`` function."""
    known = {
        "ShadowLine": line_plots.plot_line,
        "ShadowCurve": lambda curve, ax, **shown: line_plots.plot_line(line_plots.line_of(curve), ax, **shown),
        "RayFan": lambda fan, ax, **shown: line_plots.plot_line(fan.line, ax, fan=fan, **shown),
        "IsoPhaseCurve": line_plots.plot_curve,
        "FarField": far_cuts.plot_far,
        "FieldCut": plane_pictures.plot_field_cut,
        "PhaseMap": line_plots.plot_growth,
        "Coupling": coupling_pictures.plot_coupling,
        "SourcePattern": coupling_pictures.plot_pattern,
        "ImpulseResponse": echo_pictures.plot_impulse,
        "RangeProfile": echo_pictures.plot_profile,
        "Echo": echo_pictures.plot_echo,
        "TMatrix": echo_pictures.plot_t_matrix,
    }
    return _of_type(known, result)(result, ax, **options)


def to_polydata(result: object) -> Any:
    """Curves of a result as a ``pyvista.PolyData``."""
    known = {
        "ShadowLine": polydata,
        "ShadowCurve": lambda curve: polydata(line_plots.line_of(curve)),
        "RayFan": lambda fan: polydata(fan=fan),
        "IsoPhaseCurve": lambda curve: polydata(curves=[curve]),
    }
    return _of_type(known, result)(result)


def _of_type(known: dict[str, Any], result: object) -> Any:
    """What is known of the result's class, or of the nearest one that it is derived from."""
    for kind in type(result).__mro__:
        if kind.__name__ in known:
            return known[kind.__name__]
    raise InvalidInputError(f"a {type(result).__name__} cannot be shown so; only {', '.join(known)} can")
