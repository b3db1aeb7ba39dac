"""Sums over the geodesics of each pair of ports, their error, what is the matter, and beams where they merge.

Error of an entry, from those of its waves by `creeping.field.ports.tensor`:

    error^2 = (sum own)^2 + (sum_pairs P (|u_i| + |u_j|)/(k |s_i - s_j|))^2 + lost^2

P is over pairs of waves of which one has touched a caustic that the other has not; lost is what geodesics beyond the
end of the fans, and those that have ended where kappa_n <= 0, would bring by the decay of the first mode.

Also here: the field of one port where geodesics merge: Gaussian beams along all rays from it, finite on caustics.

    u(x) = sum of `creeping.field.waves.beams` from the port, S = s, dsigma its angle

y is the wave of `creeping.field.ports.tensor` without what J2 does to it; the term g^2 of its second order, and for
slots those in J2'/J2, 1/J2 and K0, come back by stationary phase and are left out. A tensor's y is that of V, with the
components carried by their ratio to it. A beam of H = A b + B p turns with its front off its ray, to b - (q'/q) n p and
p + (q'/q) n b; the normal does not turn.

Sources: [P82], [CPP82]; Derivations, F20, F24, F25, F28 and F34.
"""

from dataclasses import dataclass, fields

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.airy import hard_modes
from creeping.field.ports.tensor import PathWaves
from creeping.field.ports.waves import Path
from creeping.field.results.point_result import FieldStatus, Words
from creeping.field.waves.beams import WIDTH, GaussianBeams, beam_length, turned_by
from creeping.field.waves.ray_sums import LOST, NARROW, merging_of, total_of
from creeping.geodesics.equations import sharpest_curvature
from creeping.geometry.evaluators import evaluators
from creeping.geometry.surface import Surface, normal, size
from creeping.rays.port_rays import TURN, PortRays, traced_fans
from creeping.rays.reach import SPARED

DENSE = (0.22, 0.08, 64)
"""Angle between beams, in (ka)^(-1/2), steps, in a/(ka)^(1/3), and half of the least number of beams: half of the first
two changes less than 0.1 of the stated error (``tests/field/test_port_beams.py``)."""
CUTS, APART = (2.5, 3.8, 1.6), 0.8
"""Where beams begin, in their widths, the first that is valid: no geodesic may end within so many widths of it. What
other beginnings change is within the stated error of 95 of 100 pairs (``tests/field/test_port_beams.py``)."""


def beam_width(body: Surface, wavenumber: float) -> float:
    """(a/k)^(1/2), about the width of beams at their port, L."""
    return float(np.sqrt(beam_length(body) / wavenumber))


class PortBeams:
    """Beams of one port, of number ``number``, by whose tensor and along whose axis its waves are."""

    def __init__(self, waves: PathWaves, number: int) -> None:
        from creeping.rays.kernels import port_fans as lane

        body, k, port, n = waves.rays.body, waves.wavenumber, waves.rays.ports[number], waves.rays.normals[number]
        self.waves, a, length = waves, beam_length(body), waves.rays.length
        apart, step, fewest = DENSE
        count = 2 * int(max(fewest, np.ceil(np.pi / apart * a / beam_width(body, k))))
        steps = int(np.ceil(length / a * max(np.cbrt(k * a) / step, a * sharpest_curvature(body) / TURN)))
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
        curvature, between = lanes[..., lane.LANE.across], 2 * np.pi / count
        self.beams = GaussianBeams(body, k, states[:, : shape[1]], b, curvature, S, logarithm, slope, between)
        if ratio is not None:
            self._carry(ratio, b, p, turned_by(slope, k), waves.axes[number])

    def _waves(self, lanes: FloatArray, last: IntArray) -> tuple[ComplexArray, ComplexArray, ComplexArray | None]:
        """Logarithm of y, in 1/L^(1/2), along all rays, y_s/y, 1/L, and the ratio of a tensor's components to it.

        (rays, steps) both, and (rays, steps, fields, moments), by cubic splines of log y √s through every fourth step,
        of which half changes 6e-4 at most; behind the end of a ray they stay.
        """
        from scipy.interpolate import CubicSpline

        from creeping.rays.kernels import port_fans as lane

        count = lanes.shape[1]
        steps = np.append(np.arange(1, count - 1, 4), count - 1)
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
        """Fields at ports of numbers (n,) by feet farther along than ``beyond``, L, for two eps, and their bounds."""
        cut = max(2, round(beyond / self.step))
        points, eps = self.waves.rays.ports[targets], WIDTH * self.beams.a
        found, again = (self.beams.sums(points, eps * factor, cut, from_point=True)[1] for factor in (1.0, 0.6))
        largest = np.linalg.norm(found, axis=1)
        if found.shape[1] == 3:
            axes = self.waves.axes[targets]
            return np.sum(found * axes, axis=1), np.sum(again * axes, axis=1), largest
        return found[:, 0], again[:, 0], largest


