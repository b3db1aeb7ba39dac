"""How results show themselves: a table of their attributes for notebooks, and pictures without knowing how to draw.

For pictures they ask a presenter that a layer above them has named. The root of the package names the module; it is
imported when first asked, so that ``import creeping`` brings no drawing library.
"""

from dataclasses import fields
from html import escape
from importlib import import_module
from typing import Any

_module = ""


def present_with(module: str) -> None:
    """Name the module whose ``plot`` and ``to_polydata`` draw results."""
    global _module
    _module = module


def brief(value: object, width: int = 72) -> str:
    """One line of a value's repr: a body may be a long expression, or of a user's own class."""
    text = " ".join(repr(value).split())
    return text if len(text) <= width else f"{text[: width - 3]}..."


def content(value: Any) -> str:
    """What an attribute holds, in words: of an array its shape and range, or how often each word, code or flag occurs.

    Examples
    --------
    >>> import numpy as np
    >>> content(np.array([[3.0, np.nan], [-1.0, 2.0]])), content(np.array([4 + 3j, 0]))
    ('2 x 2, -1 to 3, 1 not finite', '2 complex, size up to 5')
    >>> content(np.array(["rays", "lit", "rays"])), content(np.array([True, False])), content((1.0, "m"))
    ('lit (1), rays (2)', 'False (1), True (1)', "(1.0, 'm')")
    """
    # not at the head: ``import creeping`` brings no numpy
    import numpy as np

    named = value._asdict() if hasattr(value, "_asdict") else value
    if isinstance(named, dict):
        return "; ".join(f"{name}: {content(one)}" for name, one in named.items()) or "none"
    if not isinstance(value, np.ndarray):
        text = brief(value, 200)
        return type(value).__name__ if "array(" in text else text
    if value.dtype.kind not in "fc":
        seen, counts = np.unique(value, return_counts=True)
        if len(seen) <= 8:
            return ", ".join(f"{one} ({count})" for one, count in zip(seen, counts, strict=True)) or "none"
    shape = " x ".join(map(str, value.shape)) or "one"
    finite = value[np.isfinite(value)] if value.dtype.kind in "iufc" else value[:0]
    if value.dtype.kind == "c":
        size = f" complex, size up to {np.abs(finite).max():.6g}" if finite.size else " complex"
    else:
        size = f", {finite.min():.6g} to {finite.max():.6g}" if finite.size else ""
    missing = value.size - finite.size if value.dtype.kind in "fc" else 0
    return shape + size + f", {missing} not finite" * bool(missing)


class Shown:
    """A result with a table for notebooks."""

    # no state: results stay frozen and weakly referable, and pickle as before
    __slots__ = ()

    def _repr_html_(self) -> str:
        """What it says of itself and a table of what it holds: no script, no style sheet, nothing from elsewhere."""
        left, rows = ' style="text-align:left"', ""
        for name in (one.name for one in fields(self) if not one.name.startswith("_")):  # type: ignore[arg-type]
            rows += f'<tr><th scope="row"{left}>{name}</th><td{left}>{escape(content(getattr(self, name)))}</td></tr>'
        return f"<pre>{escape(repr(self))}</pre><table><tbody>{rows}</tbody></table>"


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
            the result; see `line_plots`, `far_cuts`, `plane_pictures`, `coupling_pictures` and `echo_pictures` of
            `creeping.plotting`:

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
