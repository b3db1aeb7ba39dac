"""Boundaries by name, and the decay coefficients against their closed forms and differences."""

import numpy as np
import pytest

import creeping as cr
from creeping.field.airy import hard_modes, impedance_modes, soft_modes
from creeping.field.boundary import decay_slopes, decay_terms, fock_scale, modes_of, scalar_boundaries

SOFT, HARD = scalar_boundaries("soft")[0], scalar_boundaries("hard")[0]


def test_decay_of_soft_and_hard_in_closed_form():
    # Keller and Levy: c = τ²/60 - (1/10 ± r/4)/τ, FORMULAS section 6
    plain, transverse, _ = decay_terms(soft_modes(), 1.0)
    np.testing.assert_allclose(plain, soft_modes().tau ** 2 / 60, rtol=1e-12)
    np.testing.assert_array_equal(transverse, 0)
    tau = hard_modes().tau
    for sign in (1.0, -1.0):
        plain, transverse, _ = decay_terms(hard_modes(), sign)
        np.testing.assert_allclose(plain, tau**2 / 60 - 1 / (10 * tau), rtol=1e-11)
        np.testing.assert_allclose(transverse, -sign / (4 * tau), rtol=1e-11)


def test_varying_curvature_in_closed_form():
    # Y2 = (8 τ² - 4 τ q M0 - 3 M0)/15 times -1/12
    for modes in (soft_modes(), hard_modes(), impedance_modes(1 + 0.5j)):
        tau, m0, q_m0 = modes.tau, modes.m0, modes.q_m0
        _, _, varying = decay_terms(modes, 1.0)
        np.testing.assert_allclose(varying, -(8 * tau**2 - 4 * tau * q_m0 - 3 * m0) / 180, rtol=1e-11)


@pytest.mark.parametrize("q", [0.0, 1j, 2 + 1j, 4j, None])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_decay_slopes_are_differences_at_constant_q(q, sign):
    modes = soft_modes() if q is None else hard_modes() if q == 0 else impedance_modes(q)

    def shifted(h):
        tau = modes.tau + h
        m0 = 0 * tau if q is None else 1 / (tau - q**2)
        return modes._replace(tau=tau, m0=m0, q_m0=m0 * (0 if q is None else q))

    h = 1e-5
    after, before = (decay_terms(shifted(k * h), sign) for k in (1, -1))
    for slope, a, b in zip(decay_slopes(modes, sign), after, before, strict=False):
        np.testing.assert_allclose(slope, (a - b) / (2 * h), rtol=1e-7, atol=1e-8)


def test_slopes_of_soft_and_hard_in_closed_form():
    np.testing.assert_allclose(decay_slopes(soft_modes(), 1.0)[0], soft_modes().tau / 30, rtol=1e-12)
    tau = hard_modes().tau
    plain, transverse = decay_slopes(hard_modes(), -1.0)
    np.testing.assert_allclose(plain, tau / 30 + 1 / (10 * tau**2), rtol=1e-11)
    np.testing.assert_allclose(transverse, -1 / (4 * tau**2), rtol=1e-11)


def test_boundaries_by_name():
    assert [b.kind for b in scalar_boundaries("pec")] == ["electric soft", "electric hard"]
    assert [b.sign for b in (*scalar_boundaries("pec"), SOFT, HARD)] == [-1.0, -1.0, 1.0, 1.0]
    m = np.array([1.5, 3.0])
    assert SOFT.q(m) is None
    assert HARD.q(m) == 0
    (wall,) = scalar_boundaries(cr.ImpedanceBoundary(0.5 - 0.2j))
    np.testing.assert_allclose(wall.q(m), 1j * m * (0.5 - 0.2j))
    assert modes_of(wall, m).tau.shape == (2, 10)
    assert modes_of(SOFT, m).tau.shape == (10,)
    # an admittance of zero is the hard boundary itself, and a real number is as good as a complex one
    assert scalar_boundaries(cr.ImpedanceBoundary(0)) == (HARD,)
    assert scalar_boundaries(cr.ImpedanceBoundary(1))[0].admittance == 1


def test_fock_scale_is_infinite_on_flat_and_concave_ground():
    np.testing.assert_allclose(fock_scale(16.0, np.array([1.0, 0.0, -2.0, 8.0])), [2.0, np.inf, np.inf, 1.0])


@pytest.mark.parametrize(
    "admittance, match",
    [
        (-0.1, "negative real part"),
        (-1e-9 + 1j, "negative real part"),
        (float("nan"), "not finite"),
        (complex(0, float("inf")), "not finite"),
        (float("inf"), "soft"),
        ("one", "not a complex number"),
        (None, "not a complex number"),
        (np.array([1.0, 2.0]), "not a complex number"),
    ],
)
def test_bad_impedances_are_named(admittance, match):
    with pytest.raises(cr.CreepingError, match=match):
        cr.ImpedanceBoundary(admittance)


@pytest.mark.parametrize("boundary", ["softt", "SOFT", "", None, 0.5, 1j, ("soft",), ["hard"], {"pec"}])
def test_unknown_boundaries_are_named(boundary):
    with pytest.raises(cr.CreepingError, match="is not 'soft', 'hard', 'pec' or ImpedanceBoundary"):
        scalar_boundaries(boundary)
