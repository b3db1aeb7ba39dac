"""Fock functions: printed tables, residues, asymptotes, differences, seams, the integral near a body."""

import numpy as np
import pytest
from scipy.integrate import quad
from tolerances import DIFFERENCE, FOCK_SEAM, FOCK_TABLE, PRINTED

from creeping.field import fock
from creeping.field.airy import soft_modes
from creeping.field.fock import boundary_modes, height_gain, near_pekeris

QUARTER = np.exp(0.25j * np.pi)
BOUNDARIES = [None, 0.0, 1j, 2 + 1j, 5j]
XI = np.array([-3, -2, -1, -0.5, 0, 0.5, 1, 1.5, 2, 3])
# FORMULAS, section 4
P_STAR = [
    *(-0.05544738 + 0.88065813j, 0.62377192 + 0.01916089j, 0.40815345 - 0.25998071j, 0.34698958 - 0.23550214j),
    *(0.30662851 - 0.17703205j, 0.26759428 - 0.11296952j, 0.22420501 - 0.06071447j, 0.18090432 - 0.02696433j),
    *(0.14378541 - 0.00952671j, 0.09532670 - 0.00020127j),
]
Q_STAR = [
    *(-0.23440920 - 0.83860418j, -0.77967288 + 0.16600358j, -0.43223953 + 0.35557289j, -0.33550086 + 0.26770652j),
    *(-0.26601685 + 0.15358490j, -0.19836379 + 0.04841413j, -0.12657524 - 0.02742829j, -0.05818088 - 0.06796181j),
    *(-0.00270422 - 0.07916398j, 0.05738090 - 0.05761904j),
]
F = [
    *(2.42436681 + 5.49291589j, 1.73799151 + 3.62913936j, 0.94301863 - 1.94383867j, 0.39917142 - 1.31798763j),
    *(0.38791058 - 0.67188083j, 0.31975099 - 0.21062037j, 0.16727284 + 0.00024409j, 0.05391488 + 0.03899616j),
    *(0.00788211 + 0.02370643j, -0.00255842 + 0.00209602j),
]
G = [
    *(-1.81260136 + 0.83949526j, -1.73908104 + 0.95019194j, 1.79345909 + 0.49549025j, 1.68130053 - 0.04439596j),
    *(1.39937573 + 0j, 1.03833997 + 0.20860769j, 0.65984510 + 0.33102415j, 0.35953902 + 0.33016709j),
    *(0.16719783 + 0.26735962j, 0.00550739 + 0.12990578j),
]
AT_ZERO = {
    0.5j: -0.04808382 - 0.08301207j,
    1j: 0.07042038 - 0.14294957j,
    2j: 0.17271466 - 0.16922541j,
    5j: 0.25068461 - 0.17633937j,
    1 + 1j: 0.13014279 - 0.30286008j,
}


@pytest.mark.parametrize(
    "function, q, expected",
    [
        (fock.pekeris_star, None, P_STAR),
        (fock.pekeris_star, 0.0, Q_STAR),
        (fock.surface_function, None, F),
        (fock.surface_function, 0.0, G),
    ],
)
def test_printed_tables(function, q, expected):
    np.testing.assert_allclose(function(XI, q), expected, atol=PRINTED)


@pytest.mark.parametrize("q", AT_ZERO)
def test_printed_values_of_impedances(q):
    np.testing.assert_allclose(fock.pekeris_star(0.0, q), AT_ZERO[q], atol=PRINTED)


@pytest.mark.parametrize("q", BOUNDARIES)
def test_shadow_is_the_series_of_residues(q):
    xi = np.linspace(1.5, 5, 15)
    modes = boundary_modes(q, 18)
    waves = 2j * np.sqrt(np.pi) * np.exp(1j * xi[:, None] * modes.tau)
    np.testing.assert_allclose(fock.pekeris(xi, q), QUARTER * np.sum(modes.residue * waves, axis=-1), rtol=1e-7)
    np.testing.assert_allclose(fock.surface_function(xi, q), np.sum(modes.surface * waves, axis=-1), rtol=1e-6)


