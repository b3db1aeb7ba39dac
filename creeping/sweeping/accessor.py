"""What one wants of the fields of a sweep, as ``dataset.field``: totals, cross sections, decibels, polarisations.

The dataset holds amplitudes; sizes and logarithms are made when they are asked for.
"""

from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any
from creeping.errors import InvalidInputError
from creeping.field.labelled import power
from creeping.storage.extras import required

if TYPE_CHECKING:
    import xarray

POLARISATIONS = {"VV": ("theta", "theta"), "VH": ("theta", "phi"), "HV": ("phi", "theta"), "HH": ("phi", "phi")}
"""Scattered by incident component: V is along theta, vertical where z is up and the wave level, H along phi."""


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
            raise InvalidInputError("the sweep has no conductor; its boundaries are " + self._boundaries)
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

    @property
    def _boundaries(self) -> str:
        return str(self.dataset.attrs.get("boundaries", "none"))

    def _decibels(self, values: "xarray.DataArray", factor: float, units: str, text: str) -> "xarray.DataArray":
        with np.errstate(divide="ignore"):
            found = 10 * np.log10(factor * abs(values) ** 2)
        result: xarray.DataArray = found.assign_attrs(units=units, long_name=text)
        return result


def register() -> Any:
    """Make ``dataset.field`` known to xarray, once, and return xarray."""
    xarray = required("xarray", use="sweeps need", extra="sweep")
    if not hasattr(xarray.Dataset, "field"):
        xarray.register_dataset_accessor("field")(SweepFields)
    return xarray
