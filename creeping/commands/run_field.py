"""The field of one ``creeping run``: what its options ask for, and the files that come of it. Angles in degrees."""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from creeping import files, plotting
from creeping._typing import ArrayLike, FloatArray
from creeping.commands.forecast import Forecast, asked_wavenumber, forecast, frequency_words
from creeping.commands.options import Output, WaveOptions, each_once, write_tables
from creeping.commands.resuming import Unfinished
from creeping.errors import CreepingError, InvalidInputError
from creeping.field.body_currents import cached_currents
from creeping.field.boundary import BoundaryLike, parse_boundary
from creeping.field.equation.solution import Solution
from creeping.field.equation.solving import solved_alone
from creeping.field.far import far_field_uncertainty, far_in_parts
from creeping.field.results.comparison import cross_section_decibels
from creeping.field.results.far_result import FarField, turned_to_azimuth
from creeping.field.results.labelled import POLARISATIONS
from creeping.field.validity_range import validity
from creeping.field.waves.forward import lobe_step
from creeping.files.ffe import grid_directions
from creeping.geometry.directions import azimuth_elevation_of, unit_direction, unit_directions
from creeping.geometry.incident import REMEDY, PlaneWave, incident_words
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface
from creeping.rays.fan import RayFan
from creeping.storage.parts import Arrays

DPI = 200
"""Of pictures."""
MOST = 200_000
"""Directions of one run."""


