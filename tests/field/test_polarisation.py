"""Frames of waves and the dyads of a conductor: orthonormal, right-handed, mirrored."""

import numpy as np

from creeping.field.results.far_result import dyads, spherical_frame, turned_to_azimuth, wave_frame


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def test_spherical_frame_is_orthonormal_and_turns_with_the_angles(rng):
    theta, phi = rng.uniform(0.1, 3.0, 40), rng.uniform(-np.pi, np.pi, 40)

    def direction(t, p):
        return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)

    r = direction(theta, phi)
    frame = spherical_frame(r)
    both = np.concatenate([frame, r[:, None]], axis=1)
    np.testing.assert_allclose(both @ np.swapaxes(both, 1, 2), np.broadcast_to(np.eye(3), (40, 3, 3)), atol=1e-14)
    # r = θ̂ × φ̂, and θ̂ = ∂r/∂θ, φ̂ sin θ = ∂r/∂φ
    np.testing.assert_allclose(np.linalg.det(both), 1, atol=1e-14)
    h = 1e-6
    along = (direction(theta + h, phi) - direction(theta - h, phi)) / (2 * h)
    around = (direction(theta, phi + h) - direction(theta, phi - h)) / (2 * h)
    np.testing.assert_allclose(frame[:, 0], along, atol=1e-9)
    np.testing.assert_allclose(frame[:, 1] * np.sin(theta)[:, None], around, atol=1e-9)


def test_spherical_frame_at_the_poles_is_that_of_azimuth_zero():
    np.testing.assert_array_equal(spherical_frame(np.array([0.0, 0, 1])), [[1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(spherical_frame(np.array([0.0, 0, -1])), [[-1, 0, 0], [0, 1, 0]])
    beside = spherical_frame(np.array([[1e-15, 0, 1.0], [0.0, 1e-15, 1.0]]))
    np.testing.assert_array_equal(beside[0], beside[1])


def test_wave_frames_are_orthonormal_and_across_the_wave(rng):
    n, d, spare = unit(rng.normal(size=(3, 30, 3)))
    frame = wave_frame(n, d, spare)
    s, h = frame[:, 0], frame[:, 1]
    for a, b, dot in ((s, s, 1), (h, h, 1), (s, h, 0), (s, d, 0), (h, d, 0), (s, n, 0)):
        np.testing.assert_allclose(np.sum(a * b, axis=1), dot, atol=1e-13)
    assert np.all(np.sum(np.cross(n, d) * s, axis=1) > 0)


def test_a_wave_along_the_normal_takes_the_spare_vector():
    n, d, spare = np.array([[0.0, 0, 1]]), np.array([[0.0, 0, -1]]), np.array([[0.6, 0.8, 0]])
    frame = wave_frame(n, d, spare)[0]
    np.testing.assert_array_equal(frame[0], spare[0])
    np.testing.assert_allclose(frame[1], np.cross(spare[0], d[0]))


def test_dyads_of_one_frame_project_on_it(rng):
    d = unit(rng.normal(size=3))
    n, spare = unit(rng.normal(size=(2, 20, 3)))
    frame = wave_frame(n, np.broadcast_to(d, n.shape), spare)
    both = dyads(frame, frame, d, np.broadcast_to(d, n.shape))
    identity = np.broadcast_to(np.eye(2), (20, 2, 2))
    # s s + h h = 1 across d, each a projection
    np.testing.assert_allclose(both.sum(axis=1), identity, atol=1e-13)
    np.testing.assert_allclose(both @ both, both, atol=1e-13)
    np.testing.assert_allclose(both[:, 0] @ both[:, 1], 0, atol=1e-13)


def test_dyads_of_a_mirror_turn_the_field_as_a_conductor_does(rng):
    # E_r = 2 (n.E) n - E at a perfectly conducting plane; soft R = -1 along s, hard +1 along h
    n = unit(rng.normal(size=(25, 3)))
    d = unit(np.array([0.2, -0.5, 0.7]))
    n = np.where((n @ d)[:, None] > 0, -n, n)
    r = d - 2 * (n @ d)[:, None] * n
    spare = unit(np.cross(n, np.eye(3)[0]))
    both = dyads(wave_frame(n, np.broadcast_to(d, n.shape), spare), wave_frame(n, r, spare), d, r)
    got = both[:, 1] - both[:, 0]
    for k, e in enumerate(spherical_frame(d)):
        reflected = 2 * (n @ e)[:, None] * n - e
        expected = np.einsum("nkc,nc->nk", spherical_frame(r), reflected)
        np.testing.assert_allclose(got[:, :, k], expected, atol=1e-12)


def test_dyads_are_reciprocal(rng):
    # d -> -r, r -> -d: S_θθ, S_φφ keep, S_θφ and S_φθ change places with the other sign (φ̂ of -r turns over)
    n1, n2, spare = unit(rng.normal(size=(3, 15, 3)))
    d, r = unit(np.array([0.3, 0.5, 0.81])), unit(np.array([-0.7, 0.1, 0.4]))

    def both(first, last, incident, scattered):
        shape = first.shape
        return dyads(
            wave_frame(first, np.broadcast_to(incident, shape), spare),
            wave_frame(last, np.broadcast_to(scattered, shape), spare),
            incident,
            np.broadcast_to(scattered, shape),
        )

    # along s both cross products turn over with the wave
    flip = np.diag([1.0, -1.0])
    there, back = both(n1, n2, d, r), both(n2, n1, -r, -d)
    np.testing.assert_allclose(back, flip @ np.swapaxes(there, -1, -2) @ flip, atol=1e-12)


def test_frames_of_a_cut_pass_through_the_poles():
    # just beside a pole the components of a cut are those at the pole itself
    phi = np.radians(70.0)
    angle = np.array([1e-7, 0.0])
    r = np.stack([np.sin(angle) * np.cos(phi), np.sin(angle) * np.sin(phi), np.cos(angle)], axis=1)
    turn = turned_to_azimuth(r, np.full(2, phi))
    E = np.array([0.3, -0.5, 0.0])
    beside, at = np.einsum("nab,nbc,c->na", turn, spherical_frame(r), E)
    np.testing.assert_allclose(at, beside, atol=1e-6)
    np.testing.assert_array_equal(turn[0], np.eye(2))
