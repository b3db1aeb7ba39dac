"""A sweep one incidence at a time by `shadow_line`, `launch`, `far_field`: what the sweep of many is to equal."""

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import SingularIncidenceError
from creeping.field.boundary import parse_boundary
from creeping.field.far import far_field
from creeping.field.validity_range import launch_validity, validities
from creeping.geometry.surface import Surface
from creeping.rays.fan import RayFan, launch
from creeping.rays.reach import early_length
from creeping.rays.transport import Flow
from creeping.shadow.line import ShadowLine, shadow_line
from creeping.shadow.nodes import shares_of
from creeping.shadow.status import NO_RAY, OK, SINGULAR
from creeping.sweeping.request import SweepRequest

PARTS_OF_FIELD = ("creeping", "reflected", "forward", "unresolved", "error")


class PlainSweeper:
    """Results of incidences (n, 3) by the plain route.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
    request : SweepRequest
    """

    def __init__(self, flow: Flow, request: SweepRequest) -> None:
        self.flow, self.request = flow, request

    @property
    def body(self) -> Surface:
        """Body of the flow."""
        return self.flow.body

    def __call__(self, incidences: FloatArray) -> dict[str, np.ndarray[Any, Any]]:
        """Arrays of results, the first axis the incidence; see `SweepRequest.variables`."""
        out = self.request.empty(len(incidences))
        for row, direction in enumerate(np.asarray(incidences, dtype=float)):
            try:
                line = shadow_line(self.body, direction)
            except SingularIncidenceError as error:
                out["incidence_status"][row] = SINGULAR
                out["singular_distance"][row] = getattr(error, "distance", 0.0)
                continue
            self._line(line, row, out)
            if self.request.quantity == "rays":
                self._rays(line, row, out)
            else:
                self._fields(line, row, out)
        return out

    def _line(self, line: ShadowLine, row: int, out: dict[str, Any]) -> None:
        out["incidence_status"][row] = OK
        out["curves"][row] = len(line.curves)
        out["line_length"][row] = line.length
        out["line_error"][row] = line.nodes.error
        for name, share in shares_of(line).items():
            out[name][row] = share
        out["singular_distance"][row] = line.singular_distance

    def _rays(self, line: ShadowLine, row: int, out: dict[str, Any]) -> None:
        request = self.request
        fan = launch(
            self.flow, line, length=request.length, n_rays=request.n_rays, n_steps=request.n_steps, max_gap=np.inf
        )
        # more arcs than rays: those that find no place are left out
        n = min(len(fan.points), request.n_rays)
        values = {
            "ray_status": fan.status,
            "curve_index": fan.curve_index,
            "arclength": fan.arclength,
            "launch_phase": fan.eikonal[:, 0],
            "detachment": fan.detachment,
            "points": fan.points[:, 1:],
            "directions": fan.directions[:, 1:],
            "spreading": fan.spreading[:, 1:],
            "spreading_rate": fan.spreading_rate[:, 1:],
            "attenuation": fan.attenuation[:, 1:],
        }
        found = launch_validity(self.body, line.launch_points(request.n_rays))
        out["least_radius"][row], out["transverse"][row] = (values[0] for values in found)
        out["ray_status"][row] = NO_RAY
        for name, value in values.items():
            out[name][row, :n] = value[:n]

    def _fields(self, line: ShadowLine, row: int, out: dict[str, Any]) -> None:
        request = self.request
        fan = self._fan(line)
        until = min(request.length, early_length(self.body, min(request.wavenumbers)))
        found = validities(self.body, line.launch_points(request.n_rays), until, request.wavenumbers)
        out["least_k_rho"][row], out["largest_transverse"][row] = (values[0] for values in found)
        bistatic = request.quantity == "bistatic"
        observation = np.array(request.observation) if bistatic else -line.direction[None]
        # boundaries outermost would lose the geometry that far_field keeps for each wavenumber
        for k, wavenumber in enumerate(request.wavenumbers):
            for name, which, suffix in request.problems:
                asked = {"wavenumber": wavenumber, "boundary": parse_boundary(name), "order": request.order}
                far = far_field(fan, observation, method="rays", **asked)
                for part in PARTS_OF_FIELD:
                    if part + suffix in out:
                        values = getattr(far, part)
                        out[part + suffix][(row, *which, k)] = values if bistatic else values[0]

    def _fan(self, line: ShadowLine) -> RayFan:
        return launch(
            self.flow, line, length=self.request.length, n_rays=self.request.n_rays, n_steps=None, max_gap=np.inf
        )