@pytest.mark.parametrize("xi, rest", [(-8.0, 1e-4), (-15.0, 3e-6), (-150.0, 1e-8)])
def test_lit_side_is_the_reflection_coefficient(xi, rest):
    # the next term is of order ξ^-9 with coefficients of some hundreds
    for q, S in ((None, -(1 - 2j / xi**3 + 20 / xi**6)), (0.0, 1 + 2j / xi**3 - 28 / xi**6)):
        expected = -S * np.exp(-1j * xi**3 / 12) / np.sqrt(-4 / xi)
        assert abs(fock.pekeris(xi, q) / expected - 1) < rest


def test_lit_side_of_an_impedance_is_that_of_a_plane():
    # q = i m η and ξ = -2 m cos θ: S = (cos θ - η)/(cos θ + η)
    m, cosine, eta = 60.0, 0.7, 0.4 + 0.3j
    xi = -2 * m * cosine
    S = (cosine - eta) / (cosine + eta)
    expected = -S * np.exp(-1j * xi**3 / 12) / np.sqrt(-4 / xi)
    assert abs(fock.pekeris(xi, 1j * m * eta) / expected - 1) < 1e-4


def test_lit_surface_functions_are_those_of_a_plane():
    # u = 2 u_inc hard: g -> 2 e^{-iξ³/3}; du/dn = 2 i k n.d u_inc soft: F -> -2i ξ ... in magnitude
    xi = np.array([-8.0, -20.0])
    np.testing.assert_allclose(fock.surface_function(xi, 0.0), 2 * np.exp(-1j * xi**3 / 3), rtol=2e-3)
    np.testing.assert_allclose(fock.surface_function(xi, None), 2j * xi * np.exp(-1j * xi**3 / 3), rtol=2e-3)


@pytest.mark.parametrize("name", ["pekeris_star", "surface_function", "pekeris_slope", "surface_slope"])
@pytest.mark.parametrize("q", [None, 0.0, 2 + 1j])
@pytest.mark.parametrize("power", [1, 2])
def test_powers_are_derivatives(name, q, power):
    if q is None and name.endswith("slope"):
        pytest.skip("a soft boundary has no q")
    function = getattr(fock, name)
    # shadow, middle and lit ranges
    xi = np.array([-6.0, -3.1, -1.7, 0.0, 0.9, 2.2, 2.8, 4.0])
    h = 1e-3
    # central difference of fourth order
    near, far = (function(xi + k * h, q, power - 1) - function(xi - k * h, q, power - 1) for k in (1, 2))
    expected = -1j * (8 * near - far) / (12 * h)
    np.testing.assert_allclose(function(xi, q, power), expected, rtol=DIFFERENCE, atol=DIFFERENCE)


@pytest.mark.parametrize("name", ["pekeris", "surface"])
@pytest.mark.parametrize("q, power", [(0.0, 0), (2 + 1j, 1)])
def test_slopes_are_differences_in_q(name, q, power):
    whole = fock.pekeris_star if name == "pekeris" else fock.surface_function
    slope = fock.pekeris_slope if name == "pekeris" else fock.surface_slope
    xi = np.array([-6.0, -3.1, -1.7, 0.0, 0.9, 2.2, 2.8, 4.0])
    step = 1e-3 * (q / abs(q) if q else 1j)
    near, far = (whole(xi, q + k * step, power) - whole(xi, q - k * step, power) for k in (1, 2))
    np.testing.assert_allclose(slope(xi, q, power), (8 * near - far) / (12 * step), rtol=DIFFERENCE, atol=DIFFERENCE)


@pytest.mark.parametrize("q", BOUNDARIES)
@pytest.mark.parametrize("seam", [fock.LIT, fock.SERIES])
def test_no_jump_at_the_seams(q, seam):
    for function in (fock.pekeris_star, fock.surface_function):
        before, after = function(np.nextafter(seam, [-10, 10]), q)
        assert abs(after - before) < FOCK_SEAM


@pytest.mark.parametrize("which", ["pekeris", "surface", "slope", "surface slope"])
@pytest.mark.parametrize("q", [None, 0.0, 1j])
def test_table_against_direct_evaluation(which, q, rng):
    if q is None and which.endswith("slope"):
        pytest.skip("a soft boundary has no q")
    # no ray on the body has ξ < 0
    xi = np.concatenate(
        [rng.uniform(-9, 4, 300), rng.uniform(-150, -9, 0 if which == "surface" and q is None else 100)]
    )
    full = None if q is None else np.full(len(xi), complex(q))
    for power in (0, 1, 2):
        direct = fock._direct(which, xi, full, power)
        error = np.abs(fock._tabulated(which, xi, None if q is None else complex(q), power) - direct)
        assert np.max(error / np.maximum(1, np.abs(direct))) < FOCK_TABLE


