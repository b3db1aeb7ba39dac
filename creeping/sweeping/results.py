"""Results of a sweep as an xarray.Dataset: dimensions, coordinates, units, and where the numbers come from.

Attributes are text, numbers or lists of numbers, which zarr and netCDF both keep.

Also here: what one wants of the fields of a sweep, as ``dataset.field``: totals, cross sections, decibels,
polarisations.

The dataset holds amplitudes; sizes and logarithms are made when they are asked for.
"""

from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.field.results.labelled import COMPONENTS, POLARISATIONS, power
from creeping.geometry.checks import UNKNOWN, unit_of
from creeping.geometry.directions import angles_of
from creeping.geometry.piecewise import is_piecewise
from creeping.shadow.status import INCIDENCE_STATUSES
from creeping.storage.memory import required
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
    about = "angle of the direction about z, from x towards y"
    found: dict[str, Coordinate] = {
        "direction": (("incidence", "axis"), incidences, {"units": "1", "description": "where the wave travels"}),
        "theta": (("incidence",), theta, {"units": "rad", "description": "angle of the direction from z"}),
        "phi": (("incidence",), phi, {"units": "rad", "description": about}),
    }
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
        if request.method == "t-matrix":
            words["served_by"] = request.method
        elif flow["kind"] == "none":
            words["served_by"] = "equation"
        elif is_piecewise(plan.body):
            # as `creeping.FarField.method` says it of what rays alone do not serve
            words["served_by"] = "rays+optics"
    for name, value in flow.items():
        if name != "error" and value is not None:
            words[f"flow_{name}" if name != "kind" else "flow"] = value
    if flow["error"] is not None:
        rms, largest, samples = flow["error"]
        words |= {"flow_error_rms": float(rms), "flow_error_max": float(largest), "flow_error_samples": int(samples)}
    if plan.text:
        words["study"] = plan.text
    return words


def count_attributes(status: IntArray, errors: list[tuple[int, str]]) -> dict[str, Any]:
    """Attributes that tell how far it is: incidences by status, errors of the first that failed."""
    counts = {name.replace(" ", "_"): int(np.sum(status == code)) for code, name in STATUS_NAMES.items()}
    words: dict[str, Any] = {f"incidences_{name}": count for name, count in counts.items()}
    if errors:
        words["errors"] = "\n".join(f"incidence {row}: {text}" for row, text in errors[:SHOWN])
    return words


def as_dataset(plan: SweepPlan, arrays: Arrays, errors: list[tuple[int, str]]) -> "xarray.Dataset":
    """Dataset in memory.

    Parameters
    ----------
    plan : SweepPlan
    arrays : dict of arrays
        Of `SweepRequest.variables`, the first axis the incidence.
    errors : list of (incidence, message)
    """
    request, unit = plan.request, unit_of(plan.body)
    variables = {
        name: (("incidence", *variable.dims), arrays[name], variable_attributes(request, name, unit))
        for name, variable in request.variables.items()
    }
    words = sweep_attributes(plan, unit) | count_attributes(arrays["incidence_status"], errors)
    found: xarray.Dataset = register().Dataset(variables, coordinates(request, plan.incidences, unit), words)
    return found


def without_complex(dataset: "xarray.Dataset") -> "xarray.Dataset":
    """Dataset with ``name_real`` and ``name_imag`` for each complex variable: netCDF has no complex numbers.

    Zarr keeps complex numbers as they are.
    """
    changed = dataset
    for name, values in dataset.data_vars.items():
        if values.dtype.kind == "c":
            parts = {f"{name}_{part}": getattr(values, part).assign_attrs(values.attrs) for part in ("real", "imag")}
            changed = changed.drop_vars(name).assign(parts)
    return changed


