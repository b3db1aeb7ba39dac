"""Fields asked for with bad input: each its own clear error; empty input gives empty fields."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr

D = (0.0, 0.0, 1.0)
SPHERE = sc.Sphere()
NAN = float("nan")
FIELDS = {
    "far": lambda fan, **options: cr.far_field(fan, options.pop("at", [[0.0, 0.6, -0.8]]), **options),
    "near": lambda fan, **options: cr.near_field(fan, options.pop("at", [[0.0, 0.2, 1.5]]), **options),
    "surface": lambda fan, **options: cr.surface_field(fan, options.pop("at", [[0.0, 0.6, 0.8]]), **options),
}


def launched(body=SPHERE, **options):
    options = {"length": 3.5, "n_rays": 24, "max_gap": np.inf} | options
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, D), **options)


@pytest.fixture(scope="module")
def fan():
    return launched()


@pytest.fixture(params=list(FIELDS))
def field(request):
    return FIELDS[request.param]


@pytest.mark.parametrize(
    "bad",
    [
        *({"wavenumber": k} for k in (0, -1.0, NAN, "ten", None, 1j, [10.0, 20.0], 1e-7, 1e9)),
        *({"order": order} for order in (0, 3, 1.5, "2")),
        *({"boundary": boundary} for boundary in ("softt", None, 1j)),
    ],
    ids=str,
)
def test_bad_options_are_named(field, fan, bad):
    (name,) = bad
    with pytest.raises(cr.CreepingError, match=name):
        field(fan, **({"wavenumber": 10.0} | bad))


@pytest.mark.parametrize("at", [[1.0, 0.0], 3.0, [[1.0, 0, 0, 0]], "abc", [[1.0, 2.0], [3.0]], {"x": 1}], ids=str)
def test_points_of_a_wrong_shape_or_that_are_no_numbers_are_named(field, fan, at):
    match = "observation|points" if at in ("abc", {"x": 1}, [[1.0, 2.0], [3.0]]) else "shape"
    with pytest.raises(cr.CreepingError, match=match):
        field(fan, at=at, wavenumber=10.0)


def test_a_conductor_has_functions_of_its_own(fan):
    for name in ("near", "surface"):
        with pytest.raises(cr.CreepingError, match="conductor_field gives its E and H"):
            FIELDS[name](fan, wavenumber=10.0, boundary="pec")


@pytest.mark.parametrize("bad", [NAN, float("inf")])
def test_rows_that_are_not_finite_are_counted(field, fan, bad):
    at = np.array([[0.0, 0.6, 0.8], [bad, 0, 1], [0.6, 0.0, 0.8]])
    with pytest.raises(cr.CreepingError, match="1 of 3"):
        field(fan, at=at, wavenumber=10.0)


def test_a_direction_of_no_length_is_counted(fan):
    with pytest.raises(cr.CreepingError, match="1 of 2 observation directions is zero"):
        cr.far_field(fan, [[0.0, 0, 1], [0.0, 0, 0]], wavenumber=10.0)


def test_points_inside_are_counted(fan):
    at = [[0.0, 0.2, 1.5], [0.0, 0, 0.7], [0.1, 0, 0.2]]
    with pytest.raises(cr.CreepingError, match=r"2 of 3 points are inside the body \(worst: row 2"):
        cr.near_field(fan, at, wavenumber=10.0)
    with pytest.raises(cr.CreepingError, match="1 of 1 points are inside"):
        cr.near_field(fan, [[0.0, 0, 0]], wavenumber=10.0)


def test_points_off_the_body_are_counted(fan):
    at = [[0.0, 0.6, 0.8], [0.0, 0, 1.7]]
    with pytest.raises(cr.CreepingError, match="1 of 2 points are off the body"):
        cr.surface_field(fan, at, wavenumber=10.0)


def test_weighted_bodies_are_refused(field):
    fan = launched(sc.Sphere(speed="1 + x/4"), length=1.0)
    # with no points as well
    for options in ({}, {"at": np.zeros((0, 3))}):
        with pytest.raises(cr.CreepingError, match="speed"):
            field(fan, wavenumber=10.0, **options)
    with pytest.raises(cr.CreepingError, match="speed"):
        cr.surface_field(fan, wavenumber=10.0)


@pytest.mark.parametrize("boundary", ["soft", "pec"])
def test_no_points_give_empty_fields(fan, boundary):
    for field in (cr.near_field, cr.surface_field):
        assert field(fan, np.zeros((0, 3)), wavenumber=10.0).shape == (0,)
    far = cr.far_field(fan, np.zeros((0, 3)), wavenumber=10.0, boundary=boundary)
    assert far.total.shape == ((0, 2, 2) if boundary == "pec" else (0,))
    assert len(repr(far).splitlines()) == 3


def no_rays():
    """A fan none of whose arcs has a ray."""
    fan = launched()
    arrays = ("points", "directions", "eikonal", "spreading", "spreading_rate", "curvature", "caustic_index")
    rows = (*arrays, "status", "detachment", "curve_index", "arc_index", "arclength", "spacing")
    values = {name: getattr(fan, name) for name in fan.__dataclass_fields__}
    values |= {name: values[name][:0] for name in rows} | {"closed_arcs": ()}
    return cr.RayFan(**values)


def test_a_fan_without_rays_sheds_nothing():
    fan = no_rays()
    far = cr.far_field(fan, [[0.0, 0.6, -0.8], [0.6, 0.0, 0.8]], wavenumber=20.0, method="rays")
    np.testing.assert_array_equal(far.creeping, 0)
    # the mirror needs no creeping ray
    assert np.all(np.abs(far.reflected) > 0.1)
    assert cr.near_field(fan, [[0.0, 0.2, 1.5]], wavenumber=20.0, method="rays") == 0
    assert cr.surface_field(fan, [[0.0, 0.6, 0.8]], wavenumber=20.0) == 0
    assert cr.surface_field(fan, wavenumber=20.0).shape == (0, len(fan.travel_time))


@pytest.mark.parametrize(("n_rays", "boundary"), [(1, "soft"), (2, cr.ImpedanceBoundary(1)), (3, "soft")])
def test_a_fan_of_few_rays_gives_finite_fields_or_says_so(n_rays, boundary):
    fan = launched(n_rays=n_rays)
    far = cr.far_field(fan, [[0.0, 0.6, -0.8], [0.6, 0.0, 0.8]], wavenumber=20.0, boundary=boundary)
    assert np.all(np.isfinite(far.total))
    assert cr.near_field(fan, [[0.0, 0.2, 1.5]], wavenumber=20.0, boundary=boundary).shape == (1,)


def test_shapes_of_observers_are_kept_near_and_flattened_far(fan):
    at = np.array([[[0.0, 0.3, 1.4], [0.1, 0.2, 1.3]]])
    assert cr.near_field(fan, at, wavenumber=10.0).shape == (1, 2)
    assert cr.near_field(fan, at[0, 0], wavenumber=10.0).shape == ()
    assert cr.far_field(fan, at, wavenumber=10.0).directions.shape == (2, 3)
    # lengths of directions mean nothing
    np.testing.assert_allclose(
        cr.far_field(fan, 7 * at, wavenumber=10.0).total, cr.far_field(fan, at, wavenumber=10.0).total, rtol=1e-9
    )
