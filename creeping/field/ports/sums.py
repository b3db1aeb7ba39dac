"""Sums over the geodesics of each pair of ports, their error, what is the matter, and beams where they merge.

Error of an entry, from those of its waves by `creeping.field.ports.path_waves`:

    error^2 = (sum own)^2 + (sum_pairs P (|u_i| + |u_j|)/(k |s_i - s_j|))^2 + lost^2

P is over pairs of waves of which one has touched a caustic that the other has not; lost is what geodesics beyond the
end of the fans, and those that have ended where kappa_n <= 0, would bring by the decay of the first mode.

Sources: [P82]; Derivations, F20 and F25.
"""

from dataclasses import dataclass, fields

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.ports.beams import PortBeams, beam_width
from creeping.field.ports.path_waves import PathWaves
from creeping.field.results.point_result import FieldStatus, Words
from creeping.field.special.airy import hard_modes
from creeping.field.waves.ray_sums import LOST, NARROW, merging_of, total_of
from creeping.geometry.surface import size
from creeping.rays.port_rays import PortRays
from creeping.rays.reach import SPARED

SUMMED = 0.3
"""Error of beams, over m^2, as a share of their sum: on spheres a tenth of it (``python -m studies port_coverage``)."""
MERGED, FOLDED = 0.03, 0.1
"""Shares of the waves from which merging of geodesics at a port, and close to it, asks for beams: by the same study
half or twice of either leaves errors of rays and beams within a tenth."""
CUTS = (2.5, 3.8, 1.6)
"""Where beams begin, in their widths, the first that serves:"""
APART = 0.8
"""no geodesic may end within so many widths of it. What other beginnings change is within the stated error of 95 of 100
pairs (``tests/field/test_port_beams.py``)."""
UNRESOLVED = 0.5
"""Error, as a share of the value, from which an entry is unresolved: 6 dB, the meaning of the status."""


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
    """What geodesics bring, judged, or beams in their place."""
    rays, k = waves.rays, waves.wavenumber
    shape = rays.folds.shape
    count, pair = rays.folds.size, rays.first * shape[1] + rays.second
    merging = merging_of(pair, rays.caustics, rays.arclength, waves.sizes, k, count)
    lost, ended = (waves.scale * wave for wave in _lost(rays, k))
    with np.errstate(invalid="ignore"):
        values, strength, error = (total_of(of, pair, count) for of in (waves.values, waves.sizes, waves.own))
        folds = waves.scale * _first_mode(rays, rays.folds.ravel(), k)
        merges = (merging > MERGED * strength) | (folds > FOLDED * strength)
        merges[pair[_narrow(rays, k)]] = True
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
        status[fine & ~(error <= UNRESOLVED * level)] = FieldStatus.UNRESOLVED
    return PortSums(*(getattr(found, part.name).reshape(shape) for part in fields(found)))


def _narrow(rays: PortRays, k: float) -> BoolArray:
    """Whether each geodesic (m,) ends on its caustic."""
    rho = np.cbrt(np.prod(1 / np.maximum(rays.curvature, 1e-300), axis=1) * rays.arclength)
    share = np.abs(rays.spreading) / (np.abs(rays.spreading) + rho * np.mean(np.abs(rays.rates), axis=1))
    m = np.cbrt(k * np.sqrt(np.prod(1 / rays.curvature, axis=1)) / 2)
    return np.asarray((share * m < NARROW) & (rays.arclength > 0.25 * size(rays.body)))


def _first_mode(rays: PortRays, A: FloatArray, k: float) -> FloatArray:
    """About the wave of the first mode where int kappa_n^(2/3) ds is A (count,), 1/L; 0 where it is infinite."""
    tau, root = hard_modes().tau[0], np.cbrt(k / 2)
    typical = float(np.median(rays.curvature)) if len(rays) else 1 / size(rays.body)
    scale = np.cbrt(typical) * np.sqrt(root / (np.pi * size(rays.body))) / (2 * abs(tau))
    return np.asarray(scale * np.exp(-tau.imag * root * A))


def _lost(rays: PortRays, k: float) -> tuple[FloatArray, FloatArray]:
    """What geodesics beyond the fans' length, and ended ones, would bring to each entry, 1/L."""
    rate = rays.integrals[:, 0] / rays.arclength
    slow = float(np.quantile(rate, SPARED)) if len(rays) else 0.0
    longer = _first_mode(rays, np.full(rays.folds.size, rays.length * slow), k)
    return longer, _first_mode(rays, rays.ended.ravel(), k)


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
        off = np.hypot(np.abs(by_beams - again) + largest * np.hypot(worst, SUMMED * small), unsure)
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
