"""What is known of a body fitted to points: how well it meets them, and how its curvatures depend on the grid."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class FitReport:
    """Numbers of a fit; curvatures differ between it and a fit on another grid by about their error on the coarser.

    Attributes
    ----------
    points : int
        Points of the body that were fitted.
    spacing, coarser_spacing : float
        Of the grids, L; of a subdivided mesh the second is the finer one.
    nodes : tuple of int
        Of the grid of the fit.
    misfit : float
        Rms distance of the points from the body, L; of a subdivided mesh, of its vertices or of points nearer to them.
    turn : float
        Rms angle between the body's normals and those of these points, radians.
    slope : tuple of float
        Least and largest |grad F| on the body; 1 for a signed distance.
    normal_curvature, gaussian_curvature : float
        Rms of kappa_n over points and directions, 1/L, and of K, 1/L^2.
    normal_curvature_error, gaussian_curvature_error : float
        Rms difference between the two fits and, of points without noise, the angle of normals over the spacing, which
        is in both: the square root of the sum of their squares. The error of the finer fit is about a third of it
        where the grids resolve the body, since curvatures converge with order 4. Of a subdivided mesh it is all of it,
        and what the source cannot show stands for the normals (`scatterers.triangles.subdivision`).
    noise : float
        Rms distance of the points from a smooth body, estimated before the fit, L.
    smoothing : float
        Weight of the fourth differences that was taken.
    factor : float
        By how much the body errs more than it differs from the second fit; 1, of a subdivided mesh larger.
    """

    points: int
    spacing: float
    coarser_spacing: float
    nodes: tuple[int, ...]
    misfit: float
    turn: float
    slope: tuple[float, float]
    normal_curvature: float
    normal_curvature_error: float
    gaussian_curvature: float
    gaussian_curvature_error: float
    noise: float
    smoothing: float
    factor: float = 1.0

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return asdict(self)

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> "FitReport":
        """The report again."""
        return cls(**content | {"nodes": tuple(content["nodes"]), "slope": tuple(content["slope"])})

    def __str__(self) -> str:
        if not self.spacing:
            return f"fit: {self.points} points, all of planes and quadrics, which are exact"
        # a box has no curvature at all
        kappa = self.normal_curvature_error / (self.normal_curvature or 1.0)
        gauss = self.gaussian_curvature_error / (self.gaussian_curvature or 1.0)
        return "\n".join(
            [
                f"fit: {self.points} points, {' x '.join(map(str, self.nodes))} nodes, spacing {self.spacing:.3g} m",
                f"  points off the body by {self.misfit:.1e} m rms, normals by {self.turn:.1e} rad",
                f"  |grad F| {self.slope[0]:.3f} to {self.slope[1]:.3f} (1 for a distance)",
                f"  curvatures against a grid of spacing {self.coarser_spacing:.3g} m: kappa_n {kappa:.1e}, "
                f"K {gauss:.1e} of their rms" + ("" if self.factor == 1 else ", what the source cannot show included"),
            ]
        )