def test_q_that_varies_is_evaluated_one_by_one(rng):
    xi, q = rng.uniform(-5, 4, 6), 1j * rng.uniform(0.2, 4, 6)
    for function in (fock.pekeris_star, fock.surface_function):
        each = [function(a, complex(b)) for a, b in zip(xi, q, strict=True)]
        np.testing.assert_allclose(function(xi, q), each, rtol=1e-6, atol=1e-7)


def test_pole():
    xi = np.array([-2.0, 0.5, 3.0])
    np.testing.assert_allclose(fock.pole(xi), 1 / (2 * np.sqrt(np.pi) * xi), rtol=1e-14)
    np.testing.assert_allclose(fock.pole(xi, 1), 1j / (2 * np.sqrt(np.pi) * xi**2), rtol=1e-14)
    np.testing.assert_allclose(fock.pole(xi, 2), -2 / (2 * np.sqrt(np.pi) * xi**3), rtol=1e-14)


def test_pole_at_zero_is_infinite_and_silent():
    assert np.isinf(np.abs(fock.pole(np.zeros(1))[0]))


def transition(X):
    """F_t of UTD."""
    return np.sqrt(X) * fock.transition_rate(np.sqrt(X))


def test_transition_function():
    # FORMULAS, section 4
    assert abs(transition(1.0) - (0.80952548 - 0.23219939j)) < PRINTED
    assert transition(0.0) == 0
    np.testing.assert_allclose(transition(1e6), 1, atol=1e-6)
    for X in (0.05, 0.7, 3.0):
        # turned by π/4: ∫ e^{it²} dt = e^{iX} e^{iπ/4} ∫_0^∞ e^{-y² + 2i e^{iπ/4} √X y} dy
        decay = 2j * QUARTER * np.sqrt(X)
        parts = [quad(lambda y, f=f, a=decay: f(np.exp(-(y**2) + a * y)), 0, 8)[0] for f in (np.real, np.imag)]
        expected = -2j * np.sqrt(X) * QUARTER * complex(*parts)
        np.testing.assert_allclose(transition(X), expected, rtol=1e-10)


def test_height_gain_far_and_near():
    tau = soft_modes(3).tau
    np.testing.assert_allclose(height_gain(tau, np.array([1e6])), 1, atol=2e-2)
    Y = np.array([[1e4], [1e6]])
    gap = np.abs(height_gain(tau, Y) - 1)
    # τ²/(4√Y) is the next term of the exponent
    np.testing.assert_allclose(gap * np.sqrt(Y), np.broadcast_to(np.abs(tau) ** 2 / 4, gap.shape), rtol=0.1)
    hard = boundary_modes(0.0, 3).tau
    small = np.abs(height_gain(hard, np.array([[1e-8], [1e-12]])))
    np.testing.assert_allclose(small[0] / small[1], 10.0, rtol=1e-3)


@pytest.mark.parametrize("q", BOUNDARIES)
def test_integral_near_the_body_is_the_sum_of_modes_with_height_gain(q):
    xi, Y = (a.ravel() for a in np.meshgrid([1.2, 2.0, 3.0], [0.2, 2.0, 15.0]))
    modes = boundary_modes(q, 40)
    gain = height_gain(modes.tau, Y[:, None])
    terms = 2j * np.sqrt(np.pi) * modes.residue * np.exp(1j * xi[:, None] * modes.tau) * gain
    near = near_pekeris(xi, Y, q)
    ratio = near / np.sum(terms, axis=-1)
    # one constant phase between them: with or without the e^{iπ/4} of P
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-6)
    np.testing.assert_allclose(ratio[0], QUARTER, rtol=1e-6)


@pytest.mark.parametrize("q", [None, 0.0])
def test_integral_near_the_body_tends_to_the_far_one(q):
    xi = np.array([1.0, 2.0])
    gap = [np.abs(near_pekeris(xi, np.full(2, Y), q) / fock.pekeris(xi, q) - 1).max() for Y in (10.0, 40.0)]
    # H_p - 1 falls like Y^(-1/2)
    assert gap[1] < 0.6 * gap[0]
    assert gap[1] < 0.5