@dataclass(frozen=True, eq=False)
class PortSums:
    """Fields of n ports by their s sources, the first ones (s, n), at numbers above the source's alone.

    Attributes
    ----------
    values : (s, n) complex
    error : (s, n)
    status : (s, n) of int
    method : (s, n) of str
    """

    values: ComplexArray
    error: FloatArray
    status: IntArray
    method: Words

    def put(self, other: "PortSums", where: BoolArray) -> None:
        """Take the entries of another in their place."""
        for part in fields(self):
            getattr(self, part.name)[where] = getattr(other, part.name)[where]


def port_sums(waves: PathWaves) -> PortSums:
    """Sums over geodesics, or beams for them, with error and status."""
    rays, k = waves.rays, waves.wavenumber
    shape = rays.folds.shape
    count, pair = rays.folds.size, rays.first * shape[1] + rays.second
    merging = merging_of(pair, rays.caustics, rays.arclength, waves.sizes, k, count)
    # what geodesics beyond the fans' length, and ended ones, would bring
    slow = float(np.quantile(rays.integrals[:, 0] / rays.arclength, SPARED)) if len(rays) else 0.0
    reached = np.full(count, rays.length * slow), rays.ended.ravel()
    lost, ended = (waves.scale * _first_mode(rays, A, k) for A in reached)
    with np.errstate(invalid="ignore"):
        values, strength, error = (total_of(of, pair, count) for of in (waves.values, waves.sizes, waves.own))
        folds = waves.scale * _first_mode(rays, rays.folds.ravel(), k)
        # half or twice of either share leaves errors of rays and beams within a tenth (``port_coverage``)
        merges = (merging > 0.03 * strength) | (folds > 0.1 * strength)
        # geodesics that end on their caustics
        rho = np.cbrt(np.prod(1 / np.maximum(rays.curvature, 1e-300), axis=1) * rays.arclength)
        share = np.abs(rays.spreading) / (np.abs(rays.spreading) + rho * np.mean(np.abs(rays.rates), axis=1))
        m = np.cbrt(k * np.sqrt(np.prod(1 / rays.curvature, axis=1)) / 2)
        merges[pair[(share * m < NARROW) & (rays.arclength > 0.25 * size(rays.body))]] = True
        error = np.sqrt(error**2 + merging**2 + lost**2 + ended**2)
    status = np.where(merges, int(FieldStatus.CAUSTIC), int(FieldStatus.OK))
    # waves of a focus are (ka)^(1/2) times those of a ray
    error = np.where(merges, np.maximum(error, strength + folds * np.sqrt(k * size(rays.body))), error)
    found = PortSums(values, error, status, np.full(count, "rays", dtype="<U5"))
    upper = np.triu(np.ones(shape, dtype=bool), 1).ravel()
    _put_beams(waves, np.flatnonzero(merges & upper), found, strength)
    none = strength == 0
    status[none] = np.where(ended[none] > 0, FieldStatus.DETACHED, FieldStatus.NO_RAY)
    fine = status == FieldStatus.OK
    status[fine & (lost > LOST * strength)] = FieldStatus.TRUNCATED
    status[fine & (ended > LOST * strength)] = FieldStatus.DETACHED
    fine = status == FieldStatus.OK
    with np.errstate(invalid="ignore"):
        level = np.maximum(np.abs(values), strength) if waves.polarised else np.abs(values)
        # 6 dB, the meaning of the status
        status[fine & ~(error <= 0.5 * level)] = FieldStatus.UNRESOLVED
    return PortSums(*(getattr(found, part.name).reshape(shape) for part in fields(found)))


