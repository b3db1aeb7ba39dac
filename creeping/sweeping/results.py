"""Results of a sweep as an xarray.Dataset: dimensions, coordinates, units, and where the numbers come from.

Attributes are text, numbers or lists of numbers, which zarr and netCDF both keep.
"""

from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping._version import __version__
from creeping.field.labelled import COMPONENTS, power
from creeping.geometry.creased import is_creased
from creeping.geometry.directions import angles_of
from creeping.geometry.unit import UNKNOWN, unit_of
from creeping.shadow.status import INCIDENCE_STATUSES
from creeping.storage.extras import required
from creeping.sweeping.accessor import register
from creeping.sweeping.creased_fields import SERVED
from creeping.sweeping.plan import Arrays, SweepPlan
from creeping.sweeping.request import SweepRequest

if TYPE_CHECKING:
    import xarray

MISSING = -1
"""Status of an incidence that is not computed yet."""
STATUS_NAMES = {code: text.partition(":")[0] for code, text in INCIDENCE_STATUSES.items()} | {MISSING: "missing"}
SHOWN = 20
"""Errors of incidences that stand in the attributes."""
CONVENTIONS = (
    "time factor exp(-i omega t); direction is where the wave travels; radians; lengths in the unit L of the body, "
    "wavenumbers in 1/L; far field f exp(i k r)/r, f in L"
)
Coordinate = tuple[tuple[str, ...], np.ndarray[Any, Any], dict[str, Any]]


def require(package: str) -> Any:
    """Import a package of the extra ``sweep``.

    Raises
    ------
    CreepingError
        If it is missing, with the command that installs it.
    """
    return required(package, use="sweeps need", extra="sweep")


def in_unit(units: str, unit: str) -> str:
    """Units that are written in L in a body's own unit of length, as the CF conventions write it.

    Examples
    --------
    >>> in_unit("1/L", "m"), in_unit("L^(1/3)", "m"), in_unit("1/L", "L"), in_unit("rad", "m")
    ('m-1', 'm^(1/3)', '1/L', 'rad')
    """
    return power(unit, -1) if units == "1/L" else units.replace("L", unit)


def coordinates(request: SweepRequest, incidences: FloatArray, unit: str) -> dict[str, Coordinate]:
    """Coordinates by name, lengths in ``unit``: dimensions, values, attributes."""
    theta, phi = angles_of(incidences)
    sphere = {
        "theta": ("angle of the direction from z", theta),
        "phi": ("angle of the direction about z, from x towards y", phi),
    }
    found: dict[str, Coordinate] = {
        "direction": (("incidence", "axis"), incidences, {"units": "1", "description": "where the wave travels"})
    }
    for name, (text, values) in sphere.items():
        found[name] = (("incidence",), values, {"units": "rad", "description": text})
    if request.quantity == "rays":
        times = {"units": unit, "description": "travel time of the outputs; time for a weighted body"}
        found["travel_time"] = (("step",), request.travel_times, times)
        return found
    numbers = {"units": in_unit("1/L", unit), "description": "k"}
    found["wavenumber"] = (("wavenumber",), np.array(request.wavenumbers), numbers)
    if request.scalar_boundaries:
        found["boundary"] = (("boundary",), np.array(request.scalar_boundaries), {"description": "on the body"})
    if "pec" in request.boundaries:
        for name in ("scattered", "incident"):
            found[name] = ((name,), np.array(COMPONENTS), {"description": "component of the wave, along theta or phi"})
    if request.quantity == "bistatic":
        seen = np.array(request.observation)
        words = {"units": "1", "description": "direction in which the field is observed"}
        found["observation"] = (("observer", "axis"), seen, words)
    return found


