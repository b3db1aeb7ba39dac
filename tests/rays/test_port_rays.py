"""Geodesics between ports: great circles, a count by shooting, Clairaut on a spheroid, symmetry of the second order."""

import numpy as np
import pytest
import shared_bodies as sc

from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack
from creeping.geometry.surface import project
from creeping.rays import port_rays
from creeping.rays.port_rays import departures, rays_between


def spread_ports(body, count, seed):
    return project(body, np.random.default_rng(seed).normal(size=(count, 3)) * 0.5)


def test_great_circles():
    ports = np.random.default_rng(1).normal(size=(12, 3))
    ports /= np.linalg.norm(ports, axis=1, keepdims=True)
    rays = rays_between(sc.Sphere(), ports, 6.0)
    angle = np.arccos(np.sum(ports[rays.first] * ports[rays.second], axis=1))
    there = rays.arclength < np.pi
    exact = np.where(there, angle, 2 * np.pi - angle)
    assert np.sum(there) == 66
    assert np.sum(~there) == np.sum(2 * np.pi - angle[there] <= 6.0)
    assert np.allclose(rays.arclength, exact, atol=1e-6)
    assert np.allclose(rays.spreading, np.sin(exact), atol=1e-5)
    assert np.allclose(rays.rates, np.cos(exact)[:, None], atol=1e-5)
    assert np.array_equal(rays.caustics, (~there).astype(int))
    # A, and 1/60, 7/20, 1/4 of second order, and K, per length
    assert np.allclose(rays.integrals / exact[:, None], [1, 1 / 60, 0.35, 0.25, 1], atol=1e-6)


def test_rays_arrive_where_they_should():
    """Traced by themselves; their spreading is the difference of neighbours."""
    body = sc.TwistedEllipsoid()
    ports = spread_ports(body, 10, 5)
    rays = rays_between(body, ports, 2.0)
    assert len(rays) > 30
    turn = 1e-5
    one, two = departures(rays.normals[rays.first], np.array([0.0, 0.5 * np.pi])).transpose(1, 0, 2)
    angle = np.arctan2(*(np.sum(rays.directions[:, 0] * axis, axis=1) for axis in (two, one)))
    for ray in range(0, len(rays), 5):
        angles = angle[ray] + turn * np.array([-1, 0, 1])
        first = rays.first[ray]
        leaving = departures(rays.normals[first : first + 1], angles)[0]
        starts = pack(np.repeat(ports[first : first + 1], 3, axis=0), leaving)
        ends = trace_states(body, starts, np.array([rays.arclength[ray]]), rtol=1e-12)[:, 0]
        assert np.linalg.norm(ends[1, :3] - ports[rays.second[ray]]) < 2e-5
        n, p = rays.normals[rays.second[ray]], rays.directions[ray, 1]
        aside = (ends[2, :3] - ends[0, :3]) @ np.cross(n, p) / (2 * turn)
        assert abs(aside - rays.spreading[ray]) < 1e-3 * (1 + abs(aside))


def test_no_geodesic_is_missed():
    """A dense fan's rays pass within sight of a port as often as geodesics to it are found."""
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    ports = spread_ports(body, 6, 8)
    rays = rays_between(body, ports, 3.5)
    count, times = 2000, np.linspace(0, 3.5, 701)
    fan = departures(rays.normals[:1], 2 * np.pi * np.arange(count) / count)[0]
    states = trace_states(body, pack(np.repeat(ports[:1], count, axis=0), fan), times, rtol=1e-9)
    for j in range(1, 6):
        if np.isfinite(rays.folds[0, j]):
            continue
        to = ports[j] - states[..., :3]
        n, p = rays.normals[j], states[..., 3:6]
        along, aside = np.sum(to * p, axis=-1), np.sum(to * np.cross(n, p), axis=-1)
        near = np.linalg.norm(to, axis=-1) < 0.05
        # feet of the port on each ray, and the side on which it lies: it changes where a geodesic passes through
        foot = (along[:, :-1] > 0) & (along[:, 1:] <= 0) & near[:, :-1]
        side = np.sign(np.where(foot, aside[:, :-1], 0.0))
        both = foot & np.roll(foot, -1, axis=0) | foot & (np.roll(np.roll(foot, -1, axis=0), 1, axis=1))
        following = np.roll(side, -1, axis=0)
        changed = both & ((following * side < 0) | (np.roll(following, 1, axis=1) * side < 0))
        changed |= foot & (np.roll(following, -1, axis=1) * side < 0)
        assert changed.sum() == np.sum((rays.first == 0) & (rays.second == j))


def test_second_order_is_the_same_from_both_ends():
    """Though what it is made of, the change of A across rays from one end, is not."""
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    ports = spread_ports(body, 16, 2)
    there, back = rays_between(body, ports, 2.0), rays_between(body, ports[::-1].copy(), 2.0)
    keys = [
        np.lexsort((r.arclength, s, f))
        for r, f, s in ((there, there.first, there.second), (back, 15 - back.second, 15 - back.first))
    ]
    some = (there.caustics[keys[0]] == 0) & (there.spreading[keys[0]] > 0.3 * there.arclength[keys[0]])
    assert some.sum() > 60
    one, other = (r.integrals[key][some] for r, key in zip((there, back), keys, strict=True))
    assert np.max(np.abs(one - other), axis=0).max() < 3e-4
    assert np.median(np.abs(one[:, 1])) > 0.01


@pytest.mark.parametrize(("name", "factor"), [("RAYS", 2), ("WIDEST", 0.5), ("TURN", 0.5), ("RTOL", 0.1)])
@pytest.mark.parametrize("body", [sc.Ellipsoid(1.0, 0.8, 0.6), sc.TwistedEllipsoid()], ids=["ellipsoid", "twisted"])
def test_denser_fans_find_the_same(body, name, factor, monkeypatch):
    """But next to rays that have ended, of which is told."""
    ports = spread_ports(body, 12, 5)
    some = rays_between(body, ports, 2.5)
    monkeypatch.setattr(port_rays, name, type(getattr(port_rays, name))(factor * getattr(port_rays, name)))
    other = rays_between(body, ports, 2.5)
    counts = [np.bincount(rays.first * 12 + rays.second, minlength=144).reshape(12, 12) for rays in (some, other)]
    assert np.all((counts[0] == counts[1]) | np.isfinite(some.ended))
    if len(some) == len(other):
        assert np.max(np.abs(some.arclength - other.arclength)) < 1e-5
        assert np.max(np.abs(some.spreading - other.spreading)) < 1e-5
        assert np.max(np.abs(some.integrals[:, 0] - other.integrals[:, 0])) < 1e-4
