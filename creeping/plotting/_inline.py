"""Figures outside pyplot that notebooks show: no window, no global state, and their axes answer as pictures.

A notebook asks the last value of a cell for ``_repr_png_``, whichever backend is on.
"""

from io import BytesIO

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D

from creeping._typing import Any


class InlineFigure(Figure):
    """A figure that shows itself."""

    def _repr_png_(self) -> bytes:
        """The figure as a PNG."""
        with BytesIO() as stream:
            self.savefig(stream, format="png", dpi=self.dpi)
            return stream.getvalue()


class _Inline:
    """Axes that show the figure that they are in."""

    figure: Any

    def _repr_png_(self) -> bytes:
        """The whole figure as a PNG."""
        return bytes(self.figure._repr_png_())


class InlineAxes(_Inline, Axes):
    """Axes of the plane."""


class InlineAxes3D(_Inline, Axes3D):  # type: ignore[misc, unused-ignore]
    """Axes of space."""


def made(inches: tuple[float, float]) -> InlineFigure:
    """Return a white figure with a canvas of its own."""
    figure = InlineFigure(figsize=inches, facecolor="white")
    FigureCanvasAgg(figure)
    return figure
