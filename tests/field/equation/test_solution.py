"""`creeping.solve`: against series of the sphere, and by what must hold of any body."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import creeping as cr
import scatterers as sc
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.equation import columns, effort, solving
from creeping.field.equation.currents import TileCurrents
from creeping.field.equation.effort import Effort, plan_of
from tests.reference import sphere

D = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, -0.8]])
R = cr.fibonacci_directions(60)
CYLINDER = sc.Cylinder(1.0, 2.0)
ETA = 0.5 + 0.2j


@pytest.fixture(scope="module")
def flat():
    """Hard cylinder at three incidences and back: k = 3."""
    d = np.array([[1.0, 0.0, 0.0], [1.0, 0.0, 6e-17], [0.0, 0.0, 1.0], [0.48, 0.6, -0.64]])
    return cr.solve(CYLINDER, np.concatenate([d, -d]), wavenumber=3.0, boundary="hard")


@pytest.mark.parametrize("boundary", ["soft", "hard", cr.ImpedanceBoundary(ETA)])
def test_stated_errors_at_each_height_are_those_of_the_series(boundary, rng):
    """k = 10, where tiles are as wide as they are for any larger k."""
    k, d = 10.0, D[1]
    found = cr.solve(sc.Sphere(), d, wavenumber=k, boundary=boundary)
    n = rng.normal(size=(60, 3))
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    known = ETA if isinstance(boundary, cr.ImpedanceBoundary) else boundary
    series = sphere.surface_derivative if boundary == "soft" else sphere.surface_field
    fields = [(found.surface_field(n), series(k, 1.0, n @ d, known))]
    for height in (1e-3, 0.03, 0.1, 0.3, 1.0, 3.0):
        x = (1 + height) * n
        fields.append((found.near_field(x), sphere.total_field(k, 1.0, x, d, known)))
    for field, exact in fields:
        off = np.abs(field.values - exact)
        assert np.mean(off <= field.error) > 0.95
        # on the body, and up to 3 radii off it
        assert np.median(field.error / off) < 20


@pytest.mark.parametrize("boundary", ["soft", "hard", cr.ImpedanceBoundary(ETA)])
def test_sphere_against_its_series_far_near_and_on_it(boundary):
    k = 4.0
    known = ETA if isinstance(boundary, cr.ImpedanceBoundary) else boundary
    found = cr.solve(sc.Sphere(), D, wavenumber=k, boundary=boundary)
    assert "2 incidences" in repr(found)
    heights = np.array([0.0, 1e-4, 1e-2, 0.3, 2.0])
    x = (1 + heights)[:, None] * R[: len(heights)]
    for number, d in enumerate(D):
        far, exact = found.far_field(R, number), sphere.far_field(k, 1.0, R @ d, known)
        assert np.sqrt(np.mean(np.abs(far.total - exact) ** 2)) < 1e-3 * np.abs(exact).max()
        assert np.mean(np.abs(far.total - exact) <= far.error) > 0.9
        off = found.near_field(x[1:], number)
        assert_allclose(off.values, sphere.total_field(k, 1.0, x[1:], d, known), atol=3e-3)
        on = found.surface_field(R, number)
        field = sphere.surface_derivative if boundary == "soft" else sphere.surface_field
        assert_allclose(on.values, field(k, 1.0, R @ d, known), atol=3e-3 * (k if boundary == "soft" else 1))
        assert np.all(off.ok) and np.all(on.ok)


def test_a_flat_ended_cylinder_broadside_and_end_on(flat):
    # broken conditions at edges take many steps, and leave large fields there
    assert flat.steps < 18 and np.abs(flat._values).max() < 3.2
    assert_allclose(flat.far_field(R, 0).total, flat.far_field(R, 1).total, atol=1e-6)
    assert max(flat.currents(number).extinction for number in range(8)) < 0.01


def test_reciprocity_and_the_optical_theorem_of_a_body_with_edges(flat):
    d = flat.directions
    f = np.array([flat.far_field(-d, number).total for number in range(8)])
    largest = np.abs([flat.far_field(d[n][None], n).total[0] for n in range(8)]).max()
    assert_allclose(f, f.T, atol=1e-3 * largest)
    u, w = np.polynomial.legendre.leggauss(14)
    phi = np.arange(28) * np.pi / 14
    s = np.sqrt(1 - u**2)[:, None]
    r = np.stack([s * np.cos(phi), s * np.sin(phi), np.repeat(u[:, None], 28, 1)], axis=-1).reshape(-1, 3)
    power = np.abs(flat.far_field(r, 3).total) ** 2 @ np.repeat(w * np.pi / 14, 28)
    assert power == pytest.approx(4 * np.pi / 3.0 * flat.far_field(d[3][None], 3).total[0].imag, rel=3e-3)


@pytest.mark.slow
def test_far_field_of_a_fan_is_that_of_the_equation_where_edges_diffract(flat):
    fan = cr.launch(cr.DirectFlow(CYLINDER, rtol=1e-8), cr.shadow_line(CYLINDER, (0.48, 0.6, -0.64)), length=2.0)
    for method in ("auto", "equation"):
        far = cr.far_field(fan, R, wavenumber=3.0, boundary="hard", method=method)
        assert set(far.method) == {"equation"} and far.validity is not None and not far.unresolved.any()
        assert_allclose(far.total, flat.far_field(R, 3).total, atol=1e-4)
    # kept with the body: it is solved once
    assert solving.solution_for(CYLINDER, fan.line.direction, 3.0, "hard") is not None
    by_rays = cr.far_field(fan, R[:3], wavenumber=3.0, boundary="hard", method="rays")
    assert set(by_rays.method) == {"rays+optics"}


@pytest.mark.slow
def test_a_sweep_solves_each_frequency_once_for_all_incidences(monkeypatch):
    asked, found, wavenumbers = [], [], np.array([1.0, 1.2])
    monkeypatch.setattr(solving, "KEPT", 1)
    known = solving._solved

    def noted(*of, **how):
        asked.append(of[2])
        found.append(known(*of, **how))
        return found[-1]

    monkeypatch.setattr(solving, "_solved", noted)
    body = sc.Cylinder(0.5, 1.0)
    ds = cr.backscatter(body, wavenumbers=wavenumbers, elevation=[10.0, 50.0], boundary="hard", method="equation")
    assert asked == wavenumbers.tolist()
    up = np.radians(ds["elevation"].values.ravel())
    one = found[0].backscatter()
    assert_allclose(one.directions, np.stack([np.cos(up), 0 * up, np.sin(up)], axis=1), atol=1e-12)
    assert_allclose(np.ravel(ds.total.sel(wavenumber=wavenumbers[0])), one.total, atol=1e-6)


@pytest.mark.parametrize("boundary", ["hard", "soft", "pec"])
@pytest.mark.parametrize("steps, share", [(3, 0.03), (10, 2e-3)])
def test_a_few_steps_on_coarse_tiles_know_their_error(boundary, steps, share):
    """From the currents of optics on, against the series of the sphere."""
    k, d = 10.0, np.array([0.48, 0.6, -0.64])
    r = cr.fibonacci_directions(200)
    solution = solving._solved(sc.Sphere(), d[None], k, boundary, Effort(True, steps))
    far = solution.far_field(r)
    if boundary == "pec":
        # both polarisations along and across the plane of scattering
        along, across = sphere.pec_far_field(k, 1.0, r @ d)
        size = np.sqrt(np.abs(along) ** 2 + np.abs(across) ** 2)
        off = np.abs(np.linalg.norm(far.total, axis=(1, 2)) - size)
        error = np.linalg.norm(far.error, axis=(1, 2))
    else:
        size = sphere.far_field(k, 1.0, r @ d, boundary)
        off, error = np.abs(far.total - size), far.error
    largest = 0.5 * k
    assert np.sqrt(np.mean(off**2)) < share * largest and np.mean(off <= error) > 0.95
    assert np.median(error) < 3 * share * largest


def test_what_takes_too_long_on_fine_tiles_is_solved_on_coarse_ones():
    fine = plan_of(CYLINDER, 6.0, "hard")
    assert not fine.effort.coarse
    solution = cr.solve(CYLINDER, D[0], wavenumber=6.0, boundary="hard", seconds=0.8 * fine.seconds)
    assert solution.effort.coarse and solution.nodes < fine.nodes and 3 <= solution.steps <= 10


def test_squares_that_do_not_share_their_sides_are_refused():
    class Torn(sc.Cylinder):
        def squares(self, at):
            found = super().squares(at)
            return found._replace(**{name: getattr(found, name)[1:] for name in ("places", "corners", "pieces")})

    with pytest.raises(SurfaceError, match="sides of the body's squares are not shared by two"):
        cr.solve(Torn(1.0, 2.0), (1, 0, 0), wavenumber=2.0, boundary="hard")


def test_units_scale(flat):
    small = cr.solve(sc.Cylinder(1e-3, 2e-3), (0.48, 0.6, -0.64), wavenumber=3e3, boundary="hard")
    assert_allclose(1e3 * small.far_field(R).total, flat.far_field(R, 3).total, atol=1e-5)


def test_backscatter_is_the_far_field_of_each_incidence(flat):
    back = flat.backscatter()
    assert back.directions.shape == (8, 3)
    for number in (2, 5):
        one = flat.far_field(-flat.directions[number], number)
        assert back.total[number] == one.total[0] and back.error[number] == one.error[0]


def test_on_the_axis_of_a_capsule_and_of_an_end_the_field_is_that_beside_it(flat):
    solution = cr.solve(sc.Capsule(0.5, 2.0), (0.48, 0.6, -0.64), wavenumber=2.0, boundary="hard")
    for found, top in ((solution, [0.0, 0.0, 1.0]), (flat, [0.0, 0.0, 1.0])):
        u = found.surface_field([top, np.add(top, [1e-5, 0.0, 0.0])], 0)
        assert np.all(u.ok) and abs(u.values[1] - u.values[0]) < 1e-3 and u.error.max() < 0.02


def test_next_to_edges_and_faces_the_field_is_continuous(flat):
    rim = np.array([1.0, 0.0, 1.0])
    out = np.array([1.0, 0.0, 1.0]) / np.sqrt(2)
    x = rim + np.array([1e-4, 3e-4, 1e-3])[:, None] * out
    u = flat.near_field(x, 0).values
    assert np.all(np.abs(np.diff(u)) < 0.05) and np.all(np.abs(u) < 2.5)
    side, above = [(1.0, 0.0, 0.3)], [(1.0001, 0.0, 0.3)]
    assert_allclose(flat.near_field(above, 0).values, flat.surface_field(side, 0).values, atol=5e-3)


def test_a_solution_serves_as_long_as_it_is_one(monkeypatch):
    """Rays and optics, which know of one reflection, may not stand for what is solved to a tenth."""
    d = np.array([0.6, 0.0, 0.8])
    for left, served in ((0.3, True), (1.5, False), (np.nan, False)):
        monkeypatch.setattr(TileCurrents, "extinction", left)
        assert (solving.solution_for(CYLINDER, d, 2.0, "hard") is not None) == served


def test_what_cannot_be_solved_is_told(flat, monkeypatch):
    with pytest.raises(InvalidInputError, match=r"nodes take about .* more than 0.001; give seconds="):
        cr.solve(CYLINDER, (1, 0, 0), wavenumber=3.0, boundary="soft", seconds=1e-3)
    with pytest.raises(InvalidInputError, match="1 of 2 points are inside the body"):
        flat.near_field([(0, 0, 0.2), (0, 0, 2)])
    with pytest.raises(InvalidInputError, match="boundary = 'rigid'"):
        cr.solve(CYLINDER, (1, 0, 0), wavenumber=3.0, boundary="rigid")
    monkeypatch.setenv("CREEPING_MEMORY", "1M")
    with pytest.raises(InvalidInputError, match=r"for 2 incidences is not solved: .* GB"):
        cr.solve(CYLINDER, D, wavenumber=3.0, boundary="soft")
    monkeypatch.delenv("CREEPING_MEMORY")
    told = []
    cr.solve(CYLINDER, (1, 0, 0), wavenumber=1.0, boundary="soft", progress=told.append)
    assert "nodes, about" in told[0]
    monkeypatch.setattr(effort, "SECONDS", 1e-9)
    assert solving.solution_for(CYLINDER, D[0], 2.9, "hard") is None
    monkeypatch.undo()
    assert plan_of(CYLINDER, 20.0, "pec").seconds > plan_of(CYLINDER, 20.0, "soft").seconds


def test_the_matrix_stays_for_incidences_to_come(monkeypatch):
    """A second incidence makes none, and comes out as on a body of its own."""
    made = []
    blocks_of = columns.blocks_of
    monkeypatch.setattr(columns, "blocks_of", lambda *given: made.append(1) or blocks_of(*given))
    bodies = [sc.Ellipsoid(1.0, 0.8, 0.6) for _ in range(2)]
    first, second, alone = (
        cr.solve(body, d, wavenumber=3.0, boundary="hard").far_field([(0.3, -1, 0.4)]).total
        for body, d in zip([bodies[0], bodies[0], bodies[1]], [(1, 0, 0), (0, 0.6, 0.8), (0, 0.6, 0.8)], strict=True)
    )
    assert len(made) == 2 and second == alone and second != first
    # another wavenumber is another matrix, and the first one's blocks go, though its solution stays
    kept = cr.solve(bodies[0], (1, 0, 0), wavenumber=3.0, boundary="hard")
    assert len(made) == 2 and kept._matrix.products
    cr.solve(bodies[0], (1, 0, 0), wavenumber=3.1, boundary="hard")
    assert len(made) == 3 and not kept._matrix.products


def test_blocks_that_are_there_serve_when_memory_has_become_short(monkeypatch):
    """They are of parities, which sums over all nodes know nothing of."""
    body, asked = sc.Ellipsoid(1.0, 0.8, 0.6), {"wavenumber": 3.0, "boundary": "hard"}
    alone = cr.solve(sc.Ellipsoid(1.0, 0.8, 0.6), (0, 0.6, 0.8), **asked).backscatter().total
    cr.solve(body, (1, 0, 0), **asked)
    monkeypatch.setattr(columns, "is_dense", lambda *_: False)
    assert cr.solve(body, (0, 0.6, 0.8), **asked).backscatter().total == alone
