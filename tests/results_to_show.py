"""Results to show: on the unit sphere, exact and without the engine; and some of the engine's own, made once."""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.geometry.incident import PlaneWave


@dataclass(frozen=True)
class IsoPhaseCurve:
    level: float
    of: str
    points: Any
    closed: bool
    parameters: Any
    parameter_pieces: Any
    unit: str = "L"


def great_circle(direction, count):
    """Points n.d = 0 of the unit sphere, counter-clockwise about d."""
    e1 = np.cross(direction, [0.3, -0.5, 0.8])
    e1 /= np.linalg.norm(e1)
    e2 = np.cross(direction, e1)
    angle = 2 * np.pi * np.arange(count)[:, None] / count
    return np.cos(angle) * e1 + np.sin(angle) * e2, angle[:, 0]


@pytest.fixture(scope="session")
def sphere_line():
    direction = np.array([1.0, 1.0, 1.0]) / np.sqrt(3)
    points, angle = great_circle(direction, 96)
    status = np.array(["attached"] * 60 + ["occluded"] * 20 + ["concave"] * 16)
    curve = SimpleNamespace(
        closed=True, points=points, normals=points, arclength=angle, length=2 * np.pi, status=status
    )
    return SimpleNamespace(body=sc.Sphere(), direction=direction, source=PlaneWave(direction), curves=[curve])


@pytest.fixture(scope="session")
def sphere_fan(sphere_line):
    """x = cos t x0 + sin t d, J = cos t; one ray detaches, one breaks off in NaN."""
    start, direction = sphere_line.curves[0].points[:60:2], sphere_line.direction
    t = np.linspace(0.0, 2.0, 21)
    points = np.cos(t)[:, None] * start[:, None] + np.sin(t)[:, None] * direction
    directions = -np.sin(t)[:, None] * start[:, None] + np.cos(t)[:, None] * direction
    rays = len(start)
    points[3, 15:] = directions[3, 15:] = np.nan
    detachment = np.full(rays, np.inf)
    detachment[5] = 0.73
    spreading = np.tile(np.cos(t), (rays, 1))
    return SimpleNamespace(
        body=sphere_line.body,
        line=sphere_line,
        points=points,
        directions=directions,
        travel_time=t,
        eikonal=np.tile(t, (rays, 1)),
        spreading=spreading,
        spreading_rate=np.tile(-np.sin(t), (rays, 1)),
        curvature=np.ones((rays, len(t))),
        error=cr.ErrorEstimate(1e-9, 2e-9, 3),
        attenuation=np.tile(t, (rays, 1)),
        caustic_index=(spreading < 0).astype(int),
        status=np.arange(rays) % 3,
        curve_index=np.zeros(rays, dtype=int),
        detachment=detachment,
    )


@pytest.fixture(scope="session")
def sphere_curves(sphere_line):
    curves = []
    for level in (0.3, 0.6, 0.9):
        circle = np.cos(level) * sphere_line.curves[0].points + np.sin(level) * sphere_line.direction
        parameters = sphere_line.body.parameters(np.concatenate([circle, circle[:1]]))
        jumps = np.flatnonzero(np.abs(np.diff(parameters[:, 1])) > np.pi) + 1
        curves.append(IsoPhaseCurve(level, "travel_time", circle, True, parameters, np.split(parameters, jumps)))
    return curves


@pytest.fixture(scope="session")
def twisted_fan():
    """On the twisted ellipsoid, where some rays detach."""
    body = sc.TwistedEllipsoid()
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (1, 1, 1)), length=2.0, n_rays=24, max_gap=np.inf)


@pytest.fixture(scope="session")
def torus_fan():
    body = sc.Torus()
    line = cr.shadow_line(body, (1, 0.3, 0.5), n_points=64)
    return cr.launch(cr.DirectFlow(body), line, length=1.0, n_rays=12, n_steps=10, max_gap=np.inf, launch_from="all")


@pytest.fixture(scope="session")
def twisted_curves(twisted_fan):
    return cr.iso_phase_curves(twisted_fan, [0.5, 1.0])


@pytest.fixture(scope="session")
def ball_fan():
    body = sc.Sphere()
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (0, 0, 1)), length=4.5, n_rays=32)


@pytest.fixture(scope="session")
def ball_cut(ball_fan):
    """From 40 degrees on one side to 180 on the other, in the plane y = 0."""
    angles = np.radians(np.arange(-40.0, 181.0, 5.0))
    directions = np.stack([np.sin(angles), np.zeros_like(angles), np.cos(angles)], axis=-1)
    return cr.far_field(ball_fan, directions, wavenumber=30.0, boundary="hard", method="rays")


@pytest.fixture(scope="session")
def small_map():
    return cr.build_phase_map(sc.Sphere(), horizon=0.5, grid=(12, 16), cache=False)


@pytest.fixture(scope="session")
def dark_fan(torus_fan):
    """A line none of whose points is attached, and its fan without rays."""
    line = torus_fan.line
    curves = tuple(
        replace(c, status=np.full(len(c.points), "concave"), arcs=((0.0, c.length, "concave"),)) for c in line.curves
    )
    line = replace(line, curves=curves)
    return cr.launch(cr.DirectFlow(line.body), line, length=1.0)
