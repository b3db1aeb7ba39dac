"""How results show themselves: what `creeping._presenting` asks, answered type by type.

Types are known by their names, so that to show one result does not import the modules of all others.
"""

from collections.abc import Callable, Mapping
from html import escape

from creeping._typing import Any
from creeping.errors import InvalidInputError
from creeping.files.polylines import polydata
from creeping.plotting import _facts, echo_pictures, far_cuts, line_plots, plane_pictures, response_plots

_FACTS: dict[str, Callable[..., _facts.Facts]] = {
    "ShadowLine": _facts.of_line,
    "ShadowCurve": _facts.of_shadow_curve,
    "RayFan": _facts.of_fan,
    "IsoPhaseCurve": _facts.of_curve,
    "FarField": _facts.of_far,
    "PointData": _facts.of_points,
    "FieldCut": _facts.of_cut,
    "PhaseMap": _facts.of_map,
    "DirectFlow": _facts.of_direct,
    "Coupling": _facts.of_coupling,
    "SourcePattern": _facts.of_pattern,
    "ImpulseResponse": _facts.of_impulse,
    "RangeProfile": _facts.of_profile,
    "Echo": _facts.of_echo,
}
_PLOTS: dict[str, Callable[..., Any]] = {
    "ShadowLine": line_plots.plot_line,
    "ShadowCurve": line_plots.plot_shadow_curve,
    "RayFan": line_plots.plot_fan,
    "IsoPhaseCurve": line_plots.plot_curve,
    "FarField": far_cuts.plot_far,
    "FieldCut": plane_pictures.plot_field_cut,
    "PhaseMap": line_plots.plot_growth,
    "Coupling": response_plots.plot_coupling,
    "SourcePattern": response_plots.plot_pattern,
    "ImpulseResponse": response_plots.plot_impulse,
    "RangeProfile": response_plots.plot_profile,
    "Echo": echo_pictures.plot_echo,
}
_POLYDATA: dict[str, Callable[[Any], Any]] = {
    "ShadowLine": lambda line: polydata(line),
    "ShadowCurve": lambda curve: polydata(line_plots.line_of(curve)),
    "RayFan": lambda fan: polydata(fan=fan),
    "IsoPhaseCurve": lambda curve: polydata(curves=[curve]),
}
_LEFT = ' style="text-align:left"'


def html(result: object) -> str:
    """Table of a result: no script, no style sheet, nothing from elsewhere."""
    rows = "".join(
        f'<tr><th scope="row"{_LEFT}>{escape(name)}</th><td{_LEFT}>{escape(value)}</td></tr>'
        for name, value in _of(result, _FACTS)(result)
    )
    return f"<table><caption{_LEFT}>{escape(type(result).__name__)}</caption><tbody>{rows}</tbody></table>"


def plot(result: object, ax: Any = None, **options: Any) -> Any:
    """Matplotlib axes with the picture of a result; options as in `line_plots` and `level_plots`."""
    return _of(result, _PLOTS)(result, ax, **options)


def to_polydata(result: object) -> Any:
    """Curves of a result as a ``pyvista.PolyData``."""
    return _of(result, _POLYDATA)(result)


def _of(result: object, table: Mapping[str, Callable[..., Any]]) -> Callable[..., Any]:
    """Entry of the result's class, or of the nearest one that it is derived from."""
    for kind in type(result).__mro__:
        if kind.__name__ in table:
            return table[kind.__name__]
    raise InvalidInputError(f"a {type(result).__name__} cannot be shown so; only {', '.join(table)} can")
