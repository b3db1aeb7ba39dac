"""Target strengths and cross sections that others published; skipped where the tables are not beside the repository.

Conducting sphere of ka = 64, bistatic (Austin RCS benchmark suite, problem I.A), in dBsm to 1e-6; rigid and soft
spheres and prolate spheroids, backscatter (Jech et al., J. Acoust. Soc. Am. 138 (2015) 3742), in dB to 0.01.
"""

import csv
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from tests.reference.modal_equation import scatter_by_modes
from tests.reference.revolution import spheroid_profile

TABLES = Path(__file__).parents[3] / "shared" / "benchmarks"
pytestmark = pytest.mark.skipif(not TABLES.is_dir(), reason="the published tables are not beside the repository")

SPEED = 1477.3
"""Of sound, m/s."""
SMALL = 0.01
"""Radius of the sphere and of the spheroid's waist, m; the spheroid is seven times as long."""
ROUNDING = {"sphere": 0.005, "spheroid": 0.01}
"""Of published target strengths, dB; those of spheroids by boundary elements are off by up to a unit of their last
digit (`test_published_spheroids_are_right_to_a_digit`)."""
AUSTIN = 0.05
"""Mean of the suite's error measure, dB; 0.007 by currents, 0.03 and 0.05 by rays."""
BACK = 0.05
"""Of a target strength where k times the waist is 12 or more, dB: by rays always, by currents in the mean."""
WORST = 0.1
"""The same by currents, the largest."""
"""ka up to which a body is nowhere thick enough for currents to be judged inside it."""


@pytest.mark.slow
def test_bistatic_conducting_sphere():
    angle, *published = np.loadtxt(TABLES / "austin_IA_s7f6_bistatic.csv", delimiter=",", comments="#").T
    angle, k = np.radians(angle), 2 * np.pi * 320e6 / 299792458.0
    r = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    ball = sc.Sphere(radius=9.6)
    # the wave comes from +x; vertical is theta, horizontal is phi
    fan = cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, (-1, 0, 0)), wavenumber=k, n_rays=128)
    far = cr.far_field(fan, r, wavenumber=k, boundary="pec")
    assert set(far.method) == {"currents"} and not np.any(far.unresolved)
    rays = cr.far_field(fan, r, wavenumber=k, boundary="pec", method="rays")
    shares = []
    for i, reference in enumerate(published):
        exact = 10 ** (reference / 20) / np.sqrt(4 * np.pi)
        least = reference.max() - 80
        for found in (far, rays):
            level = 10 * np.log10(found.cross_section[:, i, i])
            assert np.mean(np.abs(np.maximum(level, least) - np.maximum(reference, least))) < AUSTIN
        shares.append(np.abs(np.abs(far.total[:, i, i]) - exact) / far.error[:, i, i])
    # 92 of 100 angles vertical, 98 horizontal
    assert np.mean(np.array(shares) <= 1) >= 0.95
    assert np.max(shares) < 1.5


def rows(name):
    with open(TABLES / name) as file:
        return list(csv.DictReader(file))


@cache
def published(shape, kind):
    """Target strengths by frequency, kHz: benchmarks, and beyond the spheroid's those of boundary elements."""
    name = {"hard": "Rigid", "soft": "PressureRelease"}[kind]
    column = f"{'Sphere' if shape == 'sphere' else 'ProlateSpheroid'}_{name}"
    found = {float(row["Frequency_kHz"]): row[column] for row in rows("Benchmark_Frequency_TS.csv")}
    if shape == "spheroid":
        figure = rows(f"Figure_03-04_{'Rigid' if kind == 'hard' else 'PressRel'}-Pspheroid.csv")
        more = {float(row["Frequency_kHz"]): row["Francis_BEM_TS"] for row in figure}
        found = {f: more[f] if value == "NA" else value for f, value in found.items()}
    return {f: float(value) for f, value in found.items()}


