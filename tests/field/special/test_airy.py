"""Roots of w1' = q w1 and the constants of a mode: tables, zeros of Ai, differences, limits."""

import numpy as np
import pytest
from scipy.special import ai_zeros, airy
from tolerances import MODE, PRINTED

from creeping.field.airy import Modes, hard_modes, impedance_modes, soft_modes, w1

TURN = np.exp(1j * np.pi / 3)
# FORMULAS, section 3: the first three roots
ROOTS = {
    0.5j: [0.83051591 + 1.11995237j, 1.75066479 + 2.89147112j, 2.49727257 + 4.22697227j],
    1j: [0.99789870 + 1.31956236j, 1.85353874 + 2.97450658j, 2.57378137 + 4.28284085j],
    2j: [1.11923699 + 1.57513478j, 1.97039708 + 3.12834491j, 2.67600654 + 4.39562208j],
    5j: [1.16432434 + 1.82808771j, 2.03579121 + 3.34606821j, 2.74950360 + 4.58891656j],
    1 + 1j: [1.48292234 + 1.28433565j, 2.11536806 + 2.80292608j, 2.73417573 + 4.13230353j],
}


def fock_w1(t):
    """w1 and w1' as √π (Bi + i Ai), the other definition."""
    ai, dai, bi, dbi = airy(t)
    return np.sqrt(np.pi) * (bi + 1j * ai), np.sqrt(np.pi) * (dbi + 1j * dai)


def test_w1_is_bi_plus_i_ai():
    t = np.array([0.3, -2.0, 1 + 2j, -3 + 1j, 2.5j])
    np.testing.assert_allclose(w1(t), fock_w1(t), rtol=1e-12)


def test_soft_and_hard_modes_lie_at_the_zeros_of_ai():
    zeros, slope_zeros, at_slope_zeros, slopes = ai_zeros(10)
    soft, hard = soft_modes(), hard_modes()
    np.testing.assert_allclose(soft.tau, -zeros * TURN, rtol=MODE)
    np.testing.assert_allclose(hard.tau, -slope_zeros * TURN, rtol=MODE)
    # residues by the values of Ai and Ai' there, FORMULAS section 3
    np.testing.assert_allclose(soft.residue, TURN / (4 * np.pi * slopes**2), rtol=1e-9)
    np.testing.assert_allclose(hard.residue, -(TURN**-2) / (4 * np.pi * -slope_zeros * at_slope_zeros**2), rtol=1e-9)
    np.testing.assert_allclose(soft.surface, 1 / fock_w1(soft.tau)[1], rtol=1e-9)
    np.testing.assert_allclose(hard.surface, 1 / (hard.tau * fock_w1(hard.tau)[0]), rtol=1e-9)
    np.testing.assert_array_equal(soft.m0, 0)
    np.testing.assert_array_equal(soft.q_m0, 0)
    np.testing.assert_allclose(hard.m0, 1 / hard.tau, rtol=1e-12)
    np.testing.assert_allclose(hard.q_m0, 0, atol=MODE)


@pytest.mark.parametrize("q", ROOTS)
def test_impedance_roots_are_those_of_the_table(q):
    np.testing.assert_allclose(impedance_modes(q, 3).tau, ROOTS[q], atol=PRINTED)


@pytest.mark.parametrize("q", [0.01j, 0.7j, 3j, 30j, 1 + 1j, 2 - 1.5j, 0.5 + 4j, -2 + 1j, 0.3 - 2j])
def test_impedance_modes_obey_their_equation(q):
    modes = impedance_modes(q)
    value, slope = fock_w1(modes.tau)
    np.testing.assert_allclose(slope / value / q, 1, rtol=1e-8)
    assert len(np.unique(np.round(modes.tau, 6))) == 10
    np.testing.assert_allclose(modes.m0, 1 / (modes.tau - q**2), rtol=1e-8)
    np.testing.assert_allclose(modes.q_m0, q / (modes.tau - q**2), rtol=1e-8)
    np.testing.assert_allclose(modes.residue, -1 / ((modes.tau - q**2) * value**2), rtol=1e-7)
    np.testing.assert_allclose(modes.surface, 1 / ((modes.tau - q**2) * value), rtol=1e-7)


