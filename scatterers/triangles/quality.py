"""Whether a mesh is smooth enough for a smooth surface: figures of its triangles and jets, and a verdict.

With e the mean edge, kappa the larger principal curvature, n_d, kappa_d and res_d normal, curvature and rms residual
of the jet of degree d, a vertex is *bad* if max(|n_4 - n_6|, e |kappa_4 - kappa_6|/3) > 0.03, or if n_6 is more than
0.5 off the normals of its triangles, as at a tip, whose jet follows one side of it; and

    smooth           none of the following;
    sharp            edges of more than 40 degrees that follow each other;
    noisy            res_6/res_2 > 0.15 in the median: neither degree describes the vertices;
    curvature jumps  res_6/res_4 stays near 1/2 along curves. On a smooth surface it falls like (kappa e)^2; where kappa
                     jumps by D, both residuals are D e^2 times a number. Or kappa_4 and kappa_6 differ there by more
                     than a quarter of kappa. Such a surface is C1 only, and hardly a vertex of it is bad;
    too coarse       bad vertices otherwise, kappa e above 0.3, or edges of twice the radius of the jets at their ends
                     and more: in between nothing is known.

Noise of s edges leaves res_4 = 0.95 s e and res_6 = 0.81 s e, a smooth surface res_6 < 4 (kappa e)^2 res_4, which
tells them apart. The thresholds are measured on ellipsoid, torus, twisted and bumpy bodies
of 2000 to 40000 vertices, even and as slivers, with noise of 0.001 to 0.05 e, and on bodies with edges and rims.

Also here: what of a file is the body, and what is done to make it one closed surface.

Sources: Derivations, B5.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.triangles.jets import Jets, angle_weighted_normals
from scatterers.triangles.parts import areas, capped, compact, listed, parts_of, silent, taken_apart, united
from scatterers.triangles.regions import FEWEST, SHARP, turns_of
from scatterers.triangles.topology import cleaned, oriented

BAD = 0.03
RESIDUAL_PER_NOISE = 0.95, 0.81
"""Residuals of degree 4 and 6 on noise: sqrt(1 - terms/neighbours), a little more by the weights."""
ROUNDING = 1e-12
"""Edges below which a residual is rounding of the vertices."""


Verdict = Literal["smooth", "noisy", "sharp", "curvature jumps", "too coarse"]


@dataclass(frozen=True, eq=False)
class MeshQuality:
    """Figures of a mesh; lengths in m, angles in degrees, percentiles over vertices or edges.

    Attributes
    ----------
    vertices, triangles : int
    edge_mean, edge_min, edge_max : float
    size : (3,)
        Sides of the box.
    dihedral : (3,)
        Angle between neighbouring triangles: median, 99 %, largest.
    curvature : float
        99 % of the larger principal curvature times the mean edge.
    residual : float
        99 % of res_6 / e.
    residual_ratio : (2,)
        res_6 / res_2: median, 99 %.
    tilt : (2,)
        |n_4 - n_6|: 99 %, largest.
    bad_share : float
        Share of vertices whose badness exceeds 0.03.
    noise : float
        Estimate of the noise of the vertices, in edges; 0 where the surface itself leaves all of the residuals.
    jumps : int
        Vertices at which the curvature jumps.
    badness : (n,)
        max(|n_4 - n_6|, e |kappa_4 - kappa_6| / 3) at the vertices, and |n_6 - n| where that exceeds 0.5, to be drawn
        on the mesh.
    verdict : {"smooth", "noisy", "sharp", "curvature jumps", "too coarse"}
    reasons : str
        What the verdict rests on and what helps.
    """

    vertices: int
    triangles: int
    edge_mean: float
    edge_min: float
    edge_max: float
    size: FloatArray
    dihedral: FloatArray
    curvature: float
    residual: float
    residual_ratio: FloatArray
    tilt: FloatArray
    bad_share: float
    noise: float
    jumps: int
    badness: FloatArray
    verdict: Verdict
    reasons: str

    def __repr__(self) -> str:
        return f"MeshQuality({self.verdict}: {self.vertices} vertices, {self.bad_share:.2%} bad)\n{self.reasons}"

    @property
    def bad(self) -> BoolArray:
        """Which vertices are bad (n,)."""
        return self.badness > BAD

    def to_json(self) -> dict[str, Any]:
        """Plain numbers and texts, all but ``badness``."""
        found = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "badness"}
        return {name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in found.items()}

    @classmethod
    def from_json(cls, content: dict[str, Any], badness: FloatArray) -> "MeshQuality":
        """The figures again, with the ``badness`` that is kept apart."""
        values: dict[str, Any] = {
            name: np.array(v, dtype=float) if isinstance(v, list) else v for name, v in content.items()
        }
        return cls(**values, badness=badness)

    def summary(self, wavenumber: float | None = None) -> str:
        """Table of the figures, in wavelengths, too, for a wavenumber in 1/m.

        Raises
        ------
        ValueError
            If the wavenumber is not a positive finite number.
        """
        if wavenumber is not None and not 0 < wavenumber < np.inf:
            raise ValueError(f"wavenumber = {wavenumber!r} is not positive and finite; give 2 pi over the wavelength")
        d, r, t = self.dihedral, self.residual_ratio, self.tilt
        rows = [
            ("verdict", self.verdict),
            ("vertices, triangles", f"{self.vertices}, {self.triangles}"),
            ("size", " x ".join(f"{v:.4g}" for v in self.size) + " m"),
            ("edge mean, min, max", f"{self.edge_mean:.4g}, {self.edge_min:.4g}, {self.edge_max:.4g} m"),
            ("dihedral 50 %, 99 %, max", f"{d[0]:.3g}, {d[1]:.3g}, {d[2]:.3g} degrees"),
            ("curvature x edge 99 %", f"{self.curvature:.3g}"),
            ("res6 / edge 99 %", f"{self.residual:.2g}"),
            ("res6 / res2 50 %, 99 %", f"{r[0]:.2g}, {r[1]:.2g}"),
            ("|n4 - n6| 99 %, max", f"{t[0]:.2g}, {t[1]:.2g}"),
            ("bad vertices", f"{self.bad_share:.3%}"),
            ("curvature jumps at", f"{self.jumps} vertices"),
            ("noise of the vertices", f"{self.noise:.2g} edges"),
        ]
        if wavenumber is not None:
            waves = self.size * wavenumber / (2 * np.pi)
            rows.insert(3, ("", " x ".join(f"{v:.4g}" for v in waves) + " wavelengths"))
            rows.insert(5, ("", f"{self.edge_mean * wavenumber / (2 * np.pi):.3g} wavelengths on average"))
        return "\n".join([f"{name:26s} {value}" for name, value in rows] + [self.reasons])


def assess(vertices: FloatArray, triangles: IntArray, jets: Jets) -> MeshQuality:
    """Judge a closed, oriented mesh (n, 3), m, and (m, 3) by its jets."""
    corners = vertices[triangles]
    length = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=-1)
    edge = float(length.mean())
    ends, sides, turn = turns_of(vertices, triangles)
    area = areas(vertices, triangles)
    # normals of slivers tell nothing
    solid = np.min(area[sides], axis=1) > 0.05 * np.median(area)
    ends, angles = ends[solid], np.abs(turn[solid])
    curvature = np.abs(jets.principal).max(axis=1)
    doubt = _doubt(jets)
    astray = np.linalg.norm(jets.normals - angle_weighted_normals(vertices, triangles), axis=1)
    # a jet that does not follow its triangles; on slivers of smooth bodies it is off by less than 0.2
    badness = np.maximum(np.maximum(jets.tilt, edge * doubt / 3), np.where(astray > 0.5, astray, 0.0))
    second, fourth, sixth = np.maximum(jets.residuals, ROUNDING * edge).T
    ratio = sixth / second
    resolved = float(np.percentile(curvature, 99)) * edge
    # noise of the vertices, as a length: what remains of res_6 when that of a smooth surface is taken off
    decay = np.minimum(4 * (curvature * edge) ** 2, 0.5) ** 2
    on4, on6 = RESIDUAL_PER_NOISE
    noise = float(np.median(np.sqrt(np.maximum(sixth**2 - decay * fourth**2, 0) / (on6**2 - decay * on4**2)))) / edge
    jump = jumps_at(jets, edge)
    quality: dict[str, Any] = {
        "vertices": len(vertices),
        "triangles": len(triangles),
        "edge_mean": edge,
        "edge_min": float(length.min()),
        "edge_max": float(length.max()),
        "size": np.ptp(vertices, axis=0),
        "dihedral": np.append(np.percentile(angles, [50, 99]), angles.max()),
        "curvature": resolved,
        "residual": float(np.percentile(sixth, 99)) / edge,
        "residual_ratio": np.percentile(ratio, [50, 99]),
        "tilt": np.append(np.percentile(jets.tilt, 99), jets.tilt.max()),
        "bad_share": float(np.mean(badness > BAD)),
        "noise": noise,
        "jumps": int(jump.sum()),
        "badness": badness,
    }
    # of both ends of the edge that follows each corner
    far = np.minimum(jets.radii[triangles], jets.radii[np.roll(triangles, -1, axis=1)])
    # vertices at which at least two sharp edges meet, or 0 if most sharp edges stand alone, as those of slivers do
    sharp = angles > SHARP
    meeting = np.bincount(ends[sharp].ravel(), minlength=len(vertices))
    chained = int(np.sum(meeting >= 2))
    faults = {"rims": chained if 2 * chained > np.sum(meeting > 0) else 0, "unseen": int(np.sum(length > 2 * far)) // 2}
    verdict, reasons = _verdict(quality, jets, **faults)
    return MeshQuality(**quality, verdict=verdict, reasons=reasons)


def jumps_at(jets: Jets, edge: float) -> BoolArray:
    """Vertices (n,) at which the curvature jumps, by jets on a mesh with this mean edge, L."""
    curvature, doubt = np.abs(jets.principal).max(axis=1), _doubt(jets)
    _, fourth, sixth = np.maximum(jets.residuals, ROUNDING * edge).T
    resolved = float(np.percentile(curvature, 99)) * edge
    jump = (sixth > 0.33 * fourth) & (sixth > 5 * float(np.median(sixth)))
    strong = float(np.percentile(curvature, 90))
    # noise of s e changes kappa_4 - kappa_6 by up to 8 s/e where the jet is well determined
    jump |= doubt > (0.25 + 100 * resolved**4) * strong + 12 * float(np.median(sixth)) / edge**2
    return np.asarray(jump)


def _doubt(jets: Jets) -> FloatArray:
    return np.asarray(np.abs(jets.principal4 - jets.principal).max(axis=1))


def _verdict(quality: dict[str, Any], jets: Jets, *, rims: int, unseen: int) -> tuple[Verdict, str]:
    """Verdict and what it rests on, from the grossest fault to none."""
    # curvature times edge that a uniform grid resolves
    resolved = 0.3
    count, badness, jumps = quality["vertices"], quality["badness"], quality["jumps"]
    curvature, noise = quality["curvature"], quality["noise"]
    bad = int(np.sum(badness > BAD))
    worst = f"worst {badness.max():.2g} at vertex {int(badness.argmax())}"
    if rims >= FEWEST:
        return "sharp", (
            f"{rims} of {count} vertices lie on edges of more than {SHARP:.0f} degrees (largest "
            f"{quality['dihedral'][2]:.0f}); round the edges off over several triangles, or give another body"
        )
    if np.mean(~jets.fitted) > 0.5:
        return "too coarse", f"{count} vertices are too few for a smooth surface; give some thousands"
    if quality["residual_ratio"][0] > 0.15 and curvature < 1:
        return "noisy", (
            f"the vertices scatter by about {noise:.2g} of an edge, {noise * quality['edge_mean']:.2g} m, "
            f"which makes curvatures uncertain by some {100 * min(1.0, noise / max(curvature, 1e-3)):.2g} %; smooth "
            "the mesh, or export it with more digits"
        )
    # so many jumps make a curve over the body
    if 0.5 * np.sqrt(count) <= jumps and curvature < resolved:
        return "curvature jumps", (
            f"the curvature jumps at {jumps} of {count} vertices, as where a cylinder meets a sphere; rays across them "
            "are of low order: blend the faces with continuous curvature"
        )
    if unseen:
        return "too coarse", (
            f"{unseen} edges are much longer than the neighbourhoods of their ends (longest "
            f"{quality['edge_max']:.3g} m, mean {quality['edge_mean']:.3g} m); mesh the body evenly"
        )
    if bad or curvature >= resolved:
        return "too coarse", (
            f"{bad} of {count} vertices are bad ({worst}, allowed {BAD}), curvature times edge is {curvature:.2g}, "
            f"allowed {resolved}; halve the edges, at least where it curves most"
        )
    return "smooth", f"no vertex is bad ({worst}, allowed {BAD}) and curvature times edge is {curvature:.2g}"


def noise_at_most(jets: Jets) -> float:
    """Noise of the vertices, L, if all that jets of degree 6 leave were noise."""
    return float(np.median(jets.residuals[:, 2])) / RESIDUAL_PER_NOISE[1]


@dataclass(frozen=True)
class Choice:
    """What of a file is the body, and what may be done to it.

    Attributes
    ----------
    part : str, int or None
        "largest", a number from 1, or a name; None: there is to be one only.
    cap : float or None
        Holes up to this size, m, are closed.
    union : bool
        The outer surface of all parts is taken.
    subdivide : "auto", int or None
        Loop's subdivision, so many times.
    every : bool
        All closed parts are the body, where none is chosen.
    """

    part: str | int | None = None
    cap: float | None = None
    union: bool = False
    subdivide: str | int | None = None
    every: bool = False

    def __post_init__(self) -> None:
        part, cap, times = self.part, self.cap, self.subdivide
        if part is not None and (isinstance(part, bool) or not isinstance(part, (str, int)) or part in ("", 0)):
            raise ValueError(f'part = {part!r}; give "largest", a number from 1, or a name of the file')
        if cap is not None and (isinstance(cap, bool) or not isinstance(cap, (int, float)) or not cap > 0):
            raise ValueError(f"cap = {cap!r} is no size in m; give that of the largest hole to be closed, inf for all")
        if isinstance(times, bool) or times not in (None, "auto", 1, 2, 3):
            raise ValueError(f'subdivide = {times!r}; give 1, 2 or 3 times, or "auto"')

    @property
    def text(self) -> list[Any]:
        """Plain values that change with it."""
        return [self.part, None if self.cap is None else float(self.cap), self.union, self.subdivide]


def whole_body(
    name: str,
    vertices: FloatArray,
    triangles: IntArray,
    choice: Choice,
    scale: float,
    note: Callable[[str], None],
    *,
    named: bool = False,
) -> tuple[FloatArray, IntArray]:
    """The body that is chosen, with its holes closed, in the unit of the file."""
    vertices, triangles = taken_apart(name, vertices, triangles, note)
    if choice.part is not None and not named:
        if isinstance(choice.part, str) and choice.part != "largest":
            raise ValueError(f'{name} has no part {choice.part!r}; give "largest" or a number from 1')
        # vertices and triangles of one part, by its number from 1, or the largest
        parts = parts_of(vertices, triangles)
        count = int(parts.max()) + 1
        number = 1 if choice.part == "largest" else choice.part
        if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= count:
            raise ValueError(
                f'part = {choice.part!r} is none of {name}; give "largest", or a number: '
                f"{listed(vertices, triangles, parts, scale)}"
            )
        if count > 1:
            left = triangles[parts != number - 1]
            share = float(areas(vertices, left).sum()) / float(areas(vertices, triangles).sum())
            note(f"part {number} of {count} of {name} taken; {100 * share:.2g} % of its area left out")
        vertices, triangles = compact(vertices, triangles[parts == number - 1])
    if choice.cap is not None:
        vertices, triangles = capped(name, vertices, triangles, choice.cap, scale, note)
    if choice.union:
        vertices, triangles = united(name, vertices, triangles, lambda x, t: oriented(name, x, t, silent), note)
        vertices, triangles = cleaned(name, vertices, triangles, silent, silent)
        vertices, triangles = taken_apart(name, vertices, triangles, silent)
    return vertices, triangles