def _first_mode(rays: PortRays, A: FloatArray, k: float) -> FloatArray:
    """About the wave of the first mode where int kappa_n^(2/3) ds is A (count,), 1/L; 0 where it is infinite."""
    tau, root = hard_modes().tau[0], np.cbrt(k / 2)
    typical = float(np.median(rays.curvature)) if len(rays) else 1 / size(rays.body)
    scale = np.cbrt(typical) * np.sqrt(root / (np.pi * size(rays.body))) / (2 * abs(tau))
    return np.asarray(scale * np.exp(-tau.imag * root * A))


def _put_beams(waves: PathWaves, asked: IntArray, found: PortSums, strength: FloatArray) -> None:
    """Beams in place of rays for the entries asked for, where these can be told from young rays."""
    rays, own = waves.rays, waves.own
    n = len(rays.ports)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.nan_to_num(own / waves.sizes, nan=0.0)
    small = float(np.median(1 / waves.square)) if len(rays) else 1.0
    for number in np.unique(asked // n):
        targets = asked[asked // n == number] % n
        begin, end = np.searchsorted(rays.first, [number, number + 1])
        here = slice(int(begin), int(end))
        place = np.full(n, -1)
        place[targets] = np.arange(len(targets))
        place = place[rays.second[here]]
        members = np.flatnonzero(place >= 0)
        place, members = place[members], members + int(begin)
        cuts = _best_cuts(place, rays.arclength[members], len(targets), beam_width(rays.body, waves.wavenumber))
        if not np.any(cuts > 0):
            continue
        beams = PortBeams(waves, int(number))
        by_beams, again = np.zeros((2, len(targets)), dtype=complex)
        largest = np.zeros(len(targets))
        for cut in np.unique(cuts[cuts > 0]):
            some = cuts == cut
            by_beams[some], again[some], largest[some] = beams.sums(targets[some], float(cut))
        young = rays.arclength[members] < cuts[place]
        # at a focus no ray is singled out
        worst = np.full(len(targets), float(np.quantile(share[here], 0.9)) if end > begin else 1.0)
        later = np.zeros(len(targets))
        np.maximum.at(later, place[~young], share[members[~young]])
        worst = np.where(later > 0, later, worst)
        known, unsure = (total_of(of[members[young]], place[young], len(targets)) for of in (waves.values, own))
        # of the last share spheres have a tenth (``python -m studies port_coverage``)
        off = np.hypot(np.abs(by_beams - again) + largest * np.hypot(worst, 0.3 * small), unsure)
        entry = number * n + targets
        better = (cuts > 0) & (off < found.error[entry])
        entry, value = entry[better], (known + by_beams)[better]
        found.values[entry], found.error[entry] = value, off[better]
        found.status[entry], found.method[entry] = FieldStatus.OK, "beams"
        strength[entry] = np.maximum(np.abs(value), largest[better] if waves.polarised else 0.0)


def _best_cuts(place: IntArray, arclength: FloatArray, count: int, width: float) -> FloatArray:
    """Where beams begin at each of so many ports so that no geodesic of theirs ends close by, L; 0 if nowhere."""
    found = np.zeros(count)
    for cut in CUTS:
        nearest = np.full(count, np.inf)
        np.minimum.at(nearest, place, np.abs(arclength - cut * width))
        found[(found == 0) & (nearest > APART * width)] = cut * width
    return found
