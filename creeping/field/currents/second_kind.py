"""The integral equation of the second kind on a body's surface, and one step of it from the currents of the body.

    hard        u = 2 u_inc + 2 int u dG/dn_y dS_y
    soft        du/dn = 2 du_inc/dn - 2 int du/dn dG/dn_x dS_y
    impedance   (1 + eta/c) u = 2 u_inc + 2 int u (dG/dn_y + ik eta_y G) dS_y + (eta/c) u,   c = -n.d

The expansions of lit ground know its curvature at a place and no more; where it jumps, at a joint, the true field
passes from one to the other over the paths by which waves come from either side. The right side, with the expansions
in it, holds these waves. On lit ground a step makes what is wrong smaller, by what a wave that grazes less than c
suffers from one place to the next, kappa/(k c^3); behind the line it does not, and there rays serve. What an impedance
does to a plane mirror, (eta/c) u, stands on the left too: it is not small.

Next to x the integrals are weakly singular. With chi = e^{-(R/a)^2}, a some 1/k, kappa = (kappa_1 + kappa_2)/2,

    int chi dG_0/dn dS = -(sqrt(pi)/8) a kappa,   int chi G_0 dS = (sqrt(pi)/4) a

are taken off from the sums over nodes, with the current at x, and put back.

Source: Derivations, F30 and F32.
"""

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.served import Served
from creeping.field.shed_wave import smoothstep
from creeping.geometry.surface import normal
from creeping.kernels.threads import in_threads

NEAR = 2.0
"""Width a of the window, over 1/k."""
NEIGHBOURS = 4.5
"""Distance, over a, of nodes that are next to a point: chi is 1e-9 there."""
EACH = 2.5e-9
"""Seconds of one pair, about."""
LEAST = 0.05
"""Least c with which the wave of an impedance is parted."""
OWN, EVERYWHERE, STILL = 1.5, 2.0, 0.25
"""Error of a step, in what currents leave of the incident wave inside, and in what it changes everywhere; and what it
leaves of the error before."""
SAMPLE, CLEAR, QUARTER = 128, 0.3, 0.25
"""Nodes, of c above this, by which that is judged, and the quantile."""
WHOLE = 0.5
"""Share of lit ground from which on the step is taken whole: behind the line its error grows."""
_EVERYWHERE: "WeakKeyDictionary[SurfaceCurrents, float]" = WeakKeyDictionary()


def by_the_equation(
    field: Served, currents: SurfaceCurrents, points: FloatArray, share: FloatArray, unit: float
) -> Served:
    """The field on a body, at points (n, 3), L, of which ``share`` (n,) is lit ground, by the equation.

    A step is taken as far as it changes more than it errs by itself, as a share of the incident wave's ``unit``. Where
    lit ground is solved, what a step would change on dark ground is what that is off by.
    """
    at = np.flatnonzero(((share > 0) | currents.solved) & np.isfinite(field.values))
    if not len(at):
        return field
    values = field.values[at]
    change = stepped(currents, points[at], normal(currents.body, points[at]), values) - values
    size, own = np.abs(change), unit * np.hypot(OWN * currents.extinction, EVERYWHERE * _everywhere(currents, unit))
    taken = size**2 / np.maximum(size**2 + own**2, 1e-300)
    reach = smoothstep(share[at], 0.0, WHOLE)
    wave, error = field.wave.copy(), field.error.copy()
    wave[at] += reach * taken * change
    kept = (1 if currents.solved else reach) - reach * taken * (1 - STILL)
    error[at] = np.hypot(error[at], kept * size)
    return replace(field, wave=wave, error=error)


def _everywhere(currents: SurfaceCurrents, unit: float) -> float:
    """What a step changes far from joints too, over the incident wave: where currents elsewhere are wrong."""
    if currents not in _EVERYWHERE:
        clear = np.flatnonzero(currents.lit & (currents.normals @ currents.direction < -CLEAR))
        some = clear[:: max(1, len(clear) // SAMPLE)]
        points, normals, values = currents.points[some], currents.normals[some], currents.values[some]
        change = np.abs(stepped(currents, points, normals, values) - values)
        _EVERYWHERE[currents] = float(np.quantile(change, QUARTER)) / unit if len(some) else 0.0
    return _EVERYWHERE[currents]


def stepped(currents: SurfaceCurrents, points: FloatArray, normals: FloatArray, values: ComplexArray) -> ComplexArray:
    """Field u, or du/dn if soft, at points of the body with normals (m, 3) by one step from ``values`` (m,)."""
    rest, own = NodeSums(currents, points, normals, NEAR / currents.wavenumber).of(currents.values)
    wave = twice_incident(currents, points, normals)
    if currents.boundary.kind == "soft":
        return wave + rest + own * values
    eta = np.broadcast_to(currents.boundary.at(points).admittance, (len(points),))
    share = eta / np.maximum(-normals @ currents.direction, LEAST)
    return np.asarray((wave + rest + (own + share) * values) / (1 + share))


def twice_incident(currents: SurfaceCurrents, points: FloatArray, normals: FloatArray) -> ComplexArray:
    """2 u_inc, or 2 du_inc/dn if soft, at points of the body with normals (m, 3)."""
    k, d = currents.wavenumber, currents.direction
    wave = 2 * np.exp(1j * k * (points @ d))
    return np.asarray(1j * k * (normals @ d) * wave if currents.boundary.kind == "soft" else wave)


class NodeSums:
    """The sums over nodes of currents at points of the body with normals (m, 3), for any values at the nodes.

    Parameters
    ----------
    currents : SurfaceCurrents
        Whose nodes, not values, are taken.
    points, normals : (m, 3), L and 1
    window : float, L
        The width a.
    """

    def __init__(self, currents: SurfaceCurrents, points: FloatArray, normals: FloatArray, window: float) -> None:
        self.k, kind, self.window = currents.wavenumber, currents.boundary, window
        self.soft = kind.kind == "soft"
        self._eta, ours = (
            np.zeros(len(x)) if self.soft else np.broadcast_to(kind.at(x).admittance, (len(x),))
            for x in (points, currents.points)
        )
        self._double = currents.weights / (4 * np.pi)
        self._single = 1j * self.k * ours * self._double
        self._points = [np.ascontiguousarray(part.T) for part in (points, normals)]
        places = [np.ascontiguousarray(part.T) for part in (currents.points, currents.normals)]
        self._nodes = *places, currents.weights, currents.mean_curvature, currents.even

    def of(self, values: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """What the points receive of values (n,) at the nodes, but for a share of their own; and that share: (m,)."""
        from creeping.field.kernels.second_kind import from_nodes

        k, a, soft = self.k, self.window, self.soft
        both = [
            np.ascontiguousarray(np.stack([w.real, w.imag])) for w in (self._single * values, self._double * values)
        ]
        out = np.empty((len(self._eta), 6))

        def work(part: slice) -> None:
            given = (*self._points, *self._nodes, *both, k, a, NEIGHBOURS * a, soft)
            from_nodes(*given, part.start, part.stop, out)

        in_threads(work, len(out), least=16, multiple=1, seconds=EACH * len(values))
        real, imaginary, area, bent, still, tilted = out.T
        cover, bend = area / (np.pi * a**2), bent / (np.pi * a**2)
        sign, root = 1 if soft else -1, np.sqrt(np.pi) * a
        taken_off = (1j * k * self._eta * still + tilted) / (4 * np.pi)
        put_back = 1j * k * self._eta * cover * root / 4 + sign * bend * root / 8
        return 2 * (real + 1j * imaginary), np.asarray(2 * (put_back - taken_off))
