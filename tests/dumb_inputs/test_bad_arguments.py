"""Arguments of another kind than was asked for: each refused by its name, by an error of ours."""

import datetime

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.geometry.arguments import positive_number, real_array, whole_number

BODY = sc.Ellipsoid(1.2, 0.8, 0.8)
FLOW = cr.DirectFlow(BODY, rtol=1e-8)
X, P = [[1.2, 0, 0]], [[0, 1, 0]]


@pytest.fixture(scope="module")
def line():
    return cr.shadow_line(BODY, (0, 0, 1), n_points=64)


@pytest.fixture(scope="module")
def fan(line):
    return cr.launch(FLOW, line, length=2.0, n_rays=16, n_steps=16)


NUMBERS_THAT_ARE_NONE = {
    "complex": (np.array([1 + 1j]), "complex"),
    "text": ("1.0", "not an array of numbers"),
    "texts": (["1", "2"], "not an array of numbers"),
    "flags": ([True, False], "not an array of numbers"),
    "masked": (np.ma.masked_array([1.0, 2.0], mask=[True, False]), "masked"),
    "dates": ([np.datetime64("2020-01-01")], "not an array of numbers"),
    "durations among others": (np.array([1.0, np.timedelta64(2)], dtype=object), "not an array of numbers"),
    "ragged": ([[1.0], [1.0, 2.0]], "not an array of numbers"),
    "too many": (range(10**12), "are more than"),
    "too large": (np.broadcast_to(1.0, (10**12,)), "GB of memory"),
}


@pytest.mark.parametrize("which", NUMBERS_THAT_ARE_NONE)
def test_arrays_that_are_no_numbers(which):
    values, match = NUMBERS_THAT_ARE_NONE[which]
    with pytest.raises(cr.InvalidInputError, match=f"lengths.*{match}"):
        real_array(values, "lengths")


@pytest.mark.parametrize("value", [None, "2", 2j, np.ones(1), datetime.timedelta(1), np.timedelta64(2), True])
def test_numbers_that_are_none(value):
    with pytest.raises(cr.InvalidInputError, match="gap = "):
        positive_number(value, "gap")
    with pytest.raises(cr.InvalidInputError, match="count = "):
        whole_number(value, "count")


WITH_BODY = {
    "shadow_line": lambda body: cr.shadow_line(body, (0, 0, 1)),
    "check_surface": cr.check_surface,
    "trace": lambda body: cr.trace(body, X, P, 1.0),
    "DirectFlow": cr.DirectFlow,
    "build_phase_map": lambda body: cr.build_phase_map(body, horizon=0.5, cache=False),
    "choose_flow": lambda body: cr.choose_flow(body, n_rays=4, length=1.0, cache=False),
    "load_phase_map": lambda body: cr.load_phase_map("nowhere", body),
}
NO_BODIES = {"number": 3, "class": sc.Sphere, "flow": FLOW}


@pytest.mark.parametrize("which", NO_BODIES)
@pytest.mark.parametrize("name", WITH_BODY)
def test_what_is_no_body(name, which):
    with pytest.raises(cr.InvalidInputError, match=r"body = .* (is no body|is a class)"):
        WITH_BODY[name](NO_BODIES[which])


WITH_FAN = {
    "iso_phase_curves": lambda fan: cr.iso_phase_curves(fan, [0.5]),
    "surface_field": lambda fan: cr.surface_field(fan, wavenumber=10.0),
    "near_field": lambda fan: cr.near_field(fan, [[0, 0, 2]], wavenumber=10.0),
    "far_field": lambda fan: cr.far_field(fan, [[0, 0, 1]], wavenumber=10.0),
    "far_field_uncertainty": lambda fan: cr.far_field_uncertainty(fan, [[0, 0, 1]], wavenumber=10.0),
    "surface_currents": lambda fan: cr.surface_currents(fan, wavenumber=10.0),
    "body_uncertainty": cr.body_uncertainty,
    "validity": lambda fan: cr.validity(fan, wavenumber=10.0),
}


@pytest.mark.parametrize("value", [None, FLOW], ids=repr)
@pytest.mark.parametrize("name", WITH_FAN)
def test_what_is_no_fan(name, value):
    with pytest.raises(cr.InvalidInputError, match=r"fan = .* is no RayFan; make one by creeping.launch"):
        WITH_FAN[name](value)


@pytest.mark.parametrize("value", [None, BODY, cr.DirectFlow], ids=repr)
def test_what_is_no_flow_or_line(line, value):
    with pytest.raises(cr.InvalidInputError, match="is no flow"):
        cr.launch(value, line, length=1.0)
    with pytest.raises(cr.InvalidInputError, match="is no flow"):
        cr.sweep_directions(value, [(0, 0, 1)], wavenumbers=10.0)
    with pytest.raises(cr.InvalidInputError, match="is no ShadowLine"):
        cr.launch(FLOW, value, length=1.0)


def sweep(**options):
    return cr.sweep_directions(FLOW, [(0, 0, 1)], wavenumbers=9.0, **options)