def variable_attributes(request: SweepRequest, name: str, unit: str) -> dict[str, Any]:
    """Units and description of a variable, lengths in ``unit``; codes and names of the status."""
    variable = request.variables[name]
    words: dict[str, Any] = {"units": in_unit(variable.units, unit), "description": variable.description}
    if name == "incidence_status":
        words["flag_values"] = list(INCIDENCE_STATUSES)
        words["flag_meanings"] = " ".join(STATUS_NAMES[code].replace(" ", "_") for code in INCIDENCE_STATUSES)
    return words


def sweep_attributes(plan: SweepPlan, unit: str) -> dict[str, Any]:
    """Attributes of the dataset that are known before anything is computed."""
    request, flow = plan.request, plan.flow_content
    conventions = CONVENTIONS
    if unit != UNKNOWN:
        conventions = CONVENTIONS.replace("the unit L of the body", unit).replace("1/L", power(unit, -1))
        conventions = conventions.replace("f in L", f"f in {unit}")
    words: dict[str, Any] = {
        "title": f"creeping rays: {request.quantity}",
        "conventions": conventions,
        "creeping_version": __version__,
        "body": repr(plan.body),
        "body_fingerprint": plan.key["body"],
        "sweep_digest": plan.digest,
        "quantity": request.quantity,
        "length": float(request.length),
        "n_rays": int(request.n_rays),
        "n_steps": int(request.n_steps),
    }
    if request.quantity != "rays":
        words |= {"boundaries": ", ".join(request.boundaries), "order_of_creeping_waves": int(request.order)}
        if is_creased(plan.body):
            words["served_by"] = SERVED
    for name, value in flow.items():
        if name != "error" and value is not None:
            words[f"flow_{name}" if name != "kind" else "flow"] = value
    if flow["error"] is not None:
        rms, largest, samples = flow["error"]
        words |= {"flow_error_rms": float(rms), "flow_error_max": float(largest), "flow_error_samples": int(samples)}
    if plan.text:
        words["study"] = plan.text
    return words


def count_attributes(status: IntArray, errors: list[tuple[int, str]], seconds: float) -> dict[str, Any]:
    """Attributes that are known afterwards: incidences by status, errors of the first that failed, seconds."""
    words: dict[str, Any] = {f"incidences_{k.replace(' ', '_')}": v for k, v in count_statuses(status).items()}
    words["seconds"] = float(round(seconds, 3))
    if errors:
        words["errors"] = "\n".join(f"incidence {row}: {text}" for row, text in errors[:SHOWN])
    return words


def count_statuses(status: IntArray) -> dict[str, int]:
    """Number of incidences of each status, by its name."""
    return {name: int(np.sum(status == code)) for code, name in STATUS_NAMES.items()}


def as_dataset(plan: SweepPlan, arrays: Arrays, errors: list[tuple[int, str]], seconds: float) -> "xarray.Dataset":
    """Dataset in memory.

    Parameters
    ----------
    plan : SweepPlan
    arrays : dict of arrays
        Of `SweepRequest.variables`, the first axis the incidence.
    errors : list of (incidence, message)
    seconds : float
    """
    request, unit = plan.request, unit_of(plan.body)
    variables = {
        name: (("incidence", *variable.dims), arrays[name], variable_attributes(request, name, unit))
        for name, variable in request.variables.items()
    }
    counts = count_attributes(arrays["incidence_status"], errors, seconds)
    words = sweep_attributes(plan, unit) | counts
    found: xarray.Dataset = register().Dataset(variables, coordinates(request, plan.incidences, unit), words)
    return found


def without_complex(dataset: "xarray.Dataset") -> "xarray.Dataset":
    """Dataset with ``name_real`` and ``name_imag`` for each complex variable: netCDF has no complex numbers.

    Zarr keeps complex numbers as they are.
    """
    changed = dataset
    for name, values in dataset.data_vars.items():
        if values.dtype.kind == "c":
            parts = {f"{name}_real": values.real, f"{name}_imag": values.imag}
            changed = changed.drop_vars(name).assign(
                {key: part.assign_attrs(values.attrs) for key, part in parts.items()}
            )
    return changed
