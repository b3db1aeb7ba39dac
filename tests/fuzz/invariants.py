"""What must hold on every body: properties of the flow and symmetries of the field, on random cases by hypothesis.

    |p| = 1,  F(x) = 0,  p.n = 0,  det M = 1        along every geodesic
    g_t o g_s = g_(s + t),  g_t(x, -p) undoes g_t    composition and reversal
    f(d, r) = f(-r, -d)                              reciprocity
    f'(R d, R r) = f(d, r)                           body turned by R
    f'(d, r) = f(d, r) e^(i k (d - r).t)             body moved by t
    f'(d, r; k/s) = s f(d, r; k)                     body grown by s

Two computed fields may differ by the sum of the errors that they state.
"""

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from numpy.random import Generator
from numpy.typing import NDArray

import creeping as cr
import scatterers as sc
from tests.fuzz.calls import ACCEPTED, SILENT, Verdict

RTOL = 1e-11
FLOW = 3e-8
"""What composition and the other properties of a flow may miss by, in body sizes, at RTOL and times up to 3."""
AXES = st.floats(0.7, 1.4).map(lambda value: round(value, 3))
ANGLE = st.floats(-math.pi, math.pi).map(lambda value: round(value, 4))
TIME = st.floats(0.0, 1.5).map(lambda value: round(value, 4))
HEIGHT = st.floats(-0.999, 0.999).map(lambda value: round(value, 4))
EXAMPLES = 3
"""Examples of a property that make one case."""
UNIT = st.floats(0.05, 0.95).map(lambda value: round(value, 4))
BOUNDARY = st.sampled_from(["soft", "hard"])
K = 20.0
LEAST = 1e-6
"""Difference of fields that is rounding of their nodes, for bodies of size 1."""
SHIFT = st.builds(lambda *values: np.array(values), *[st.floats(-2.0, 2.0).map(lambda v: round(v, 3))] * 3)


FloatArray = NDArray[np.float64]

ellipsoids = st.builds(sc.Ellipsoid, AXES, AXES, AXES)
twisted = st.builds(sc.TwistedEllipsoid, AXES, AXES, AXES, st.floats(-0.2, 0.2).map(lambda d: round(d, 3)))
radii = [st.floats(*ends).map(lambda value: round(value, 3)) for ends in ((1.0, 2.0), (0.3, 0.6))]
tori = st.builds(sc.Torus, *radii)
bodies = st.one_of(ellipsoids, twisted, tori)


def unit(height: float, angle: float) -> FloatArray:
    """Unit vector of its height and angle about z."""
    across = math.sqrt(1 - height * height)
    return np.array([across * math.cos(angle), across * math.sin(angle), height])


directions = st.builds(unit, HEIGHT, ANGLE)


def start_of(body: Any, u: float, v: float, turn: float) -> tuple[FloatArray, FloatArray]:
    """A point on the body and a unit tangent there."""
    chart = body.atlas.charts[0]
    x = chart.point(np.array([u, v]))
    frame, _ = np.linalg.qr(chart.tangents(np.array([u, v])))
    return x, frame @ np.array([math.cos(turn), math.sin(turn)])


starts = {"body": bodies, "u": UNIT, "v": UNIT, "turn": ANGLE}


def rays_stay_unit_tangents(body: Any, u: float, v: float, turn: float, t: float) -> None:
    """|p| = 1, F(x) = 0 and p.n = 0, and det M = 1."""
    x, p = start_of(body, u, v, turn)
    states = np.concatenate([x, p, [1.0, 0.0, 0.0, 1.0]])[None]
    end = cr.DirectFlow(body, rtol=RTOL).transport(states, np.array([0.5 * t, t]))[0]
    gradient = body.gradient(end[:, :3])
    slope = np.linalg.norm(gradient, axis=-1)
    assert np.all(np.abs(body.level(end[:, :3])) < FLOW * slope)
    assert np.all(np.abs(np.linalg.norm(end[:, 3:6], axis=-1) - 1) < FLOW)
    assert np.all(np.abs(np.sum(gradient * end[:, 3:6], axis=-1)) < FLOW * slope)
    determinant = end[:, 6] * end[:, 9] - end[:, 7] * end[:, 8]
    assert np.all(np.abs(determinant - 1) < FLOW * (1 + np.abs(end[:, 6:]).max() ** 2)), determinant