@dataclass(frozen=True)
class Target:
    """Directions of one ``--observe``: ``theta`` (t,) and ``phi`` (p,) in radians, and the unit vectors (m, 3)."""

    kind: str
    text: str
    theta: FloatArray
    phi: FloatArray
    directions: FloatArray
    fits_lobes: bool = False
    """Whether its step is to be as fine as the lobes ask for."""

    def fitted(self, step: float) -> "Target":
        """The same cut with a step, degrees, if it has none of its own that is finer."""
        return _cut(self.text, float(np.degrees(self.phi[0])), step) if self.fits_lobes and step < 1 else self

    @property
    def angles(self) -> FloatArray:
        """Angle along a cut (m,), degrees, theta with its sign; NaN of what is none."""
        return np.degrees(self.theta) if self.kind == "cut" else np.full(len(self.directions), np.nan)

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
    unit: str | None = None
    """Of lengths: "m" if a frequency was asked for, else what the body says."""
    frequency: float | None = None
    components: tuple[str, ...] = ("tt", "pp")
    cure: str = ""
    """What to look at where the body has an absurd size in wavelengths."""

    def fitted(self, body: Surface) -> "Job":
        """The job with cuts whose step fits the lobes, of those that have none given."""
        # no finer than a twentieth of a degree
        step = max(lobe_step(body, self.wavenumber, monostatic=False), 0.05)
        found = replace(self, targets=tuple(target.fitted(step) for target in self.targets))
        found.check_count()
        return found

    def check_count(self) -> None:
        """Refuse more directions than are bearable."""
        count = sum(len(target.directions) for target in self.targets)
        if count > MOST:
            raise InvalidInputError(f"--observe asks for {count} directions; {MOST} are the most: give a coarser step")

    def forecast(self, body: Surface, incident: Any) -> Forecast:
        """What the field is made by, and how well."""
        azimuth, elevation = azimuth_elevation_of(-np.asarray(incident.direction, dtype=float)[None])
        return forecast(
            body,
            self.wavenumber,
            self.boundary,
            radar=(np.degrees(azimuth), np.degrees(elevation)),
            observers=len(self.directions),
            metres=self.unit == "m",
            cure=self.cure,
        )

    @property
    def wave(self) -> dict[str, Any]:
        """Wavenumber and boundary, as pictures ask for them."""
        return {"wavenumber": self.wavenumber, "boundary": self.boundary}

    def told(self, unit: str) -> str:
        """Wavenumber and frequency in words."""
        hertz = "" if self.frequency is None else f"{frequency_words(self.frequency)}, "
        return f"{hertz}k = {self.wavenumber:g}/{unit}"

    def far_field(
        self, fan: RayFan, unfinished: Unfinished, told: Callable[[float, int], None] = lambda *_: None
    ) -> tuple[FarField, float]:
        """Far field in the directions of all targets, one after the other, and the seconds that it took."""
        started = time.perf_counter()
        parts, there = unfinished.kept_parts(), list[FarField]()
        count = len(self.directions)

        def keep(name: str, make: Callable[[], Arrays]) -> Arrays:
            found = parts(name, make)
            if not name.startswith("rays-"):
                return found
            there.append(FarField.unpacked(found))
            done = sum(len(one.total) for one in there)
            told(done, count)
            if done < count:
                unfinished.now_and_then(lambda: self._write_rows(FarField.joined(there), unfinished))
            return found

        try:
            far = far_in_parts(fan, self.directions, keep=keep, order=2, **self.wave)
        except BaseException:
            if there:
                self._write_rows(FarField.joined(there), unfinished)
            raise
        return self._turned(far), round(time.perf_counter() - started, 2)

    def _write_rows(self, far: FarField, unfinished: Unfinished) -> None:
        """Write the rows of the first directions, with marks that others are missing."""
        done, count = len(far.total), len(self.directions)
        mark = f"incomplete: {done} of {count} directions; {unfinished.mark}"
        texts, angles = self._observed
        observed = texts[:done], angles[:done]
        files.write_csv(unfinished.output / "far.csv", far=self._turned(far), observed=observed, mark=mark)
        words = {"directions_done": done, "directions": count, "resume": unfinished.again}
        unfinished.write_summary(words, complete=False)

    def solved(
        self, body: Any, direction: ArrayLike, tell: Callable[[str], None], unfinished: Unfinished
    ) -> tuple[Solution, FarField, float]:
        """The same of a body without rays, by its integral equation, whose solution comes first."""
        started = time.perf_counter()
        keep, d = unfinished.kept_parts(), unit_directions(direction, "direction").reshape(-1, 3)
        solution = solved_alone(body, d, self.wavenumber, self.boundary, tell=tell, keep=keep)
        far = self._turned(solution.far_field(self.directions))
        return solution, far, round(time.perf_counter() - started, 2)

    @property
    def directions(self) -> FloatArray:
        """Directions of all targets (m, 3), one after the other."""
        return np.concatenate([target.directions for target in self.targets])

    @property
    def _observed(self) -> tuple[list[str], FloatArray]:
        """What each direction was asked for as, and its angle along the cut (m,), degrees."""
        texts = [target.text for target in self.targets for _ in target.directions]
        return texts, np.concatenate([target.angles for target in self.targets])

    def _turned(self, far: FarField) -> FarField:
        """A far field in the frames of the targets and the unit that was asked for."""
        if far.total.ndim == 3:
            # of the first directions, where not all are there yet
            turn = np.concatenate([target.frames for target in self.targets])[: len(far.total)]
            parts = {name: np.einsum("nab,nbc->nac", turn, values) for name, values in far.parts.items()}
            # of a component and of the other at a pole, which the turn may exchange
            error = np.sqrt(np.einsum("nab,nbc->nac", turn**2, far.error**2))
            far = replace(far, total=np.einsum("nab,nbc->nac", turn, far.total), parts=parts, error=error)
        return replace(far, unit=self.unit or far.unit)

    def write(self, far: FarField, of: RayFan | Solution, output: Output) -> tuple[dict[str, Any], list[str]]:
        """Write the files of a far field; returns the entry of the summary and their names."""
        direction = of.line.direction if isinstance(of, RayFan) else of.directions[0]
        names = write_tables(output.folder / "far", output.formats, far, observed=self._observed, far=far)
        for target, piece in zip(self.targets, self._pieces(far), strict=True):
            # a .ffe file holds no infinity; the table does
            if target.kind == "grid" and np.all(np.isfinite(piece.total)):
                where = output.folder / "far.ffe"
                files.write_ffe(where, piece, target.theta, target.phi, direction=direction)
                names.append(where.name)
        if output.pictures:
            names += self._pictures(far, of, output)
        size = np.abs(far.total)
        finite = np.isfinite(size)
        largest, off = float(np.max(size[finite], initial=0.0)), far.stated_error
        top = float(cross_section_decibels(largest))
        entry: dict[str, Any] = {
            "wavenumber": self.wavenumber,
            "frequency": self.frequency,
            "unit": far.unit,
            "boundary": far.boundary,
            "order": far.order,
            "observe": [target.text for target in self.targets],
            "directions": len(far.directions),
            "largest": largest,
            "largest_db": top if np.isfinite(top) else None,
            "not_finite": int(np.sum(~finite)),
            "methods": dict(sorted(Counter(far.method.tolist()).items())),
            "unresolved": int(far.unresolved.sum()),
            "error": {"rms": None, "max": None, "by": None}
            if off is None
            else {"rms": off[0], "max": off[1], "by": far.error_source},
        }
        if isinstance(of, RayFan):
            found = validity(of, wavenumber=self.wavenumber)._asdict()
            entry["validity"] = {name: float(one) if np.isfinite(one) else None for name, one in found.items()}
            if hasattr(of.body, "coarse_fit"):
                entry["uncertain_by"] = self._uncertainty(far, of)
        return entry, names

    def _uncertainty(self, far: FarField, fan: RayFan) -> dict[str, Any]:
        """Rms and largest change on the second fit, or why there is none to tell."""
        try:
            change = far_field_uncertainty(fan, far.directions, **self.wave)
        except CreepingError as error:
            # the second fit may have a shadow line that cannot be followed
            return {"rms": None, "max": None, "reason": str(error)}
        known = np.zeros(0) if change is None else change[np.isfinite(change)]
        if not len(known):
            return {"rms": None, "max": None, "reason": "no direction has a finite field on both bodies"}
        return {"rms": float(np.sqrt(np.mean(known**2))), "max": float(known.max()), "reason": None}

    def _pieces(self, far: FarField) -> list[FarField]:
        """The far field of each target."""
        ends = np.cumsum([len(target.directions) for target in self.targets])
        return [far.take(slice(end - len(t.directions), end)) for t, end in zip(self.targets, ends, strict=True)]

    def _pictures(self, far: FarField, of: RayFan | Solution, output: Output) -> list[str]:
        names, folder = list[str](), output.folder
        wave = self.told(far.unit)
        shown: dict[str, Any] = {"wave": wave, "name": output.name, "backend": output.backend, "dpi": DPI}
        source = of.line.source if isinstance(of, RayFan) else PlaneWave(of.directions[0])
        known = far.error[np.isfinite(far.error)]
        off = f"; error {np.median(known):.1g} {far.unit} in the median" if len(known) else ""
        title = f"{output.name}, {incident_words(source)}\n{wave}, {far.boundary}{off}".replace("$", r"\$")
        # cuts of one step are one picture
        cuts: dict[int, tuple[FloatArray, dict[str, FarField]]] = {}
        for target, piece in zip(self.targets, self._pieces(far), strict=True):
            if target.kind == "cut":
                _, group = cuts.setdefault(len(target.theta), (target.theta, {}))
                group[f"φ = {np.degrees(target.phi[0]):g}°"] = piece
        words: dict[str, Any] = {"quantity": "rcs", "components": self.components, "title": title, "dpi": DPI}
        for theta, group in cuts.values():
            # zeros, and what is not finite, cannot be drawn in decibels
            if any(np.any(np.isfinite(piece.total) & (piece.total != 0)) for piece in group.values()):
                names.append(f"far_{len(names) + 1}.png" if names else "far.png")
                words |= {"parts": len(group) == 1, "angle_name": "θ"}
                plotting.far_cut_picture(folder / names[-1], theta, group, **words)
        if far.error_by == "extinction":
            currents = cached_currents(of, self.wavenumber, self.boundary) if isinstance(of, RayFan) else of.currents()
            plotting.currents_picture(folder / "field.png", currents, **shown)
            names.append("field.png")
        # at points between rays the field needs a smooth body
        elif isinstance(of, RayFan) and self.boundary != "pec" and not is_piecewise(of.body):
            plotting.surface_field_picture(folder / "field.png", of, **self.wave, **shown)
            names.append("field.png")
        return names


