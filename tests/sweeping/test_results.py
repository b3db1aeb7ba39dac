"""Datasets of sweeps: what stands in them, that files keep it, and that bad input is refused with what is wrong."""

import itertools

import fake_sweeps as fake
import numpy as np
import pytest
import shared_bodies as sc
import xarray

import creeping as cr
from creeping.storage import memory
from creeping.sweeping import results as dataset
from creeping.sweeping import run
from creeping.sweeping.plan import SweepPlan
from creeping.sweeping.request import sweep_request

REQUESTS = {
    "rays": sweep_request("rays", length=2.0, n_rays=5, n_steps=4),
    "monostatic": sweep_request("monostatic", length=2.0, wavenumbers=[5, 9], boundary=["soft", "hard", "pec"]),
    "bistatic": sweep_request(
        "bistatic", length=2.0, wavenumbers=7, boundary="impedance:0.5+0.2j", observation=[(0, 0, 2), (1, 0, 0)]
    ),
}


def blank(quantity):
    """Dataset without results, but with all that stands around them."""
    directions = cr.fibonacci_directions(6)
    plan = SweepPlan(fake.FLOW, REQUESTS[quantity], directions, 6, text="[study]\n")
    return dataset.as_dataset(plan, plan.request.empty(6), [(3, "overflow"), (5, "")])


@pytest.mark.parametrize("quantity", REQUESTS)
def test_variables_have_the_dimensions_units_and_words_of_the_request(quantity):
    ds = blank(quantity)
    assert list(ds.data_vars) == list(REQUESTS[quantity].variables)
    for name, variable in REQUESTS[quantity].variables.items():
        assert ds[name].dims == ("incidence", *variable.dims) and ds[name].dtype == variable.dtype
        assert ds[name].attrs["units"] and ds[name].attrs["description"]
    assert ds.attrs["incidences_failed"] == 6 and ds.attrs["incidences_ok"] == 0
    assert ds.attrs["errors"] == "incidence 3: overflow\nincidence 5: "
    assert ds.attrs["body"] == "Sphere(radius=1.0, speed=None)" and ds.attrs["flow_rtol"] == 1e-6
    assert ds.attrs["study"] == "[study]\n" and ds.attrs["creeping_version"] == cr.__version__


def test_coordinates():
    ds = blank("rays")
    sine = np.sin(ds.theta)
    assert ds.direction.values.T == pytest.approx(
        np.stack([sine * np.cos(ds.phi), sine * np.sin(ds.phi), np.cos(ds.theta)])
    )
    assert ds.travel_time.values == pytest.approx([0.5, 1.0, 1.5, 2.0])
    ds = blank("monostatic")
    assert ds["creeping"].sel(wavenumber=9, boundary="hard").shape == (6,)
    assert ds.creeping_pec.dims == ("incidence", "wavenumber", "scattered", "incident")
    assert blank("bistatic").observation.values.tolist() == [[0, 0, 1], [1, 0, 0]]