class SweepFields:
    """Fields of a sweep's dataset.

    Examples
    --------
    >>> import creeping as cr, scatterers as sc
    >>> flow = cr.DirectFlow(sc.Sphere(), rtol=1e-6)
    >>> ds = cr.sweep_directions(flow, [(0, 0, 1)], wavenumbers=30.0, boundary="pec", n_rays=32)
    >>> float(ds.field.polarisation("VV").dbsm[0, 0].round(1))                # 10 log10(pi radius^2)
    5.0
    """

    def __init__(self, dataset: "xarray.Dataset") -> None:
        self.dataset = dataset

    @property
    def unit(self) -> str:
        """Unit of lengths: "m" where the body knows it, else "L"."""
        stated = self.dataset["wavenumber"].attrs.get("units") if "wavenumber" in self.dataset.coords else None
        return "m" if stated == power("m", -1) else "L"

    @property
    def total(self) -> "xarray.DataArray":
        """Far-field amplitude, L; of a conductor, which stands apart if there are scalar boundaries too, see `pec`."""
        name = next((name for name in ("total", "total_pec") if name in self.dataset), None)
        if name is None:
            raise InvalidInputError("the dataset has no field; ask for quantity 'monostatic' or 'bistatic'")
        return self.dataset[name].assign_attrs(units=self.unit, long_name="far-field amplitude f")

    @property
    def pec(self) -> "SweepFields":
        """The same of the conductor alone."""
        names = [str(name) for name in self.dataset.data_vars if str(name).endswith("_pec")]
        if not names:
            raise InvalidInputError(
                f"the sweep has no conductor; its boundaries are {self.dataset.attrs.get('boundaries')}"
            )
        scalar = [name.removesuffix("_pec") for name in names]
        plain = self.dataset.drop_vars([name for name in scalar if name in self.dataset])
        return SweepFields(plain.rename(dict(zip(names, scalar, strict=True))))

    @property
    def error(self) -> "xarray.DataArray":
        """Error of the amplitude's magnitude, L."""
        return self.dataset["error" if "error" in self.dataset else "error_pec"]

    @property
    def unresolved(self) -> "xarray.DataArray":
        """Whether a direction is unresolved."""
        return self.dataset["unresolved" if "unresolved" in self.dataset else "unresolved_pec"]

    @property
    def cross_section(self) -> "xarray.DataArray":
        """4 pi |f|^2, L^2."""
        found = 4 * np.pi * abs(self.total) ** 2
        return found.assign_attrs(units=power(self.unit, 2), long_name="cross section 4 pi |f|^2")

    @property
    def dbsm(self) -> "xarray.DataArray":
        """Radar cross section, 10 log10(4 pi |f|^2): dBsm where the body knows that L is the metre."""
        units = "dBsm" if self.unit == "m" else "dB re 1 L^2"
        return self._decibels(self.total, 4 * np.pi, units, "radar cross section")

    @property
    def target_strength(self) -> "xarray.DataArray":
        """Target strength, 20 log10 |f|: dB relative to a metre if L is the metre."""
        return self._decibels(self.total, 1.0, f"dB re 1 {self.unit}", "target strength")

    def polarisation(self, name: str) -> "SweepFields":
        """Fields of one polarisation of a conductor, "HH", "HV", "VH" or "VV": received, then transmitted.

        V is along theta and H along phi, each at its own direction of travel.

        Raises
        ------
        InvalidInputError
            If it is none of these, or there is no conductor.
        """
        if name not in POLARISATIONS:
            raise InvalidInputError(f"polarisation {name!r} is none of {', '.join(POLARISATIONS)}")
        scattered, incident = POLARISATIONS[name]
        return SweepFields(self.pec.dataset.sel(scattered=scattered, incident=incident))

    def _decibels(self, values: "xarray.DataArray", factor: float, units: str, text: str) -> "xarray.DataArray":
        with np.errstate(divide="ignore"):
            found = 10 * np.log10(factor * abs(values) ** 2)
        result: xarray.DataArray = found.assign_attrs(units=units, long_name=text)
        return result


def register() -> Any:
    """Make ``dataset.field`` known to xarray, once, and return xarray."""
    xarray = require("xarray")
    if not hasattr(xarray.Dataset, "field"):
        xarray.register_dataset_accessor("field")(SweepFields)
    return xarray