def job(
    wave: WaveOptions,
    boundary: str | None,
    observe: Sequence[str] | None,
    direction: Sequence[float] | None,
    *,
    weighted: bool = False,
    polarisation: str | None = None,
) -> Job | None:
    """What the options ask for, None without a wavenumber, a frequency or a wavelength.

    ``direction`` is None where the wave is that of a point source.

    Raises
    ------
    InvalidInputError
        On a bad option, or one that needs ``--wavenumber``.
    """
    if wave == WaveOptions(sound_speed=wave.sound_speed):
        options = {"--boundary": boundary, "--observe": observe, "--polarisation": polarisation}
        stray = [name for name, value in (options | {"--sound-speed": wave.sound_speed}).items() if value]
        if stray:
            verb = "needs" if len(stray) == 1 else "need"
            raise InvalidInputError(
                f"{' and '.join(stray)} {verb} --wavenumber or --frequency, which ask for the field"
            )
        return None
    if weighted:
        raise InvalidInputError("--wavenumber is for rays of constant speed; leave out --speed, or the field")
    if direction is None:
        raise InvalidInputError(f"the field of --wavenumber is that of a plane wave; --source is {REMEDY}")
    k, hertz, cure = asked_wavenumber(wave)
    d = unit_direction(direction)
    # the cut through the direction of the wave; of one along z that of phi = 0
    azimuth = 0.0 if np.hypot(d[0], d[1]) < 1e-9 else np.degrees(np.arctan2(d[1], d[0]))
    targets = tuple(parse_target(text, d) for text in observe or [f"cut:{azimuth:.10g}"])
    if sum(target.kind == "grid" for target in targets) > 1:
        raise InvalidInputError("--observe names several grids; give one, far.ffe holds no more")
    kind = _boundary(boundary or "soft")
    unit = "m" if wave.wavenumber is None else None
    if polarisation is not None and kind != "pec":
        raise InvalidInputError("--polarisation is of a conductor; give it with --boundary pec")
    shown = each_once("--polarisation", polarisation or "VV,HH", POLARISATIONS)
    # as pictures name them: tt, tp
    components = tuple("".join(along[0] for along in POLARISATIONS[name]) for name in shown)
    found = Job(k, kind, targets, unit, hertz, components, cure)
    found.check_count()
    return found