@pytest.mark.parametrize("q", [0.4j, 2j, 8j, 1 + 1j, 1.5 - 0.5j])
def test_roots_move_as_the_differential_equation_says(q):
    step = 1e-5 * q / abs(q)
    above, below, here = (impedance_modes(q + h) for h in (step, -step, 0))
    np.testing.assert_allclose((above.tau - below.tau) / (2 * step), here.m0, rtol=1e-6, atol=1e-8)


def test_roots_go_from_the_hard_to_the_soft_ones():
    hard, soft = hard_modes(), soft_modes()
    small = impedance_modes(1e-8j)
    np.testing.assert_allclose(small.tau, hard.tau, atol=1e-7)
    np.testing.assert_allclose(small.residue, hard.residue, rtol=1e-6)
    large = impedance_modes(1e4j)
    # τ = τ_soft + 1/q + ...
    np.testing.assert_allclose(large.tau, soft.tau + 1 / 1e4j, atol=1e-6)
    np.testing.assert_allclose(large.residue, soft.residue, rtol=1e-5)
    # u goes over into du/dn = q u
    np.testing.assert_allclose(-large.surface * 1e4j, soft.surface, rtol=1e-5)


@pytest.mark.parametrize("turn", [1j, np.exp(0.3j), np.exp(2.9j), 1.0, np.exp(-1.5j)])
def test_modes_of_many_are_those_of_each(turn):
    q = turn * np.array([[3.0, 0.2, 1.7], [6.0, 0.9, 0.9]])
    together = impedance_modes(q, 6)
    assert together.tau.shape == (2, 3, 6)
    for index in np.ndindex(q.shape):
        alone = impedance_modes(q[index], 6)
        for name in ("tau", "residue", "m0", "q_m0", "surface"):
            np.testing.assert_allclose(getattr(together, name)[index], getattr(alone, name), rtol=1e-7, atol=1e-12)


@pytest.mark.parametrize(
    "q",
    [
        20.0,
        8 + 0.5j,
        60 - 2j,
        300.0,
    ],
)
def test_a_bound_surface_wave_leaves_no_nan(q):
    modes = impedance_modes(q)
    # one root follows q² out along the real axis
    assert np.min(np.abs(modes.tau / q**2 - 1)) < 0.05
    for name in ("tau", "residue", "m0", "q_m0", "surface"):
        assert np.all(np.isfinite(getattr(modes, name)))
    assert len(np.unique(np.round(modes.tau, 6))) == 10


@pytest.mark.parametrize("degrees, amount", [(25.0, 3.0), (26.0, 5.0), (27.0, 10.0), (28.0, 5.0), (30.25, 5.0)])
def test_roots_stay_apart_beside_a_branch_point(degrees, amount):
    # η = q/(im) of argument -58 to -67 degrees, passive
    with np.errstate(all="ignore"):
        tau = impedance_modes(amount * np.exp(1j * np.radians(degrees))).tau
    assert np.all(np.isfinite(tau))
    assert np.min(np.abs(tau[:, None] - tau) + 9 * np.eye(10)) > 0.01


@pytest.mark.parametrize("eta", [0.7, 0.3 - 0.4j, 0.1 + 0.3j, 0.05])
def test_constants_depend_on_their_own_q_alone(eta):
    m = np.exp(np.random.default_rng(4).uniform(np.log(0.05), np.log(60), 700))
    q = 1j * eta * m
    together = impedance_modes(q)
    for some in (slice(3, 4), slice(10, 60), slice(None, None, 7)):
        alone = impedance_modes(q[some])
        for name in Modes._fields:
            np.testing.assert_array_equal(getattr(together, name)[some], getattr(alone, name))
    # the root's own equation, by the library's Airy functions
    value, slope = w1(together.tau[m < 5])
    off = np.abs(slope - q[m < 5, None] * value) / (np.abs(slope) + np.abs(q[m < 5, None] * value))
    assert np.max(off) < 1e-8
