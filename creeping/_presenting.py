"""How results show themselves without knowing pictures: they ask a presenter that a layer above them has named.

The root of the package names the module; it is imported when first asked, so that ``import creeping`` brings no
drawing library.
"""

from importlib import import_module
from typing import Any

_module = ""


def present_with(module: str) -> None:
    """Name the module whose ``html``, ``plot`` and ``to_polydata`` show results."""
    global _module
    _module = module


def brief(value: object, width: int = 72) -> str:
    """One line of a value's repr: a body may be a long expression, or of a user's own class."""
    text = " ".join(repr(value).split())
    return text if len(text) <= width else f"{text[: width - 3]}..."


class Shown:
    """A result with a table for notebooks."""

    # no state: results stay frozen and weakly referable, and pickle as before
    __slots__ = ()

    def _repr_html_(self) -> str:
        """Table of what it is, how large, how accurate and what is wrong, for notebooks."""
        return str(import_module(_module).html(self))


class Drawn(Shown):
    """A result with a picture."""

    __slots__ = ()

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw with matplotlib.

        Parameters
        ----------
        ax : matplotlib.axes.Axes, optional
            Axes to draw on. By default a new figure is made without pyplot and opens no window: a notebook shows it as
            the last value of a cell, and ``.figure.savefig(path)`` writes it. For a window, give axes of pyplot.
        **options
            ``legend=True`` adds a legend to given axes; a new figure has one. The other options depend on the type of
            the result; see `line_plots`, `far_cuts`, `plane_pictures`, `coupling_pictures`, `echo_pictures` and
            `t_matrix_pictures` of `creeping.plotting`:

            - `ShadowLine`, `ShadowCurve`, `RayFan` (``plot_line``): ``kind="parameters"``, the plane of (theta, phi) in
              degrees, or ``kind="3d"``, which 3-D axes imply; ``curves=``, iso-phase curves to draw as well;
              ``rays=``, ``until=``, ``view=``.
            - `IsoPhaseCurve` (``plot_curve``): ``kind=``.
            - `FarField` (``plot_far``): ``quantity="rcs"``, in dBsm, or ``"amplitude"``; ``parts=True`` for its
              ``parts``; ``components=``, ``angles=``, ``unit=``, ``span=``.
            - `FieldCut` (``plot_field_cut``): ``show="level"``, ``"magnitude"`` or ``"wave"``, Re(u e^{-i phase});
              ``quantity=``, ``fronts=``, ``phase=``, ``span=``.
            - `PhaseMap` (``plot_growth``): ``tolerance=``.
            - `Coupling` (``plot_coupling``), `SourcePattern` (``plot_pattern``), `Echo` (``plot_echo``): ``span=``;
              of an echo over angle and frequency ``channel=``.
            - `TMatrix` (``plot_t_matrix``): ``kind="backscatter"``, a map of all directions, or ``"waves"``, the matrix
              by degrees; ``component=``, ``span=``.
            - `ImpulseResponse` (``plot_impulse``), `RangeProfile` (``plot_profile``): ``start=``, ``end=``, ``span=``.

        Returns
        -------
        matplotlib.axes.Axes
        """
        return import_module(_module).plot(self, ax, **options)


class DrawnOnBody(Drawn):
    """A result of curves on the body."""

    __slots__ = ()

    def to_polydata(self) -> Any:
        """Curves as pyvista (VTK) data, with the same arrays as a file of `creeping.files.write_vtp`.

        All points are copied, including those after a ray has ended. No display or OpenGL is needed.

        Returns
        -------
        pyvista.PolyData
            `creeping.files.polydata` joins several results.
        """
        return import_module(_module).to_polydata(self)
