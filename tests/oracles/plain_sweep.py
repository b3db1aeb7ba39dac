"""A sweep one incidence at a time by `shadow_line`, `launch`, `far_field`: what the sweep of many is to equal."""

import numpy as np

from creeping.errors import SingularIncidenceError
from creeping.field.boundary import parse_boundary
from creeping.field.far import far_field
from creeping.field.validity_range import launch_validity, validities
from creeping.rays.fan import launch
from creeping.rays.reach import early_length
from creeping.shadow.line import shadow_line, shares_of
from creeping.shadow.status import NO_RAY, LineStatus

PARTS_OF_FIELD = ("total", "creeping", "reflected", "forward", "unresolved", "error")


class PlainSweeper:
    """Results of incidences (n, 3) by the plain route: arrays, the first axis the incidence."""

    def __init__(self, flow, request):
        self.flow, self.request = flow, request

    def __call__(self, incidences):
        out = self.request.empty(len(incidences))
        for row, direction in enumerate(np.asarray(incidences, dtype=float)):
            one = {name: values[row : row + 1] for name, values in out.items()}
            try:
                line = shadow_line(self.flow.body, direction)
            except SingularIncidenceError as error:
                one["incidence_status"][0] = LineStatus.SINGULAR
                one["singular_distance"][0] = getattr(error, "distance", 0.0)
                continue
            known = {"incidence_status": LineStatus.OK, "curves": len(line.curves), "line_length": line.length}
            known |= {"line_error": line.nodes.error, "singular_distance": line.singular_distance, **shares_of(line)}
            for name, value in known.items():
                one[name][0] = value
            (self._rays if self.request.quantity == "rays" else self._fields)(line, one)
        return out

    def _rays(self, line, one):
        request = self.request
        fan = self._fan(line, request.n_steps)
        # more arcs than rays: those that find no place are left out
        n = min(len(fan.points), request.n_rays)
        found = launch_validity(self.flow.body, line.launch_points(request.n_rays))
        one["least_radius"][0], one["transverse"][0] = (values[0] for values in found)
        one["ray_status"][0] = NO_RAY
        one["ray_status"][0, :n], one["launch_phase"][0, :n] = fan.status[:n], fan.eikonal[:n, 0]
        for name in ("curve_index", "arclength", "detachment"):
            one[name][0, :n] = getattr(fan, name)[:n]
        for name in ("points", "directions", "spreading", "spreading_rate", "attenuation"):
            one[name][0, :n] = getattr(fan, name)[:n, 1:]

    def _fields(self, line, one):
        request, body = self.request, self.flow.body
        fan = self._fan(line, None)
        until = min(request.length, early_length(body, min(request.wavenumbers)))
        found = validities(body, line.launch_points(request.n_rays), until, request.wavenumbers)
        one["least_k_rho"][0], one["largest_transverse"][0] = (values[0] for values in found)
        bistatic = request.quantity == "bistatic"
        observation = np.array(request.observation) if bistatic else -line.direction[None]
        # boundaries outermost would lose the geometry that far_field keeps for each wavenumber
        for k, wavenumber in enumerate(request.wavenumbers):
            for name, which, suffix in request.problems:
                asked = {"wavenumber": wavenumber, "boundary": parse_boundary(name), "order": request.order}
                far = far_field(fan, observation, method="rays", **asked)
                for part in PARTS_OF_FIELD:
                    if part + suffix in one:
                        values = getattr(far, part)
                        one[part + suffix][(0, *which, k)] = values if bistatic else values[0]

    def _fan(self, line, n_steps):
        request = self.request
        return launch(self.flow, line, length=request.length, n_rays=request.n_rays, n_steps=n_steps, max_gap=np.inf)
