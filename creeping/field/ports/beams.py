"""The field of one port where geodesics merge: Gaussian beams along all rays from it, finite on caustics.

    u(x) = sum of `creeping.field.waves.gaussian_beams` from the port, S = s, dsigma its angle

y is the wave of `creeping.field.ports.tensor` without what J2 does to it; the term g^2 of its second order, and for
slots those in J2'/J2, 1/J2 and K0, come back by stationary phase and are left out. A tensor's y is that of V, with the
components carried by their ratio to it. A beam of H = A b + B p turns with its front off its ray, to b - (q'/q) n p and
p + (q'/q) n b; the normal does not turn.

Sources: [P82], [CPP82]; Derivations, F24, F25, F28 and F34.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.ports.path_waves import PathWaves
from creeping.field.ports.waves import Path
from creeping.field.waves.gaussian_beams import WIDTH, GaussianBeams, beam_length, turned_by
from creeping.geodesics.equations import sharpest_curvature
from creeping.geometry.evaluators import evaluators
from creeping.geometry.surface import Surface, normal, size
from creeping.rays.port_rays import TURN, traced_fans

OTHER = 0.6
"""Factor of the other eps, by which beams are judged: as free as eps (F24)."""
APART, STEP = 0.22, 0.08
"""Angle between beams, in (ka)^(-1/2), and steps, in a/(ka)^(1/3): half of both changes less than 0.1 of the stated
error (``tests/field/test_port_beams.py``)."""
FEWEST = 128
"""Beams of a port, at least: as APART asks for at ka = 20."""
EVERY = 4
"""Steps between those at which waves are found, with cubics between: half of it changes 6e-4 at most."""


def beam_width(body: Surface, wavenumber: float) -> float:
    """(a/k)^(1/2), about the width of beams at their port, L."""
    return float(np.sqrt(beam_length(body) / wavenumber))


class PortBeams:
    """Beams of one port, of number ``number``, by whose tensor and along whose axis its waves are."""

    def __init__(self, waves: PathWaves, number: int) -> None:
        from creeping.rays.kernels import port_fans as lane

        body, k, port, n = waves.rays.body, waves.wavenumber, waves.rays.ports[number], waves.rays.normals[number]
        self.waves, a, length = waves, beam_length(body), waves.rays.length
        count = 2 * max(FEWEST // 2, int(np.ceil(np.pi / APART * a / beam_width(body, k))))
        steps = int(np.ceil(length / a * max(np.cbrt(k * a) / STEP, a * sharpest_curvature(body) / TURN)))
        self.step = length / steps
        times = self.step * np.arange(steps + lane.GUARD + 1, dtype=float)
        states = traced_fans(body, port[None], n[None], count, times)[0]
        lanes = np.zeros((count, len(times) - 4 + lane.BEHIND, lane.LANES))
        last = np.zeros(count, dtype=np.int64)
        with evaluators(body) as parts:
            lane.port_fan(parts.level, parts.level_parameters, self.step, size(body), 0.0, states, lanes, last)
        lanes = lanes[:, lane.BEHIND :]
        shape = lanes.shape[:2]
        logarithm, slope, ratio = self._waves(lanes, last)
        # behind the end of its ray a beam is nothing
        ended = np.arange(shape[1]) > last[:, None]
        logarithm = np.where(ended, -690.0 + 1j * logarithm.imag, logarithm)
        x, p = lanes[..., 0:3], lanes[..., 3:6]
        b = np.cross(normal(body, x.reshape(-1, 3)), p.reshape(-1, 3)).reshape(x.shape)
        S = np.broadcast_to(self.step * np.arange(shape[1]), shape)
        curvature, apart = lanes[..., lane.LANE.across], 2 * np.pi / count
        self.beams = GaussianBeams(body, k, states[:, : shape[1]], b, curvature, S, logarithm, slope, apart)
        if ratio is not None:
            self._carry(ratio, b, p, turned_by(slope, k), waves.axes[number])

    def _waves(self, lanes: FloatArray, last: IntArray) -> tuple[ComplexArray, ComplexArray, ComplexArray | None]:
        """Logarithm of y, in 1/L^(1/2), along all rays, y_s/y, 1/L, and the ratio of a tensor's components to it.

        (rays, steps) both, and (rays, steps, fields, moments), by cubic splines of log y √s through every EVERY-th
        step; behind the end of a ray they stay.
        """
        from scipy.interpolate import CubicSpline

        from creeping.rays.kernels import port_fans as lane

        count = lanes.shape[1]
        steps = np.append(np.arange(1, count - 1, EVERY), count - 1)
        # rays of kappa_n <= 0 at their ports have no wave at all
        at = np.clip(steps, 1, np.maximum(last, 1)[:, None])
        known = np.take_along_axis(lanes, at[..., None], axis=1)
        known = np.where((last > 0)[:, None, None], known, 1.0)
        s = self.step * at.ravel()

        def ends(of: int) -> FloatArray:
            start = np.broadcast_to(lanes[:, :1, of], known.shape[:2])
            return np.stack([start.ravel(), known[..., of].ravel()], axis=1)

        integrals = known[..., lane.LANE.integrals : lane.LANE.integrals + lane.PARTS].reshape(-1, lane.PARTS)
        curvature, torsion, bend = np.abs(ends(lane.LANE.kappa)), ends(lane.LANE.T), ends(lane.LANE.B)
        path = Path(self.waves.wavenumber, s, curvature, torsion, bend, integrals, np.zeros_like(curvature))
        tensor, order = self.waves.tensor(path), self.waves.order
        components, ratio = tensor.carried(order), None
        # of a scalar its own wave, of a tensor that of V
        y = components[:, 0, 0] if components.shape[1:] == (1, 1) else tensor.hard.value(order)
        # at the port itself y is infinite; beams begin behind it
        inside = self.step * np.maximum(np.arange(count), 1)
        if components.shape[1:] != (1, 1):
            with np.errstate(divide="ignore", invalid="ignore"):
                ratio = components / y[:, None, None]
            ratio = np.where(np.isfinite(ratio), ratio, 0.0).reshape(*known.shape[:2], *components.shape[1:])
            ratio = CubicSpline(steps * self.step, ratio, axis=1)(inside)
        y = tensor.hard.factor * y
        y = (np.where(np.abs(y) > 0, y, 1e-300) * np.sqrt(s)).reshape(known.shape[:2])
        curve = CubicSpline(steps * self.step, np.log(np.abs(y)) + 1j * np.unwrap(np.angle(y), axis=1), axis=1)
        return curve(inside) - 0.5 * np.log(inside), curve(inside, 1) - 0.5 / inside, ratio

    def _carry(self, ratio: ComplexArray, b: FloatArray, p: FloatArray, turned: ComplexArray, axis: FloatArray) -> None:
        """Take the components' ratios to y for the port's axis (3,), and how they turn off the ray."""
        start = np.stack([b[:, 0], p[:, 0]], axis=1) @ axis
        if ratio.shape[2] == 2:
            along = np.einsum("rsfg,rg->rsf", ratio, start)
            side, front = along[..., :1], along[..., 1:]
            self.beams.carry(side * b + front * p, (front * b - side * p) / (1 + turned)[..., None])
        else:
            # of the axis, and of one across it, which tells what is the most that one could give
            both = np.stack([start, start[:, ::-1] * (1, -1)])
            carried = np.einsum("rsg,arg->rsa", ratio[:, :, 0], both)
            self.beams.carry(carried, np.zeros_like(carried))

    def sums(self, targets: IntArray, beyond: float) -> tuple[ComplexArray, ComplexArray, FloatArray]:
        """Fields at ports of numbers (n,) by feet farther along than ``beyond``, L, for both eps, and their bounds."""
        cut = max(2, round(beyond / self.step))
        points, eps = self.waves.rays.ports[targets], WIDTH * self.beams.a
        found, again = (self.beams.sums(points, eps * factor, cut, from_point=True)[1] for factor in (1.0, OTHER))
        largest = np.linalg.norm(found, axis=1)
        if found.shape[1] == 3:
            axes = self.waves.axes[targets]
            return np.sum(found * axes, axis=1), np.sum(again * axes, axis=1), largest
        return found[:, 0], again[:, 0], largest