CALLS = {
    "steps of states": (lambda line, fan: FLOW.transport(np.ones((2, 7)), [1.0]), "states have shape"),
    "states": (lambda line, fan: FLOW.transport(None, [1.0]), "states"),
    "error": (lambda line, fan: cr.DirectFlow(BODY, error=3), "no ErrorEstimate"),
    "launch points": (lambda line, fan: line.launch_points(None), "n_rays"),
    "length": (lambda line, fan: cr.launch(FLOW, line, length=np.ones(2)), "length"),
    "of": (lambda line, fan: cr.iso_phase_curves(fan, [1.0], of=np.ones(2)), "neither 'travel_time'"),
    "tolerance": (lambda line, fan: cr.build_phase_map(BODY, tolerance="1e-6", cache=False), "tolerance"),
    "store": (lambda line, fan: sweep(store=3), "store"),
    "wavenumber": (lambda line, fan: cr.far_field(fan, [(0, 0, 1)], wavenumber=1e300), "another unit of length"),
    "length beyond all": (lambda line, fan: cr.launch(FLOW, line, length=2**63, n_steps=8), "sizes of the body"),
    "length below all": (lambda line, fan: sweep(length=1e-9), "less than 1e-06 sizes of the body"),
    "chunk": (lambda line, fan: sweep(chunk=np.timedelta64(3, "s")), "chunk"),
    "complex": (lambda line, fan: cr.near_field(fan, [[0, 0, 3j]], wavenumber=9.0), "points are complex"),
}  # fmt: skip


@pytest.mark.parametrize("which", CALLS)
def test_arguments_of_another_kind(line, fan, which):
    call, match = CALLS[which]
    with pytest.raises(cr.CreepingError, match=match):
        call(line, fan)


def test_growth_is_asked_for_lengths():
    growth = cr.ErrorGrowth(lengths=(1.0, 2.0), rms=(1e-9, 2e-9), max=(3e-9, 6e-9), bound=9e-9)
    for ask in (growth.rms_after, growth.trusted_length):
        for value in (None, "1", float("nan"), -1.0):
            with pytest.raises(cr.InvalidInputError):
                ask(value)


@pytest.mark.parametrize("folder", [None, 3, "", "a\0b", []])
def test_folders_that_are_none(folder):
    with pytest.raises(cr.InvalidInputError, match="folder"):
        cr.load_phase_map(folder, BODY)


@pytest.mark.slow
def test_a_cache_that_cannot_be_written_is_gone_without():
    said = []
    cr.build_phase_map(BODY, horizon=0.5, grid=(12, 12), degree=3, cache="/proc", progress=said.append)
    assert any("no cache in /proc" in line for line in said)


def test_bodies_refuse_as_well():
    ball = "x**2 + y**2 + z**2 - 1"
    for make, match in (
        (lambda: sc.Sphere(10**400), "not a finite number"),
        (lambda: sc.Implicit(ball, range(10**12)), "are not numbers"),
        (lambda: sc.Gridded.sampled(BODY, 2**31), r"whole numbers from .* to 1000"),
        (lambda: sc.examined_mesh("a" * 5000, "m"), "no name of a file"),
        (lambda: sc.examined_mesh("body.stl", np.ones(2)), "is none of"),
    ):
        with pytest.raises(ValueError, match=match):
            make()


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda: cr.backscatter(BODY, wavenumbers=cr.wavenumber(10)), "8e-08 wavelengths.*0.0003 to 1e[+]06"),
        (lambda: cr.solve(BODY, (1, 0, 0), wavenumber=1e8, boundary="pec"), "more than any field"),
        (lambda: cr.t_matrix(BODY, wavenumber="10 GHz", boundary="pec"), "give creeping.wavenumber.'10 GHz'"),
        (lambda: cr.sweep_directions(FLOW, [P[0]], quantity="monostatic", wavenumbers=[1, 1e8]), "3.8e[+]07 wavelen"),
        (lambda: cr.backscatter(BODY, wavenumbers=9, azimuth=np.linspace(0, 2 * np.pi, 73)), "for 360 degrees at most"),
        (lambda: cr.bistatic(BODY, wavenumbers=9, elevation=np.radians([0, 45])), "elevation is in radians"),
        (lambda: cr.wavenumber("38 kHz", sound_speed=1.5), "of 1.5 km/s give 1500"),
    ],
)
def test_a_forgotten_unit_is_told_of(ask, words):
    with pytest.raises(cr.InvalidInputError, match=words):
        ask()


def test_small_angles_in_degrees_are_taken():
    """Whole degrees as radians have no exact digits: 0, 1e-12 and 3.14 are degrees."""
    from creeping.sweeping.echoes import _angles

    for angles in ([0.0], [1e-12, 0.0], [3.14], [0.5, 1.0]):
        assert _angles(angles, 0.0)[0].tolist() == angles


@pytest.mark.parametrize(
    ("package", "name", "words"),
    [
        (cr, "backscater", "did you mean backscatter?"),
        (cr, "farfield", "did you mean far_field or"),
        (cr, "rcs", "it is creeping.backscatter"),
        (cr, "target_strength", "field.target_strength"),
        (cr, "Sphere", "import scatterers as sc, then sc.Sphere"),
        (sc, "Spere", "did you mean Sphere"),
        (sc, "Box", "it has Almond"),
    ],
)
def test_a_name_that_is_none_leads_to_one_that_is(package, name, words):
    with pytest.raises(AttributeError, match=words):
        getattr(package, name)


@pytest.mark.slow
def test_what_a_guessed_name_leads_to_works():
    """The texts are calls: on a sphere pi radius^2, and radius/2, within half a decibel."""
    for name, far in (("rcs", np.pi * 0.15**2), ("target_strength", 0.15**2 / 4)):
        with pytest.raises(AttributeError) as told:
            getattr(cr, name)
        call = str(told.value).partition("it is ")[2]
        found = eval(call, {"creeping": cr, "body": sc.Sphere(0.15)})
        assert float(np.ravel(found)[0]) == pytest.approx(10 * np.log10(far), abs=0.5)