def flows_compose(body: Any, u: float, v: float, turn: float, s: float, t: float) -> None:
    """g_(s + t) = g_t o g_s, as far as rays do not part."""
    x, p = start_of(body, u, v, turn)
    flow = cr.DirectFlow(body, rtol=RTOL)
    whole, parts = flow.flow(x, p, s + t), flow.flow(*flow.flow(x, p, s), t)
    assert np.max(np.abs(np.subtract(whole, parts))) < FLOW * growth(body, x, p, s + t)


def flows_are_reversible(body: Any, u: float, v: float, turn: float, t: float) -> None:
    """The ray back ends where it began."""
    x, p = start_of(body, u, v, turn)
    flow = cr.DirectFlow(body, rtol=RTOL)
    there, along = flow.flow(x, p, t)
    back, again = flow.flow(there, -along, t)
    assert max(np.max(np.abs(back - x)), np.max(np.abs(again + p))) < FLOW * growth(body, x, p, t)


def growth(body: Any, x: FloatArray, p: FloatArray, t: float) -> float:
    """Largest factor by which a small error grows till then."""
    states = np.concatenate([x, p, [1.0, 0.0, 0.0, 1.0]])[None]
    times = np.linspace(0.0, max(t, 1e-3), 9)
    return float(1 + np.abs(cr.DirectFlow(body, rtol=1e-8).transport(states, times)[0, :, 6:]).max() ** 2)


@functools.lru_cache(maxsize=8)
def _kept_map(body: Any) -> Any:
    return cr.build_phase_map(body, tolerance=1e-5, length=3.0, cache=False)


def maps_are_flows(index: int, u: float, v: float, turn: float, t: float) -> None:
    """A phase map carries rays as the direct flow does, within ten times its largest error, grown along the ray."""
    body = (sc.Ellipsoid(1.2, 0.8, 0.8), sc.Torus(), sc.TwistedEllipsoid())[index]
    held = _kept_map(body)
    x, p = start_of(body, u, v, turn)
    found, exact = held.flow(x, p, 2 * t), cr.DirectFlow(body, rtol=RTOL).flow(x, p, 2 * t)
    leaps = 1 + 2 * t / held.horizon
    assert np.max(np.abs(np.subtract(found, exact))) < 10 * held.error.max * leaps * growth(body, x, p, 2 * t)


@functools.lru_cache(maxsize=4)
def _field(body: Any, d: tuple[float, ...], looks: tuple[tuple[float, ...], ...], k: float, boundary: Any) -> Any:
    flow = cr.DirectFlow(body, rtol=1e-9)
    fan = cr.launch(flow, cr.shadow_line(body, d, n_points=256), wavenumber=k, n_rays=128)
    found = cr.far_field(fan, looks, wavenumber=k, boundary=boundary)
    return found.total, found.error


def field(body: Any, d: FloatArray, r: FloatArray, k: float, boundary: str) -> tuple[complex, float]:
    """Far field of one incidence in one direction, and its error."""
    total, error = _field(body, tuple(d.tolist()), (tuple(r.tolist()),), k, boundary)
    return complex(total[0]), float(error[0])


def agree(one: tuple[complex, float], other: tuple[complex, float], least: float) -> None:
    """Assert that two fields differ by no more than their errors, and ``least``."""
    (first, its), (second, mine) = one, other
    assert math.isfinite(abs(first)) and math.isfinite(abs(second))
    assert abs(first - second) <= its + mine + least, f"{first:.6g} +- {its:.2g}, {second:.6g} +- {mine:.2g}"


fields = {"body": ellipsoids, "d": directions, "r": directions, "boundary": BOUNDARY}


def fields_are_reciprocal(body: Any, d: FloatArray, r: FloatArray, boundary: str) -> None:
    """f(d, r) = f(-r, -d)."""
    agree(field(body, d, r, K, boundary), field(body, -r, -d, K, boundary), LEAST)


