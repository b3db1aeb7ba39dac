"""Direct integration as a flow, interchangeable with a phase map."""

from dataclasses import dataclass

from creeping._presenting import Shown, brief
from creeping._typing import ArrayLike, FloatArray
from creeping.geodesics.attenuation import with_attenuation
from creeping.geodesics.integrator import ErrorEstimate, as_times, trace_states
from creeping.geodesics.pieces import with_ends
from creeping.geodesics.states import bundle_states, checked_states, unpack
from creeping.geometry.arguments import checked_body, number_between, one_of, positive_number
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface


@dataclass(frozen=True, repr=False)
class DirectFlow(Shown):
    """Geodesic flow by direct integration, with the interface of a phase map (apply, flow, transport, horizon, error).

    Parameters
    ----------
    body : Surface
    rtol : float
        Relative tolerance per step; the step adapts to the worst of 64 rays.
    horizon : float, L (travel time for a weighted body)
        Time by which `apply` advances.
    step : float, optional, L (travel time for a weighted body)
        Largest length of equal steps, used instead of adaptive steps; faster on a body of nearly uniform curvature.
    error : ErrorEstimate, optional
        Error at the end of the rays, if `choose_flow` measured it.

    Raises
    ------
    InvalidInputError
        If rtol is not between 1e-14 and 1e-2, or the horizon or the step is not a positive finite number.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> flow = cr.DirectFlow(sc.Sphere(), rtol=1e-10, horizon=np.pi / 2)
    >>> x, p = flow.apply((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))     # a quarter of a great circle
    >>> (x.round(6) + 0.0).tolist(), (p.round(6) + 0.0).tolist()
    ([0.0, 1.0, 0.0], [-1.0, 0.0, 0.0])
    """

    body: Surface
    rtol: float = 1e-10
    horizon: float = 1.0
    step: float | None = None
    error: ErrorEstimate | None = None

    def __post_init__(self) -> None:
        checked_body(self.body, charts=not is_piecewise(self.body))
        object.__setattr__(self, "rtol", number_between(self.rtol, "rtol", 1e-14, 1e-2))
        object.__setattr__(self, "horizon", positive_number(self.horizon, "horizon"))
        if self.step is not None:
            object.__setattr__(self, "step", positive_number(self.step, "step"))
        if self.error is not None:
            one_of(self.error, "error", ErrorEstimate, "creeping.ErrorEstimate")

    def __repr__(self) -> str:
        steps = f"rtol {self.rtol:g} per step" if self.step is None else f"equal steps of at most {self.step:g}"
        e = self.error
        error = "not measured" if e is None else f"rms {e.rms:.1e}, max {e.max:.1e} ({e.samples} samples)"
        return (
            f"DirectFlow({brief(self.body)})\n  order 8, {steps}, horizon {self.horizon:g}\n  error at the end: {error}"
        )

    def apply(self, points: ArrayLike, directions: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Advance points, L, and directions by one horizon: (..., 3), (..., 3) -> (..., 3), (..., 3)."""
        return self.flow(points, directions, self.horizon)

    def flow(self, points: ArrayLike, directions: ArrayLike, times: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Advance to times >= 0.

        Parameters
        ----------
        points : (..., 3), L
        directions : (..., 3)
        times : scalar or (m,), L (travel time for a weighted body)
            Ascending.

        Returns
        -------
        points, directions : (..., 3) for a scalar time, (..., m, 3) else

        Raises
        ------
        InvalidInputError
            On bad points, directions or times.
        """
        values, scalar = as_times(times)
        states, shape = bundle_states(self.body, points, directions)
        return unpack(self.transport(states, values), shape, scalar)

    def transport(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """Advance states (n, c), c = 6, 10 or 12, to ascending times (m,), L: (n, m, c), see `PhaseMap.transport`.

        On a piecewise smooth body c may be 14. The last two components are then the time at which the ray ended, inf
        before, and the number of the crease there, -1 before (`creeping.geodesics.pieces`).
        """
        states, times = checked_states(states), as_times(times)[0]
        if is_piecewise(self.body):
            return with_ends(self.body, states, times, rtol=self.rtol, step=self.step)
        if states.shape[1] > 10:
            return with_attenuation(self.body, states, times, rtol=self.rtol, step=self.step)
        return trace_states(self.body, states, times, rtol=self.rtol if self.step is None else 0.0, step=self.step)
