"""Public functions and methods called with one argument that is bad, and every second time with two.

Every function of `creeping`, the methods of its flows, maps, lines and currents, and the bodies with their methods.
Records that functions return are not made by hand, and pictures are not drawn. What may come of a call:

    a result               whose numbers are finite where it does not say otherwise
    creeping               CreepingError
    scatterers             ValueError, or a TypeError that is raised there on purpose
    methods of bodies      what numpy says of points that are none

A complex argument whose imaginary part is dropped is "silent".

Also here: what an attack is: a kind of cases, each known by the seed and its number.
"""

import dataclasses
import linecache
import os
import traceback
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.random import Generator

from tests.fuzz.mutation import bad_values

COMPLEX_PARAMETERS = ("admittance", "level")
REFUSED, ACCEPTED = "refused", "accepted"
CRASH, WRONG, SLOW, SILENT = "crash", "wrong class", "too long", "silent"
FINDINGS = (CRASH, WRONG, SLOW, SILENT)
"""Verdicts that must not come."""
_MADE: dict[Path, dict[str, Any]] = {}


Call = tuple[Callable[..., Any], dict[str, Any]]


@dataclass(frozen=True)
class Verdict:
    """What came of a case, and the words of the error or of the finding."""

    kind: str
    words: str = ""


class Attack(Protocol):
    """Cases of one kind.

    ``prepare`` is called once in the process that tries the cases, with a folder of its own; it makes the seeds and
    compiles what is compiled at first use. ``attempt`` makes a case with the generator, leaves what it tries in the
    file or folder ``place`` before it tries it, and judges what comes of it.
    """

    def prepare(self, folder: Path) -> None:
        """Make ready."""
        ...

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Make, keep and try a case."""
        ...


def generator(name: str, seed: int, number: int) -> Generator:
    """Source of all chance of a case."""
    return np.random.default_rng([seed, zlib.crc32(name.encode()), number])


def failure(error: BaseException, *allowed: type[BaseException]) -> Verdict:
    """Verdict on an exception: a refusal if its class is allowed, a finding otherwise."""
    words = f"{type(error).__name__}: {error}"[:300]
    if isinstance(error, allowed):
        return Verdict(REFUSED, words)
    last = traceback.extract_tb(error.__traceback__)[-1:]
    where = "".join(f" at {frame.filename}:{frame.lineno}" for frame in last)
    return Verdict(WRONG, words + where)


class BadCalls:
    """Calls with bad arguments, all of them in turn; numbers beyond have two bad arguments."""

    def prepare(self, folder: Path) -> None:
        """Make what functions are called with, and call each as it is meant."""
        # what a call may write goes here
        os.chdir(folder)
        self.calls = calls(folder)
        for name, (function, arguments) in self.calls.items():
            try:
                function(**fresh(arguments, folder))
            except ModuleNotFoundError:
                pass
            except Exception as error:
                raise RuntimeError(f"{name} fails as it is meant: {error!r}") from error
        self.values = bad_values() | others(folder)
        self.cases = [(n, p) for n, (_, arguments) in self.calls.items() for p in arguments]
        self.folder = folder

    def __len__(self) -> int:
        return len(self.cases) * len(self.values)

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Call a function with the bad argument that the number names."""
        names = list(self.values)
        # neighbouring numbers ask different functions, so that a part of the cases asks all
        name, parameter = self.cases[number % len(self.cases)]
        changed = {parameter: names[number // len(self.cases) % len(names)]}
        function, arguments = self.calls[name]
        if number >= len(self):
            changed = {p: names[int(rng.integers(len(names)))] for p in rng.choice(list(arguments), 2)}
        given = fresh(arguments, self.folder) | {p: self.values[value]() for p, value in changed.items()}
        what = f"{name}({', '.join(f'{p} = {value}' for p, value in changed.items())})"
        place.with_suffix(".txt").write_text(what)
        try:
            with np.errstate(all="ignore"):
                found = function(**given)
                mistake = "" if name.startswith("sc.") else not_finite(found)
        except Exception as error:
            if callable(given.get("progress")):
                return Verdict(REFUSED, f"what the caller's function raises: {error!r}")
            return self._judged(name, error, what)
        # of points given to the arithmetic of a body numpy warns
        dropped = [p for p in changed if p not in COMPLEX_PARAMETERS and _is_complex(given[p]) and "()." not in name]
        if mistake or dropped:
            return Verdict(SILENT, f"{what}: {mistake or 'the imaginary part is dropped'}")
        return Verdict(ACCEPTED, what)

    def _judged(self, name: str, error: Exception, what: str) -> Verdict:
        from creeping import CreepingError

        if not name.startswith("sc."):
            allowed: tuple[type[BaseException], ...] = (CreepingError,)
        else:
            # methods of bodies are arithmetic, of which numpy says what is wrong
            wide = (ValueError, TypeError, OverflowError, IndexError, MemoryError)
            arithmetic = wide if "()." in name else (ValueError,)
            allowed = (ValueError, TypeError) if on_purpose(error) else arithmetic
        if isinstance(error, ModuleNotFoundError) and error.name == "gmsh":
            return Verdict(REFUSED, str(error))
        found = failure(error, *allowed)
        return Verdict(found.kind, f"{what}: {found.words}") if found.kind == WRONG else found


def on_purpose(error: BaseException) -> bool:
    """Whether an exception comes from a line that raises it, of our own."""
    frames = traceback.extract_tb(error.__traceback__)
    last = frames[-1]
    line = linecache.getline(last.filename, last.lineno or 0)
    return "scatterers" in last.filename and line.strip().startswith("raise")


def _is_complex(value: Any) -> bool:
    try:
        return bool(np.iscomplexobj(value) and np.any(np.imag(value) != 0))
    except Exception:
        return False


def not_finite(result: object) -> str:
    """What in a result is not finite, though the result says nothing of it."""
    found: Any = result
    if isinstance(found, tuple):
        return "; ".join(filter(None, map(not_finite, found)))
    if isinstance(found, np.ndarray) and found.dtype.kind in "fc" and not np.all(np.isfinite(found)):
        return f"{int(np.sum(~np.isfinite(found)))} of {found.size} numbers are not finite"
    kind = type(found).__name__
    if kind == "FarField":
        total = np.asarray(found.total)
        finite = np.isfinite(total).all(axis=tuple(range(found.unresolved.ndim, total.ndim)))
        bad = ~finite & ~found.unresolved
        return f"{int(bad.sum())} directions of the far field" if bad.any() else ""
    if kind in ("NearField", "SurfaceField"):
        bad = ~np.isfinite(np.asarray(found.values)) & np.asarray(found.ok)
        return f"{int(bad.sum())} values of {kind}" if bad.any() else ""
    if kind == "RayFan" and found.points.size:
        good = np.all(np.isfinite(found.points), axis=(1, 2)) | (np.asarray(found.status) != 0)
        return "" if np.all(good) else f"{int(np.sum(~good))} rays"
    return ""


def fresh(arguments: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Arguments of a call, folders to be written not there yet."""
    found = dict(arguments)
    for name, value in arguments.items():
        if isinstance(value, NewFolder):
            value.count += 1
            found[name] = folder / f"written-{value.count}"
    return found


@dataclasses.dataclass
class NewFolder:
    """Stands for a folder that is not there."""

    count: int = 0


def _fixtures(folder: Path) -> dict[str, Any]:
    import creeping as cr
    import scatterers as sc
    from tests.fuzz import seeds

    body = sc.Ellipsoid(1.2, 0.8, 0.8)
    flow = cr.DirectFlow(body, rtol=1e-8)
    line = cr.shadow_line(body, (0, 0, 1), n_points=64)
    fan = cr.launch(flow, line, length=3.0, n_rays=24, n_steps=24)
    held = cr.build_phase_map(body, horizon=0.5, grid=(12, 12), degree=3, cache=False)
    tuned = cr.build_phase_map(body, tolerance=1e-3, length=2.0, cache=False)
    (folder / "body.obj").write_bytes(seeds.obj())
    stored = held.save(folder / "stored-map")
    currents = cr.surface_currents(fan, wavenumber=12.0, boundary="hard")
    return {"body": body, "flow": flow, "line": line, "fan": fan, "map": held, "stored": stored,
            "currents": currents, "growth": tuned.growth, "mesh": folder / "body.obj"}  # fmt: skip


def others(folder: Path) -> dict[str, Callable[[], Any]]:
    """Objects of the program where another one is due."""
    import creeping as cr
    import scatterers as sc

    made = _fixtures_of(folder)
    names = ("body", "flow", "line", "fan", "map", "currents")
    found: dict[str, Callable[[], Any]] = {f"a {name}": lambda name=name: made[name] for name in names}  # type: ignore[misc]
    far = cr.far_field(made["fan"], [(0, 0, 1)], wavenumber=10.0)
    return found | {
        "a far field": lambda: far,
        "an impedance": lambda: cr.ImpedanceBoundary(0.5 + 0.1j),
        "a class of bodies": lambda: sc.Sphere,
        "a weighted body": lambda: sc.Sphere(speed="1 + x/4"),
        "a tiny body": lambda: sc.Sphere(1e-200),
        "an error": lambda: cr.InvalidInputError("x"),
    }


def _fixtures_of(folder: Path) -> dict[str, Any]:
    if folder not in _MADE:
        _MADE[folder] = _fixtures(folder)
    return _MADE[folder]


def calls(folder: Path) -> dict[str, Call]:
    """Functions by name, each with arguments as they are meant."""
    made = _fixtures_of(folder)
    return {**_calls_of_rays(made), **_calls_of_fields(made), **_calls_of_bodies(made)}


def _calls_of_rays(made: dict[str, Any]) -> dict[str, Call]:
    import creeping as cr

    body, flow, line, fan, held = (made[name] for name in ("body", "flow", "line", "fan", "map"))
    x, p = np.array([[1.2, 0.0, 0.0]]), np.array([[0.0, 1.0, 0.0]])
    times = np.array([0.25, 0.5])
    states = np.concatenate([x, p], axis=1)
    lengths = {"length": 1.0, "tolerance": 1e-3, "n_rays": 100, "n_steps": 1, "carry_jacobi": True, "cache": False}
    given = {"horizon": 0.5, "grid": (12, 12), "degree": 3, "precision": None, "method": "direct", "cache": False}
    return {
        "shadow_line": (cr.shadow_line, {"body": body, "direction": (0, 0, 1), "n_points": 64}),
        "check_surface": (cr.check_surface, {"body": body}),
        "trace": (cr.trace, {"body": body, "points": x, "directions": p, "times": times, "rtol": 1e-8}),
        "DirectFlow": (cr.DirectFlow, {"body": body, "rtol": 1e-8, "horizon": 1.0, "step": None, "error": None}),
        "DirectFlow.flow": (flow.flow, {"points": x, "directions": p, "times": times}),
        "DirectFlow.apply": (flow.apply, {"points": x, "directions": p}),
        "DirectFlow.transport": (flow.transport, {"states": states, "times": times}),
        "PhaseMap.flow": (held.flow, {"points": x, "directions": p, "times": times}),
        "PhaseMap.apply": (held.apply, {"points": x, "directions": p}),
        "PhaseMap.transport": (held.transport, {"states": states, "times": times}),
        "PhaseMap.save": (held.save, {"folder": NewFolder()}),
        "build_phase_map, given": (
            cr.build_phase_map,
            {"body": body, **given, "time_step": None, "stages": None, "progress": None},
        ),
        "build_phase_map, tuned": (cr.build_phase_map, {"body": body, **lengths, "progress": None}),
        "choose_flow": (cr.choose_flow, {"body": body, **lengths, "progress": None}),
        "load_phase_map": (cr.load_phase_map, {"folder": made["stored"], "body": body}),
        "fibonacci_directions": (cr.fibonacci_directions, {"n": 5}),
        "launch": (
            cr.launch,
            {"flow": flow, "line": line, "length": 1.0, "wavenumber": 20.0, "n_rays": 8, "n_steps": 8,
             "launch_from": "attached", "max_gap": np.inf, "measured": True},
        ),
        "iso_phase_curves": (
            cr.iso_phase_curves,
            {"fan": fan, "levels": [0.5, 1.0], "of": "travel_time", "beyond_detachment": True},
        ),
        "ShadowLine.arcs": (line.arcs, {"launch_from": "attached"}),
        "ShadowLine.launch_points": (line.launch_points, {"n_rays": 8, "launch_from": "attached"}),
        "ErrorGrowth.rms_after": (made["growth"].rms_after, {"length": 1.0}),
        "ErrorGrowth.trusted_length": (made["growth"].trusted_length, {"tolerance": 1e-3}),
        "sweep_directions": (
            cr.sweep_directions,
            {"flow": flow, "directions": [(0, 0, 1), (1, 0, 0)], "wavenumbers": [10.0], "quantity": "monostatic",
             "observation": None, "boundary": "soft", "length": 2.0, "n_rays": 16, "n_steps": 1, "order": 2,
             "method": "rays", "store": None, "resume": False, "client": None, "chunk": None, "progress": None},
        ),
    }  # fmt: skip


def _calls_of_fields(made: dict[str, Any]) -> dict[str, Call]:
    import creeping as cr

    fan, currents = made["fan"], made["currents"]
    at = {"wavenumber": 12.0, "boundary": "hard", "order": 2}
    looks, outside = [(0.0, 0.6, -0.8)], [(0.0, 0.2, 1.5)]
    return {
        "surface_field": (cr.surface_field, {"fan": fan, "points": [(0.0, 0.0, 0.8)], **at}),
        "near_field": (cr.near_field, {"fan": fan, "points": outside, **at, "method": "auto"}),
        "conductor_field": (
            cr.conductor_field,
            {"fan": fan, "points": outside, "wavenumber": 12.0, "polarisation": (1.0, 0.0, 0.0)},
        ),
        "conductor_current": (
            cr.conductor_current,
            {"fan": fan, "points": [(0.0, 0.0, 0.8)], "wavenumber": 12.0, "polarisation": "theta"},
        ),
        "far_field": (cr.far_field, {"fan": fan, "observation": looks, **at, "method": "auto"}),
        "far_field by rays": (cr.far_field, {"fan": fan, "observation": looks, **at, "method": "rays"}),
        "far_field_uncertainty": (cr.far_field_uncertainty, {"fan": fan, "observation": looks, **at}),
        "surface_currents": (cr.surface_currents, {"fan": fan, "wavenumber": 12.0, "boundary": "pec"}),
        "body_uncertainty": (cr.body_uncertainty, {"fan": fan, "n_rays": 8}),
        "validity": (cr.validity, {"fan": fan, "wavenumber": 12.0}),
        "ImpedanceBoundary": (cr.ImpedanceBoundary, {"admittance": 0.5}),
        "SurfaceCurrents.error": (currents.error, {"directions": looks}),
        "SurfaceCurrents.far": (currents.far, {"directions": looks}),
        "SurfaceCurrents.scattered": (currents.scattered, {"points": outside}),
    }


def _calls_of_bodies(made: dict[str, Any]) -> dict[str, Call]:
    import scatterers as sc

    ball = "x**2 + y**2 + z**2 - 1"
    nodes = np.linspace(-1.4, 1.4, 12)
    samples = nodes[:, None, None] ** 2 + nodes[:, None] ** 2 + nodes**2 - 1
    box = [[-1.4] * 3, [1.4] * 3]
    options: dict[str, Any] = {"strict": False, "speed": None}
    files = {"units": "m", **options, "cache": False, "progress": None}
    found: dict[str, Call] = {
        "sc.Sphere": (sc.Sphere, {"radius": 1.0, "speed": None}),
        "sc.Ellipsoid": (sc.Ellipsoid, {"a": 1.0, "b": 0.8, "c": 0.6, "speed": None}),
        "sc.Torus": (sc.Torus, {"R": 1.0, "r": 0.4, "speed": None}),
        "sc.TwistedEllipsoid": (sc.TwistedEllipsoid, {"a": 0.5, "b": 0.5, "c": 1.0, "d": 0.2, "speed": None}),
        "sc.Cylinder": (sc.Cylinder, {"radius": 1.0, "length": 2.0, "speed": None}),
        "sc.Capsule": (sc.Capsule, {"radius": 1.0, "length": 4.0, "speed": None}),
        "sc.Cone": (sc.Cone, {"radius": 1.0, "length": 2.0, "top": 0.5, "speed": None}),
        "sc.ConeSphere": (sc.ConeSphere, {"radius": 1.0, "length": 4.0, "speed": None}),
        "sc.Ogive": (sc.Ogive, {"radius": 1.0, "length": 5.0, "speed": None}),
        "sc.DoubleOgive": (
            sc.DoubleOgive,
            {"radius": 1.0, "lower": 2.5, "upper": 5.0, "lower_angle": 0.8, "upper_angle": None, "speed": None},
        ),
        "sc.Almond": (sc.Almond, {"length": 1.0, "speed": None}),
        "sc.Revolution": (
            sc.Revolution,
            {"profile": [(0.0, 0.0), (0.5, 1.0), (1.5, 1.0), (2.0, 0.0)], "corners": [1, 2], "speed": None},
        ),
        "sc.Cylinder.tiles": (sc.Cylinder(1.0, 2.0).tiles, {"edge": 0.5}),
        "sc.ExpressionSpeed": (sc.ExpressionSpeed, {"expression": "1 + x/4"}),
        "sc.Implicit": (
            sc.Implicit,
            {
                "expression": ball,
                "bounds": [[-2] * 3, [2] * 3],
                "centre": (0, 0, 0),
                "strict": False,
                "speed": None,
            },
        ),
        "sc.Gridded": (sc.Gridded, {"samples": samples, "bounds": box, "centre": None, "speed": None}),
        "sc.Gridded.sampled": (sc.Gridded.sampled, {"body": sc.Sphere(), "nodes": 12, "margin": 0.2, "centre": None}),
        "sc.Mesh": (sc.Mesh, {"source": made["mesh"], **files}),
        "sc.examined_mesh": (sc.examined_mesh, {"source": made["mesh"], "units": "m"}),
        "sc.Cad": (sc.Cad, {"path": made["mesh"].with_suffix(".step"), "points": 500, **files, "units": None}),
    }
    if not made["mesh"].with_suffix(".step").exists():
        from tests.cad_files import write_ellipsoid

        try:
            write_ellipsoid(made["mesh"].with_suffix(".step"))
        except Exception:
            # gmsh is not installed
            del found["sc.Cad"]
    bodies = [sc.Sphere(), sc.Ellipsoid(1.0, 0.8, 0.6), sc.Torus(), sc.TwistedEllipsoid(), sc.Implicit(ball)]
    for body in [*bodies, sc.Gridded(samples, box)]:
        for name in ("level", "gradient", "hessian", "parameters"):
            found[f"sc.{type(body).__name__}().{name}"] = (
                _positional(getattr(body, name)),
                {"points": np.ones((2, 3))},
            )
    return found


def _positional(method: Callable[[Any], Any]) -> Callable[..., Any]:
    return lambda points: method(points)
