"""The monostatic field of many incidences: creeping and reflected, assembled by the formulas of one incidence."""

import numpy as np

from creeping._typing import Any
from creeping.field.backscatter import BackscatterGeometry
from creeping.field.boundary import parse_boundary
from creeping.field.far import FORWARD, field_of
from creeping.rays.single import SingleRayTracer
from creeping.rays.transport import Flow
from creeping.shadow.many import ShadowLines
from creeping.shadow.status import SINGULAR
from creeping.sweeping.request import LINE, SweepRequest
from creeping.sweeping.sweepers.plain import PlainSweeper


def fill_monostatic(
    flow: Flow, lines: ShadowLines, tracer: SingleRayTracer, request: SweepRequest, out: dict[str, Any]
) -> None:
    """Results of the fields."""
    rows = np.flatnonzero(lines.status != SINGULAR)
    if not len(rows):
        return
    geometry = BackscatterGeometry(flow, lines.of(rows), tracer, max(request.wavenumbers))
    # a body smaller than a wavelength: its forward lobe reaches all the way back
    small = geometry.mean_root_radius * np.cbrt(min(request.wavenumbers) / 2) * np.pi < FORWARD[1]
    if np.any(small):
        found = PlainSweeper(flow, request)(lines.directions[rows[small]])
        for name, values in found.items():
            if name not in LINE:
                out[name][rows[small]] = values
        lost = found["incidence_status"] == SINGULAR
        out["incidence_status"][rows[small][lost]] = SINGULAR
        rows = rows[~small]
        geometry = BackscatterGeometry(flow, lines.of(rows), tracer, max(request.wavenumbers))
    for name, which, suffix in request.problems:
        for k, wavenumber in enumerate(request.wavenumbers):
            field = field_of(geometry, wavenumber, parse_boundary(name), request.order)
            for part in ("creeping", "reflected", "unresolved"):
                out[part + suffix][(rows, *which, k)] = getattr(field, part)
