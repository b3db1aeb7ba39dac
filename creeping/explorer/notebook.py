"""A fan as a page to turn in a notebook, or to keep as a file: no server, nothing from elsewhere."""

import html
import os
from dataclasses import dataclass
from pathlib import Path

from creeping._presenting import brief
from creeping.errors import CreepingError
from creeping.explorer.request import RAYS, ViewRequest, angles
from creeping.field.boundary import BoundaryLike, boundary_name
from creeping.files import write_text
from creeping.rays.fan import RayFan

HEIGHT = 640
"""Of the page in a notebook, pixels."""


@dataclass(frozen=True, repr=False)
class Page:
    """A page of one incidence; a notebook shows it as the last value of a cell.

    Attributes
    ----------
    text : str
        The page, with all that it needs.
    title : str
    """

    text: str
    title: str

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write it as an HTML file.

        Raises
        ------
        CreepingError
            If the file cannot be written.
        """
        write_text(Path(path), self.text)

    def _repr_html_(self) -> str:
        """A frame that holds the page and may run its own scripts, of the notebook nothing."""
        look = f'width="100%" height="{HEIGHT}" style="border:0" sandbox="allow-scripts"'
        return f'<iframe {look} srcdoc="{html.escape(self.text, quote=True)}"></iframe>'

    def __repr__(self) -> str:
        return f"Page({self.title!r}, {len(self.text) / 1e6:.1f} MB)"


def page(
    fan: RayFan, *, wavenumber: float, boundary: BoundaryLike = "hard", spacing: float | None = None, cut: float = 0.0
) -> Page:
    """The page that ``creeping explore --export`` writes, for the incidence and the length of a fan.

    Parameters
    ----------
    fan : RayFan
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    spacing : float, optional
        Between iso-phase curves; an eighth of the length, 0 for none.
    cut : float, degrees
        Azimuth of the cut of the far field.

    Raises
    ------
    CreepingError
        If viser is not installed.
    InvalidInputError
        On bad numbers.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> line = cr.shadow_line(sc.Sphere(), direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(sc.Sphere()), line, length=2.0, n_rays=32)
    >>> page(fan, wavenumber=20.0, boundary="pec").title            # the page itself: .save("page.html")
    'Sphere(radius=1.0, speed=None)'
    """
    try:
        from creeping.explorer.export import page_of
    except ImportError as error:
        raise CreepingError(f"the page needs viser ({error}); pip install 'creeping[web]'") from error
    rays = min(max(len(fan.points), RAYS[0]), RAYS[1])
    gap = fan.length / 8 if spacing is None else spacing
    kind = boundary_name(boundary)
    request = ViewRequest(*angles(fan.line.direction), rays, fan.length, gap, wavenumber, kind, cut)
    title = brief(fan.body)
    return Page(page_of(fan.flow, request, title)[0], title)
