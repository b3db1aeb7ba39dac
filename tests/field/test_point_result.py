"""Results of fields at points: arrays to numpy, with statuses that say what is the matter and what to do."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.equation import effort
from creeping.field.results.point_result import FieldStatus, judged, measured_field

K = 20.0
AT = np.array([(0.3, 0.1, 1.6), (0.0, 0.0, 1.5), (0.0, 0.2, -1.05), (0.0, 0.5, -2.0), (1.4, 0.0, 1.0)])


@pytest.fixture(scope="module")
def fan():
    ball = sc.Sphere()
    return cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, (0, 0, 1)), length=4.0, n_rays=48)


@pytest.fixture(scope="module")
def fields(fan):
    on = AT / np.linalg.norm(AT, axis=1, keepdims=True)
    return (
        cr.near_field(fan, AT, wavenumber=K, boundary="hard"),
        cr.surface_field(fan, on, wavenumber=K, boundary="soft"),
        cr.surface_field(fan, wavenumber=K, boundary="soft"),
    )


def test_they_act_as_arrays(fields):
    for u in fields:
        values = u.values
        assert (u.shape, u.ndim, u.size, u.dtype, len(u)) == (
            values.shape,
            values.ndim,
            values.size,
            values.dtype,
            len(values),
        )
        for mine, plain in (
            (np.abs(u), np.abs(values)),
            (2 * u - 1, 2 * values - 1),
            (u + u, 2 * values),
            (u.real, values.real),
            (np.asarray(u), values),
            (np.concatenate([u, u]), np.concatenate([values, values])),
            (u[1], values[1]),
            (u[..., None], values[..., None]),
            (np.array(list(u)), values),
            (np.sum(u), np.sum(values)),
            (u.ravel(), values.ravel()),
            (u.conj(), np.conj(values)),
        ):
            np.testing.assert_array_equal(mine, plain)
            assert not isinstance(mine, type(u))
        assert np.all(u == values)
    first = fields[0]
    assert complex(first[0]) == first.values[0]
    # a copy where one is asked for, the same memory otherwise
    assert np.shares_memory(np.asarray(first), first.values)
    assert not np.shares_memory(np.array(first, copy=True), first.values)


def test_arithmetic_in_place_gives_plain_arrays_and_leaves_the_result(fields):
    for u in fields:
        values, solving = u.values, u.values.copy()
        v = u
        v *= 2
        v += 1
        assert type(v) is np.ndarray
        np.testing.assert_array_equal(v, 2 * values + 1)
        plain = np.zeros(u.shape, dtype=complex)
        plain += u
        np.testing.assert_array_equal(plain, values)
        with pytest.raises(TypeError, match=r"\.values"):
            np.add(u, 1, out=u)
        np.testing.assert_array_equal(u.values, solving)
        np.testing.assert_array_equal(np.add(u, 1, out=plain), values + 1)


def test_they_have_the_methods_of_arrays(fields):
    u = fields[2]
    finite = np.nan_to_num(u)
    v = replace(u, values=finite)
    for name in ("sum", "mean", "max", "min", "ravel", "flatten", "copy", "conj", "transpose", "squeeze", "std", "all"):
        np.testing.assert_array_equal(getattr(v, name)(), getattr(finite, name)())
    np.testing.assert_array_equal(v.T, finite.T)
    np.testing.assert_array_equal(v.sum(axis=0), finite.sum(axis=0))
    np.testing.assert_array_equal(v.astype(np.complex64), finite.astype(np.complex64))
    assert v.tolist() == finite.tolist() and v.reshape(-1).shape == (v.size,)


def test_arrays_of_a_result_have_its_shape_and_parts_add_up(fields):
    near, *surface = fields
    for u in fields:
        for name in ("error", "error_by", "status", "method"):
            assert getattr(u, name).shape == u.shape
        assert u.points.shape == (*u.shape, 3)
    np.testing.assert_array_equal(near.values, near.incident + near.scattered + near.creeping)
    for u in surface:
        np.testing.assert_array_equal(u.values, u.lit + u.creeping)


def test_they_show_themselves_in_three_lines_and_pickle(fields):
    for u in fields:
        lines = repr(u).splitlines()
        assert len(lines) == 3 and max(map(len, lines)) < 120
        assert lines[0].startswith(type(u).__name__)
        assert all(f"{count} {name}" in lines[1] for name, count in u.status_counts.items())
        again = pickle.loads(pickle.dumps(u))
        assert repr(again) == repr(u)
        assert f"<pre>{type(u).__name__}(" in u._repr_html_()


def test_every_status_has_a_remedy():
    assert [int(status) for status in FieldStatus] == list(range(len(FieldStatus)))
    assert all(len(status.remedy) > 5 for status in FieldStatus)
    assert "length" in FieldStatus.TRUNCATED.remedy


def test_values_of_the_size_of_their_error_are_not_ok():
    values = np.array([5.0, 5.0, 0.01, 0.01, 1.0, 1.0, 1.0])
    error = np.array([2.4, 2.6, 0.09, 0.11, np.nan, 0.01, 5.0])
    by = np.array(["expansion"] * 5 + ["bound", "bound"])
    status = np.array([FieldStatus.OK] * 6 + [FieldStatus.CAUSTIC])
    ok, off = FieldStatus.OK, FieldStatus.UNRESOLVED
    found = judged(status, values, error, by, 1.0)
    assert found.tolist() == [ok, off, ok, off, off, off, FieldStatus.CAUSTIC]
    # du/dn is measured by k
    assert judged(status[:1], 0.1 * values[:1], error[:1], by[:1], 30.0).tolist() == [ok]


@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_the_axis_of_a_torus_is_unresolved_without_the_equation(boundary, monkeypatch):
    monkeypatch.setattr(effort, "SECONDS", 0.0)
    body = sc.Torus(1.0, 0.5)
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (0, 0, 1)), length=3.0, n_rays=64)
    u = cr.near_field(fan, [(0.0, 0.0, z) for z in (0.5, 1.5, 3.0)], wavenumber=30.0, boundary=boundary)
    assert u.status_counts == {"UNRESOLVED": 3} and np.all(np.isfinite(u)) and np.all(u.error > 0.5 * np.abs(u))


def test_an_error_that_is_not_known_is_not_ok(fan, monkeypatch):
    taken = cr.SurfaceCurrents.total
    monkeypatch.setattr(cr.SurfaceCurrents, "total", lambda *of: (taken(*of)[0], np.full(len(of[1]), np.nan)))
    u = cr.near_field(fan, [(0.0, 0.0, -2.0)], wavenumber=K, boundary="hard", method="currents")
    assert u.status_counts == {"UNRESOLVED": 1} and u.error_by[0] == "bound"


def test_fields_at_points_have_the_validity_of_their_fan(fan, fields):
    assert {u.validity for u in fields} == {cr.validity(fan, wavenumber=K)}


def test_what_serves_gives_way_to_what_is_ok_and_errs_less():
    mine = measured_field(np.zeros(4, dtype=complex), np.array([0.1, 0.3, 0.3, 0.1]), "rays", "expansion")
    mine = replace(mine, status=np.array([0, 0, 4, 4]))
    values = np.array([0.25, 1.0, 1.0, 1.0], dtype=complex)
    other = measured_field(values, np.array([0.2, 0.2, 0.5, np.nan]), "currents", "extinction+x")
    at = np.arange(4)
    found = mine.replaced_where_better(at, other, must=False)
    assert found.method.tolist() == ["rays", "currents", "currents", "rays"]
    assert found.error_by.tolist() == ["expansion", "extinction+x", "extinction+x", "expansion"]
    assert found.status.tolist() == [0, 0, 0, 4] and found.values.tolist() == [0, 1, 1, 0]
    # what the two differ by, more than both state, the one with the smaller error has overlooked
    apart = mine.replaced_where_better(at[:1], replace(other, wave=np.ones(4, dtype=complex))[at[:1]], must=False)
    assert apart.method[0] == "currents" and apart.error[0] == 0.2
    must = mine.replaced_where_better(at[2:], other[2:], must=True)
    assert must.method.tolist() == ["rays", "rays", "currents", "currents"]
    assert must.status[3] == FieldStatus.UNRESOLVED and must.error[3] == 1.0