@pytest.mark.parametrize("quantity", REQUESTS)
def test_files_keep_everything(quantity, tmp_path):
    ds = blank(quantity)
    # strings of fixed length are no part of zarr's format 3
    texts = {name: c.astype(object) for name, c in ds.coords.items() if c.dtype.kind == "U"}
    ds.assign_coords(texts).to_zarr(tmp_path / "ds.zarr", consolidated=False)
    with xarray.open_zarr(tmp_path / "ds.zarr", consolidated=False) as back:
        xarray.testing.assert_equal(back.load(), ds)
        assert back.attrs == ds.attrs
    real = dataset.without_complex(ds)
    assert not [name for name, values in real.data_vars.items() if values.dtype.kind == "c"]
    real.to_netcdf(tmp_path / "ds.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "ds.nc", engine="h5netcdf") as back:
        xarray.testing.assert_equal(back.load(), real)
        assert {name: np.asarray(v).tolist() for name, v in back.attrs.items()} == ds.attrs
        assert back.line_length.attrs["units"] == "L"


def test_a_missing_package_is_named_with_its_remedy(monkeypatch):
    def gone(name):
        raise ModuleNotFoundError(name=name)

    monkeypatch.setattr(memory, "import_module", gone)
    with pytest.raises(cr.CreepingError, match=r"need xarray: pip install 'creeping\[sweep\]'"):
        cr.sweep_directions(fake.FLOW, [(0, 0, 1)], quantity="rays")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"directions": [(0, 0, 1), (0, 0, 0)]}, "1 of 2 directions is zero .rows 1"),
        ({"directions": (0, 0, 1)}, r"shape \(3,\); give rows"),
        ({"n_rays": 0, "length": -1.0, "wavenumbers": 3}, "length = -1.0 .*; n_rays = 0 .*; wavenumbers belong"),
        ({"quantity": "monostatic"}, "needs wavenumbers"),
        ({"quantity": "monostatic", "wavenumbers": 1.0, "boundary": "sfot"}, "sfot"),
        ({"quantity": "bistatic", "wavenumbers": 1.0}, "observation"),
        ({"chunk": 0}, "chunk = 0"),
        ({"quantity": "monostatic", "wavenumbers": 1.0, "method": "both"}, "none of rays, auto, currents"),
        ({"method": "auto"}, "quantity 'rays' has none"),
        ({"resume": True}, "resume goes with store="),
        ({"client": "tcp://nowhere:1"}, "client goes with store=.*seen by all workers"),
        ({"directions": np.ones((3_000_000, 3)), "n_rays": 60_000}, "GB of results; give store="),
        ({"n_rays": 65_536, "n_steps": 4096}, "one incidence gives 19.3 GB of results.*fewer rays or steps"),
    ],
)
def test_bad_input_is_refused_before_anything_is_computed(options, words):
    with pytest.raises(cr.InvalidInputError, match=words):
        cr.sweep_directions(fake.FLOW, **({"directions": [(0, 0, 1)], "quantity": "rays"} | options))


def test_rays_of_a_sweep_are_as_long_as_the_lowest_wavenumber_asks():
    ball = sc.Sphere(radius=2.0)
    flow = cr.DirectFlow(ball, rtol=1e-6)
    ds = cr.sweep_directions(flow, [(0, 0, 1), (1, 2, 3)], wavenumbers=[40.0, 15.0], n_rays=16)
    line = cr.shadow_line(ball, (0, 1, 0))
    assert ds.attrs["length"] == pytest.approx(cr.launch(flow, line, wavenumber=15.0).length, rel=1e-12)
    assert not np.any(ds.unresolved)
    assert ds.least_k_rho.values == pytest.approx(np.array([[80.0, 30.0]] * 2), rel=1e-6)
    assert ds.largest_transverse.values == pytest.approx((2 / np.array([[80.0, 30.0]] * 2)) ** (2 / 3), rel=1e-6)
    rays = cr.sweep_directions(flow, [(0, 0, 1)], quantity="rays", n_rays=16)
    assert rays.attrs["length"] == pytest.approx(cr.launch(flow, line).length, rel=1e-12)
    assert rays.least_radius.values == pytest.approx(2.0) and rays.transverse.values == pytest.approx(8 ** (1 / 3) / 2)
    short = {"length": 0.4, "n_rays": 16, "wavenumbers": 40.0, "boundary": "hard"}
    seen = cr.sweep_directions(flow, [(0, 0, 1)], quantity="bistatic", observation=[(0, 4, 3), (0, 0, -1)], **short)
    assert seen.unresolved.values.ravel().tolist() == [True, False]


@pytest.mark.slow
@pytest.mark.parametrize(
    "make", [sc.Sphere, lambda: sc.Implicit("max(x**2 + y**2 + z**2 - 1, x**2 + y**2 + (z - 1)**2 - 1)")]
)
def test_progress_is_told_between_the_frequencies_of_one_direction(monkeypatch, make):
    monkeypatch.setattr(run, "EVERY", 0.0)
    seen = []
    asked = {"wavenumbers": [10.0, 11.0, 12.0, 13.0], "n_rays": 16, "length": 2.0}
    cr.sweep_directions(cr.DirectFlow(make(), rtol=1e-6), [(0, 0.6, 0.8)], progress=lambda *a: seen.append(a), **asked)
    assert [one[:2] for one in seen] == [(0.25, 1), (0.5, 1), (0.75, 1), (1, 1)]
    assert all(first[2] <= second[2] for first, second in itertools.pairwise(seen))
