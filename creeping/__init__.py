"""Creeping rays on smooth bodies by the phase flow method.

Public names are imported when first used, so that ``import creeping`` costs next to nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from creeping._presenting import present_with
from creeping._version import __version__

# by name: results show themselves by what only plotting knows, and import it when first asked
present_with("creeping.plotting.presenter")

_HOMES = {
    "BodyError": "creeping.rays.body_uncertainty",
    "CreepingError": "creeping.errors",
    "DirectFlow": "creeping.geodesics.direct_flow",
    "FarField": "creeping.field.far",
    "Impedance": "creeping.field.boundary",
    "IsoPhaseCurve": "creeping.rays.isophase",
    "Growth": "creeping.phaseflow.phase_map",
    "MapError": "creeping.geodesics.integrator",
    "PhaseMap": "creeping.phaseflow.phase_map",
    "RayFan": "creeping.rays.fan",
    "RayStatus": "creeping.rays.fan",
    "ShadowLine": "creeping.shadow.line",
    "body_error": "creeping.rays.body_uncertainty",
    "build_phase_map": "creeping.phaseflow.tuning.request",
    "check_surface": "creeping.geometry.surface",
    "choose_flow": "creeping.phaseflow.tuning.flow_choice",
    "far_field": "creeping.field.far",
    "far_field_uncertainty": "creeping.field.uncertainty",
    "fibonacci_directions": "creeping.geometry.directions",
    "iso_phase_curves": "creeping.rays.isophase",
    "launch": "creeping.rays.fan",
    "load_phase_map": "creeping.phaseflow.cache",
    "near_field": "creeping.field.near",
    "shadow_line": "creeping.shadow.line",
    "surface_field": "creeping.field.surface",
    "sweep_directions": "creeping.sweeping.run",
    "trace": "creeping.geodesics.integrator",
}

__all__ = [
    "BodyError",
    "CreepingError",
    "DirectFlow",
    "FarField",
    "Growth",
    "Impedance",
    "IsoPhaseCurve",
    "MapError",
    "PhaseMap",
    "RayFan",
    "RayStatus",
    "ShadowLine",
    "__version__",
    "body_error",
    "build_phase_map",
    "check_surface",
    "choose_flow",
    "far_field",
    "far_field_uncertainty",
    "fibonacci_directions",
    "iso_phase_curves",
    "launch",
    "load_phase_map",
    "near_field",
    "shadow_line",
    "surface_field",
    "sweep_directions",
    "trace",
]

if TYPE_CHECKING:
    from creeping.errors import CreepingError
    from creeping.field.boundary import Impedance
    from creeping.field.far import FarField, far_field
    from creeping.field.near import near_field
    from creeping.field.surface import surface_field
    from creeping.field.uncertainty import far_field_uncertainty
    from creeping.geodesics.direct_flow import DirectFlow
    from creeping.geodesics.integrator import MapError, trace
    from creeping.geometry.checks import check_surface
    from creeping.geometry.directions import fibonacci_directions
    from creeping.phaseflow.cache import load_phase_map
    from creeping.phaseflow.phase_map import Growth, PhaseMap
    from creeping.phaseflow.tuning.flow_choice import choose_flow
    from creeping.phaseflow.tuning.request import build_phase_map
    from creeping.rays.body_uncertainty import BodyError, body_error
    from creeping.rays.fan import RayFan, RayStatus, launch
    from creeping.rays.isophase import IsoPhaseCurve, iso_phase_curves
    from creeping.shadow.line import ShadowLine, shadow_line
    from creeping.sweeping.run import sweep_directions


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'creeping' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