def fields_scale(body: Any, d: FloatArray, r: FloatArray, boundary: str, s: float) -> None:
    """A body s times as large at k/s scatters s times as much, to rounding."""
    value, error = field(body, d, r, K, boundary)
    larger, its = field(sc.Ellipsoid(s * body.a, s * body.b, s * body.c), d, r, K / s, boundary)
    assert abs(larger / s - value) <= 1e-3 * error + LEAST, f"{larger / s:.6g} and {value:.6g}"
    assert abs(its / s - error) <= 0.01 * error + LEAST


def rotation(axis: FloatArray, angle: float) -> FloatArray:
    """Matrix of a turn about an axis (Rodrigues)."""
    cross = np.cross(np.eye(3), axis)
    return np.asarray(np.eye(3) + math.sin(angle) * cross.T + (1 - math.cos(angle)) * cross @ cross)


def quadric(body: Any, turn: FloatArray, shift: FloatArray) -> Any:
    """The ellipsoid turned and moved, as an expression."""
    matrix = turn @ np.diag([body.a**-2, body.b**-2, body.c**-2]) @ turn.T
    names = [f"({name} - {value!r})" for name, value in zip("xyz", shift.tolist(), strict=True)]
    terms = [f"{matrix[i, j].item()!r}*{names[i]}*{names[j]}" for i in range(3) for j in range(3)]
    half = 1.2 * max(body.a, body.b, body.c)
    return sc.Implicit(" + ".join(terms) + " - 1", [shift - half, shift + half], centre=shift)


def fields_move(
    body: Any, d: FloatArray, r: FloatArray, boundary: str, axis: FloatArray, angle: float, shift: FloatArray
) -> None:
    """A body turned and moved scatters the same, but for the phase of the move."""
    turn = rotation(axis, angle)
    value, error = field(body, d, r, K, boundary)
    moved = quadric(body, turn, shift)
    total, its = _field(moved, tuple((turn @ d).tolist()), (tuple((turn @ r).tolist()),), K, boundary)
    phase = np.exp(1j * K * np.dot(turn @ (d - r), shift))
    agree((value * phase, error), (complex(total[0]), float(its[0])), 1e-4 * abs(value))


PROPERTIES: dict[str, tuple[Callable[..., None], dict[str, Any]]] = {
    "rays stay unit tangents": (rays_stay_unit_tangents, {**starts, "t": TIME}),
    "flows compose": (flows_compose, {**starts, "s": TIME, "t": TIME}),
    "flows are reversible": (flows_are_reversible, {**starts, "t": TIME}),
    "maps are flows": (maps_are_flows, {**starts, "t": TIME} | {"index": st.integers(0, 2)}),
    "fields are reciprocal": (fields_are_reciprocal, fields),
    "fields scale": (fields_scale, fields | {"s": st.sampled_from([1e-3, 0.1, 7.0, 1e3, 1e5])}),
    "fields move": (fields_move, fields | {"axis": directions, "angle": ANGLE, "shift": SHIFT}),
}
PROPERTIES["maps are flows"][1].pop("body")
"""Properties by name: check, and strategies of its arguments."""


def checked(name: str, examples: int, seeded: int | None = None) -> None:
    """Check a property on so many examples; without a seed always the same.

    Raises
    ------
    AssertionError
        With the least example that was found.
    """
    check, strategies = PROPERTIES[name]
    options: dict[str, Any] = {"max_examples": examples, "deadline": None, "database": None}
    options |= {"suppress_health_check": list(HealthCheck), "derandomize": seeded is None}
    # to make an example smaller takes many fields
    phases = (Phase.generate, Phase.shrink) if "field" not in name else (Phase.generate,)
    test = given(**strategies)(check)
    if seeded is not None:
        test = seed(seeded)(test)
    settings(**options, phases=phases)(test)()


class Invariants:
    """Properties in turn, a few examples each."""

    def prepare(self, folder: Path) -> None:
        """Check each property once."""
        for name in PROPERTIES:
            checked(name, 1)

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Check the property that is the number's turn."""
        name = list(PROPERTIES)[number % len(PROPERTIES)]
        try:
            checked(name, EXAMPLES, int(rng.integers(2**62)))
        except AssertionError as error:
            words = f"{name}: {error} {' '.join(getattr(error, '__notes__', []))}"
            place.with_suffix(".txt").write_text(words)
            return Verdict(SILENT, words)
        return Verdict(ACCEPTED)