@cache
def fan_of(shape, degrees):
    body = sc.Sphere(radius=SMALL) if shape == "sphere" else sc.Ellipsoid(SMALL, SMALL, 7 * SMALL)
    d = np.array([np.sin(np.radians(degrees)), 0.0, np.cos(np.radians(degrees))])
    return cr.launch(cr.DirectFlow(body), cr.shadow_line(body, d), length=10 * SMALL, n_rays=96)


@cache
def back(shape, kind, frequency, degrees=90.0, method="auto"):
    """Difference in dB, the same less the rounding over the stated error, error in dB, and whether it is unresolved."""
    if shape == "spheroid" and degrees != 90:
        column = f"ProlateSpheroid_{'Rigid' if kind == 'hard' else 'PressureRelease'}"
        (level,) = (float(row[column]) for row in rows("Benchmark_Angle_TS.csv") if float(row["Angle_deg"]) == degrees)
    else:
        level = published(shape, kind)[frequency]
    fan = fan_of(shape, degrees)
    far = cr.far_field(
        fan, -fan.line.direction, wavenumber=2e3 * np.pi * frequency / SPEED, boundary=kind, method=method
    )
    size, exact = abs(far.total[0]), 10 ** (level / 20)
    share = (abs(size - exact) - exact * (10 ** (ROUNDING[shape] / 20) - 1)) / far.error[0]
    return 20 * np.log10(size / exact), share, bool(far.unresolved[0])


def waist(frequency):
    """K times the radius at the waist."""
    return 2e3 * np.pi * frequency / SPEED * SMALL


HIGH = (290.0, 320.0, 350.0, 380.0, 400.0)
"""Frequencies at which k times the waist is 12 or more."""
LOW = (20.0, 24.0, 30.0, 38.0, 50.0, 60.0, 80.0, 100.0, 120.0, 150.0, 200.0, 250.0)


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["sphere", "spheroid"])
@pytest.mark.parametrize("kind", ["hard", "soft"])
def test_backscatter_of_high_frequencies(shape, kind):
    assert waist(HIGH[0]) > 12
    rays = np.array([back(shape, kind, f, method="rays")[0] for f in HIGH])
    currents = np.array([back(shape, kind, f)[0] for f in HIGH])
    assert np.abs(rays).max() < BACK + ROUNDING[shape]
    assert np.abs(currents).mean() < BACK and np.abs(currents).max() < WORST


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["sphere", "spheroid"])
@pytest.mark.parametrize("kind", ["hard", "soft"])
def test_errors_stated_for_backscatter(shape, kind):
    shares = np.array([back(shape, kind, f)[1] for f in (*LOW, *HIGH)])
    # one value of the rigid spheroid, at 38 kHz, errs by 1.41 times what is stated
    assert np.mean(shares <= 1) > 0.9 and shares.max() < 1.5


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:Mean of empty slice", "ignore:invalid value encountered")
@pytest.mark.parametrize(("kind", "frequency"), [("hard", 20.0), ("hard", 100.0), ("soft", 30.0)])
def test_published_spheroids_are_right_to_a_digit(kind, frequency):
    """By Fourier modes on the generatrix; rounded they are not: -30.0719 dB is told as -30.08."""
    k = 2e3 * np.pi * frequency / SPEED
    modes = scatter_by_modes(spheroid_profile(SMALL, 7 * SMALL), k, [np.pi / 2], kind)
    exact = modes.far_field(np.array([[-1.0, 0.0, 0.0]]))[0, 0]
    assert abs(20 * np.log10(abs(exact)) - published("spheroid", kind)[frequency]) < ROUNDING["spheroid"]
    far = cr.solve(sc.Ellipsoid(SMALL, SMALL, 7 * SMALL), (1, 0, 0), wavenumber=k, boundary=kind).far_field([-1, 0, 0])
    assert abs(far.total[0] - exact) < 2e-4 * abs(exact)


def test_a_high_frequency_by_rays():
    assert abs(back("sphere", "hard", HIGH[0], method="rays")[0]) < BACK + ROUNDING["sphere"]