def _boundary(text: str) -> BoundaryLike:
    from scatterers import Coating

    try:
        return parse_boundary(text, coating=Coating)
    except (InvalidInputError, ValueError) as error:
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
        plane, colon, given = rest.partition(":")
        (azimuth,) = _numbers(text, plane, 1)
        return _cut(text, azimuth, _numbers(text, given, 1)[0]) if colon else _cut(text, azimuth, 1.0, fits=True)
    if name == "grid":
        parts = _parts(text, _numbers(text, rest, 1)[0], 180, "grid:5")
        # before the arrays are made
        if 2 * parts**2 > MOST:
            raise InvalidInputError(f"--observe {text!r} asks for more than {MOST} directions; give a coarser grid")
        theta, phi = np.linspace(0, np.pi, parts + 1), np.linspace(0, 2 * np.pi, 2 * parts + 1)
        return Target("grid", text, theta, phi, grid_directions(theta, phi))
    pair = _numbers(text, text, 2)
    if not 0 <= pair[0] <= 180:
        raise InvalidInputError(f"--observe {text!r}: theta is not between 0 and 180 degrees")
    angles = np.radians(pair[:1]), np.radians(pair[1:])
    return Target("point", text, *angles, grid_directions(*angles))


def _cut(text: str, azimuth: float, step: float, *, fits: bool = False) -> Target:
    """Directions of a plane from theta = -180 to 180 degrees."""
    parts = _parts(text, step, 360, "cut:0:0.5")
    if parts > MOST:
        raise InvalidInputError(f"--observe {text!r} asks for more than {MOST} directions; give a coarser step")
    theta, phi = np.radians(np.linspace(-180.0, 180.0, parts + 1)), np.radians([azimuth])
    return Target("cut", text, theta, phi, grid_directions(theta, phi), fits)


def _parts(text: str, step: float, whole: int, example: str) -> int:
    """Steps in a half or a whole turn."""
    parts = whole / step if step > 0 else 0.0
    if not (0 < step <= 90 and abs(parts - round(parts)) < 1e-6):
        raise InvalidInputError(
            f"--observe {text!r}: the step must divide {whole} degrees and be at most 90, e.g. {example}"
        )
    return round(parts)


def _numbers(text: str, rest: str, count: int) -> list[float]:
    try:
        numbers = [float(item) for item in rest.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != count or not np.all(np.isfinite(numbers)):
        known = "cut:PHI, cut:PHI:STEP, grid:STEP, THETA,PHI or backscatter, in degrees"
        raise InvalidInputError(f"--observe {text!r} is unknown; give {known}")
    return numbers
