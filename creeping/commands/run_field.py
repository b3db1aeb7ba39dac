"""The field of one ``creeping run``: what its options ask for, and the files that come of it. Angles in degrees."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from creeping import files, plotting
from creeping._typing import FloatArray
from creeping.errors import CreepingError, InvalidInputError
from creeping.field.arguments import checked
from creeping.field.boundary import BoundaryLike, parse_boundary
from creeping.field.currents.kept import kept_currents
from creeping.field.far import far_field
from creeping.field.far_result import FarField
from creeping.field.polarisation import turned_to_azimuth
from creeping.field.uncertainty import far_field_uncertainty
from creeping.field.validity_range import Validity, validity
from creeping.files.ffe import grid_directions
from creeping.geometry.directions import unit_direction
from creeping.rays.fan import RayFan

ORDER = 2
PARTS = ("creeping", "reflected", "forward")
MOST = 200_000
"""Directions of one run."""
FORMS = "cut:PHI, grid:STEP, THETA,PHI or backscatter, in degrees"


@dataclass(frozen=True)
class Target:
    """Directions of one ``--observe``: ``theta`` (t,) and ``phi`` (p,) in radians, and the unit vectors (m, 3)."""

    kind: str
    text: str
    theta: FloatArray
    phi: FloatArray
    directions: FloatArray

    @property
    def frames(self) -> FloatArray:
        """Matrices (m, 2, 2) from the frames of `FarField` to that of a cut, which differs at the poles."""
        if self.kind != "cut":
            return np.broadcast_to(np.eye(2), (len(self.directions), 2, 2))
        return turned_to_azimuth(self.directions, np.broadcast_to(self.phi, len(self.directions)))


@dataclass(frozen=True)
class Job:
    """A field to be computed."""

    wavenumber: float
    boundary: BoundaryLike
    targets: tuple[Target, ...]

    def far_field(self, fan: RayFan) -> tuple[FarField, float]:
        """Far field in the directions of all targets, one after the other, and the seconds that it took."""
        started = time.perf_counter()
        directions = np.concatenate([target.directions for target in self.targets])
        far = far_field(fan, directions, wavenumber=self.wavenumber, boundary=self.boundary, order=ORDER)
        if far.total.ndim == 3:
            turn = np.concatenate([target.frames for target in self.targets])
            parts: dict[str, Any] = {name: np.einsum("nab,nbc->nac", turn, getattr(far, name)) for name in PARTS}
            # of a component and of the other at a pole, which the turn may exchange
            error = np.sqrt(np.einsum("nab,nbc->nac", turn**2, far.error**2))
            far = replace(far, **parts, error=error)
        return far, round(time.perf_counter() - started, 2)

    def write(self, far: FarField, fan: RayFan, output: Path, backend: str) -> tuple[dict[str, Any], list[str]]:
        """Write the files of a far field; returns the entry of the summary and their names."""
        names = self._write(far, fan, output, backend)
        methods, counts = np.unique(far.method, return_counts=True)
        size = np.abs(far.total)
        finite = np.isfinite(size)
        entry = {
            "wavenumber": self.wavenumber,
            "boundary": far.boundary,
            "order": far.order,
            "observe": [target.text for target in self.targets],
            "directions": len(far.directions),
            "largest": float(np.max(size[finite], initial=0.0)),
            "not_finite": int(np.sum(~finite)),
            "methods": {str(name): int(count) for name, count in zip(methods, counts, strict=True)},
            "unresolved": int(far.unresolved.sum()),
            "error": _stated_error(far),
            "validity": _named(validity(fan, wavenumber=self.wavenumber)),
        }
        if hasattr(fan.body, "coarse_fit"):
            entry["uncertain_by"] = self._uncertainty(far, fan)
        return entry, names

    def _uncertainty(self, far: FarField, fan: RayFan) -> dict[str, Any]:
        """Rms and largest change on the coarser fit, or why there is none to tell."""
        asked: dict[str, Any] = {"wavenumber": self.wavenumber, "boundary": self.boundary, "order": ORDER}
        try:
            change = far_field_uncertainty(fan, far.directions, **asked)
        except CreepingError as error:
            # the coarser fit may have a shadow line that cannot be followed
            return {"rms": None, "max": None, "reason": str(error)}
        known = np.zeros(0) if change is None else change[np.isfinite(change)]
        if not len(known):
            return {"rms": None, "max": None, "reason": "no direction has a finite field on both bodies"}
        return {"rms": float(np.sqrt(np.mean(known**2))), "max": float(known.max()), "reason": None}

    def _write(self, far: FarField, fan: RayFan, output: Path, backend: str) -> list[str]:
        names = ["far.csv"]
        files.write_csv(output / "far.csv", far=far)
        ends = np.cumsum([len(target.directions) for target in self.targets])
        pieces = [_part(far, end - len(t.directions), end) for t, end in zip(self.targets, ends, strict=True)]
        cuts = {
            f"φ = {np.degrees(t.phi[0]):g}°": piece
            for t, piece in zip(self.targets, pieces, strict=True)
            if t.kind == "cut"
        }
        if any(np.any(np.isfinite(piece.total) & (piece.total != 0)) for piece in cuts.values()):
            angles = next(t.theta for t in self.targets if t.kind == "cut")
            plotting.far_cut_picture(output / "far.png", angles, cuts, parts=len(cuts) == 1, angle_name="θ")
            names.append("far.png")
        for target, piece in zip(self.targets, pieces, strict=True):
            # a .ffe file holds no infinity; the table does
            if target.kind == "grid" and np.all(np.isfinite(piece.total)):
                where = output / "far.ffe"
                files.write_ffe(where, piece, target.theta, target.phi, direction=fan.line.direction)
                names.append(where.name)
        if far.error_by == "extinction":
            currents = kept_currents(fan, self.wavenumber, self.boundary)
            plotting.currents_picture(output / "field.png", currents, backend=backend)
            names.append("field.png")
        elif self.boundary != "pec":
            options: dict[str, Any] = {"wavenumber": self.wavenumber, "boundary": self.boundary, "order": ORDER}
            plotting.surface_field_picture(output / "field.png", fan, backend=backend, **options)
            names.append("field.png")
        return names


def job(
    wavenumber: float | None,
    boundary: str | None,
    observe: Sequence[str] | None,
    direction: Sequence[float],
    *,
    weighted: bool = False,
) -> Job | None:
    """What the options ask for, None without a wavenumber.

    Raises
    ------
    InvalidInputError
        On a bad option, or one that needs ``--wavenumber``.
    """
    if wavenumber is None:
        stray = [name for name, value in (("--boundary", boundary), ("--observe", observe)) if value]
        if stray:
            verb = "needs" if len(stray) == 1 else "need"
            raise InvalidInputError(f"{' and '.join(stray)} {verb} --wavenumber, which asks for the field")
        return None
    if weighted:
        raise InvalidInputError("--wavenumber is for rays of constant speed; leave out --speed, or the field")
    d = unit_direction(direction)
    targets = tuple(parse_target(text, d) for text in observe or [_own_cut(d)])
    if sum(target.kind == "grid" for target in targets) > 1:
        raise InvalidInputError("--observe names several grids; give one, far.ffe holds no more")
    count = sum(len(target.directions) for target in targets)
    if count > MOST:
        raise InvalidInputError(f"--observe asks for {count} directions; {MOST} are the most: give a coarser grid")
    try:
        k = checked(wavenumber, ORDER)
    except CreepingError as error:
        raise InvalidInputError(f"--{error}") from error
    return Job(k, _boundary(boundary or "soft"), targets)


def _boundary(text: str) -> BoundaryLike:
    try:
        return parse_boundary(text)
    except InvalidInputError as error:
        named = str(error).startswith("boundary")
        raise InvalidInputError(f"--{error}" if named else f"--boundary {text!r}: {error}") from error


def parse_target(text: str, direction: FloatArray) -> Target:
    """Directions of one ``--observe`` for a unit incidence (3,).

    Raises
    ------
    InvalidInputError
        If the text has none of the known forms, or an angle out of range.
    """
    name, _, rest = text.partition(":")
    if text == "backscatter":
        return Target("point", text, np.zeros(0), np.zeros(0), -direction[None])
    if name == "cut":
        plane = _numbers(text, rest, 1)
        theta, phi = np.radians(np.arange(-180.0, 181.0)), np.radians(plane)
        return Target("cut", text, theta, phi, grid_directions(theta, phi))
    if name == "grid":
        (step,) = _numbers(text, rest, 1)
        parts = 180 / step if step > 0 else 0.0
        if not (0 < step <= 90 and abs(parts - round(parts)) < 1e-9):
            raise InvalidInputError(
                f"--observe {text!r}: the step must divide 180 degrees and be at most 90, e.g. grid:5"
            )
        # before the arrays are made
        if 2 * parts**2 > MOST:
            raise InvalidInputError(f"--observe {text!r} asks for more than {MOST} directions; give a coarser grid")
        theta, phi = np.linspace(0, np.pi, round(parts) + 1), np.linspace(0, 2 * np.pi, 2 * round(parts) + 1)
        return Target("grid", text, theta, phi, grid_directions(theta, phi))
    pair = _numbers(text, text, 2)
    if not 0 <= pair[0] <= 180:
        raise InvalidInputError(f"--observe {text!r}: theta is not between 0 and 180 degrees")
    angles = np.radians(pair[:1]), np.radians(pair[1:])
    return Target("point", text, *angles, grid_directions(*angles))


def _numbers(text: str, rest: str, count: int) -> list[float]:
    try:
        numbers = [float(item) for item in rest.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not np.all(np.isfinite(numbers)):
        raise InvalidInputError(f"--observe {text!r} is unknown; give {FORMS}")
    return numbers


def _own_cut(direction: FloatArray) -> str:
    """The cut through the direction of the wave; φ = 0 if that is along z."""
    level = np.hypot(direction[0], direction[1]) < 1e-9
    return f"cut:{0.0 if level else np.degrees(np.arctan2(direction[1], direction[0])):.10g}"


def _stated_error(far: FarField) -> dict[str, Any]:
    """Rms and largest error of the field, and what tells it; None where it is not known."""
    off = far.stated_error
    if off is None:
        return {"rms": None, "max": None, "by": None}
    return {"rms": off[0], "max": off[1], "by": far.error_source}


def _named(found: Validity) -> dict[str, float | None]:
    """By name; None where there is no number."""
    return {name: float(value) if np.isfinite(value) else None for name, value in found._asdict().items()}


def _part(far: FarField, start: int, end: int) -> FarField:
    rows = slice(int(start), int(end))
    names = ("directions", "creeping", "reflected", "forward", "method", "unresolved", "error")
    return replace(far, **{name: getattr(far, name)[rows] for name in names})
