"""Fields of bodies with joints and tips, against rings of sources inside."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.errors import InvalidInputError
from studies import joints

PILL = sc.Capsule(1.0, 4.0)


def fan_of(body, d, n_rays=64, length=4.0):
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), length=length, n_rays=n_rays)


# per cent of the largest value of the field, those off the body of the incident wave
MOST = {
    ("capsule 4", "hard"): {"lit": 1.5, "dark": 4.0, "near": 2.0, "far": 0.4},
    ("cone-sphere 4", "soft"): {"lit": 2.5, "dark": 2.5, "near": 4.0, "far": 1.0},
    ("capsule 4", 0.5): {"lit": 2.0, "dark": 4.0, "near": 1.0, "far": 0.2},
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "boundary", "theta"), [(*case, 1.0 + 0.2 * n) for n, case in enumerate(MOST)])
def test_errors_and_what_is_stated(name, boundary, theta):
    found = joints.row(name, 20.0, boundary if isinstance(boundary, str) else complex(boundary), theta, seed=4)
    for part, most in MOST[name, boundary].items():
        usual, largest, covered = found[part]
        assert largest < most, part
        assert usual < 0.75 * most and covered > 93, part


def test_far_field_is_by_currents_and_better_than_rays():
    d = np.array([np.sin(1.1), 0, np.cos(1.1)])
    exact = joints.scatter_by_rings(joints.CASES["capsule 4"][1], 12.0, [1.1], "soft")
    fan = fan_of(PILL, d)
    r = np.random.default_rng(2).normal(size=(60, 3))
    r /= np.linalg.norm(r, axis=1, keepdims=True)
    f = exact.far_field(r)[:, 0]
    off = {}
    for method in ("auto", "rays"):
        far = cr.far_field(fan, r, wavenumber=12.0, boundary="soft", method=method)
        off[method] = np.abs(far.total - f)
        assert np.mean(off[method] <= far.error) > 0.9
        assert set(far.method) == {"currents" if method == "auto" else "rays+optics"}
    assert np.max(off["auto"]) < 0.02 * np.max(np.abs(f))
    assert np.max(off["rays"]) > 3 * np.max(off["auto"])


def test_each_ray_crosses_joints():
    """Along a ray the wave has no jump where it passes a joint, though the curvature does."""
    fan = fan_of(PILL, (0.8, 0.1, 0.4))
    u = cr.surface_field(fan, wavenumber=20.0, boundary="hard")
    assert set(u.method.ravel()) == {"march"} and np.mean(u.ok) > 0.5
    plain = np.abs(u.values) * np.sqrt(np.abs(fan.spreading))
    ok = u.ok[:, 1:] & u.ok[:, :-1]
    steps = np.abs(np.diff(plain, axis=1))[ok] / plain[:, :-1][ok]
    assert np.quantile(steps, 0.99) < 0.2
    with pytest.raises(InvalidInputError, match="order=2"):
        cr.surface_field(fan, wavenumber=20.0, boundary="hard", order=1)


def test_the_unit_of_length_is_no_matter():
    points = np.array([[1.0, 0.0, 0.3], [-1.0, 0.0, 0.2], [0.0, 0.6, 1.8], [0.0, -1.0, -0.4]])
    d = (0.9, 0.0, 0.4)
    small, large = (
        cr.surface_field(
            fan_of(sc.Capsule(1.0 * scale, 4.0 * scale), d, length=4.0 * scale),
            points * scale, wavenumber=12.0 / scale, boundary="hard",
        )
        for scale in (1.0, 1024.0)
    )  # fmt: skip
    np.testing.assert_allclose(large.values, small.values, atol=1e-10)
    np.testing.assert_allclose(large.error, small.error, rtol=1e-8)


def test_what_has_no_march_is_refused():
    fan = fan_of(PILL, (0.9, 0.0, 0.4))
    for ask in (
        lambda: cr.surface_currents(fan, wavenumber=12.0, boundary="pec"),
        lambda: cr.conductor_field(fan, [(3.0, 0, 0)], wavenumber=12.0),
    ):
        with pytest.raises(InvalidInputError, match="creases"):
            ask()
    far = cr.far_field(fan, [(0, 0, 1)], wavenumber=12.0, boundary="pec")
    assert far.method.tolist() == ["rays+optics"]
