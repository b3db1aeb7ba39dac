"""Mutated files of meshes, CAD, studies and directions.

A mesh that is accepted must be the one that the file describes by `tests.fuzz.readers`, or the one of the file before
it was changed, where the change means nothing; or its repairs must have been told. Else it is "silent". What a file
of directions holds is read a second time in the same way. Study files and CAD files have no second reader: of the
first, what is accepted must make a request whose numbers are finite and whose arrays have the stated size; of the
second, a body within the bounds that CAD programs of it would believe.
"""

import io
import math
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from tests.fuzz import seeds
from tests.fuzz.calls import ACCEPTED, REFUSED, SILENT, Verdict, failure
from tests.fuzz.mutation import mutated
from tests.fuzz.readers import UnclearError, corners_of

FITTED = 0.01
"""Share of accepted meshes to which a body is fitted, too, unless larger than this."""
LARGEST = 3.0


FloatArray = NDArray[np.float64]


def in_order(corners: FloatArray) -> FloatArray:
    """Triangles (n, 9) whose corners differ, each once, its least corner first, in an order of their own."""
    first, second, third = (corners[:, k] for k in range(3))
    empty = np.all(first == second, axis=1) | np.all(second == third, axis=1) | np.all(first == third, axis=1)
    # numbers below those of single precision are 0 to some readers
    kept = corners[~empty].astype(np.float32).astype(float) + 0.0
    _, rank = np.unique(kept.reshape(-1, 3), axis=0, return_inverse=True)
    start = np.argmin(rank.reshape(-1, 3), axis=1)
    turned = np.take_along_axis(kept, ((start[:, None] + np.arange(3)) % 3)[:, :, None], axis=1)
    return np.unique(turned.reshape(-1, 9), axis=0)


def same(first: FloatArray, second: FloatArray) -> bool:
    """Whether triangles are the same, but for the last digits and for which side is outside as a whole."""
    for turned in (second, second[:, ::-1]):
        one, other = in_order(first), in_order(turned)
        if one.shape == other.shape and np.allclose(one, other, rtol=1e-6, atol=1e-9):
            return True
    return False


@dataclass
class Meshes:
    """Mesh files of one format.

    Parameters
    ----------
    suffix : str
    forms : list of bytes
        Files to begin with.
    text : bool
        Whether numbers and lines of it are changed, too.
    inner : callable, optional
        Makes a file with changes inside its wrapping, whose sums fit.
    fitted : float
        Share of accepted meshes to which a body is fitted.
    """

    suffix: str
    forms: list[bytes]
    text: bool
    inner: Any = None
    fitted: float = FITTED
    known: list[FloatArray] = field(default_factory=list)

    def prepare(self, folder: Path) -> None:
        """Read the files to begin with."""
        import scatterers as sc

        for number, data in enumerate(self.forms):
            place = folder / f"seed-{number}.{self.suffix}"
            place.write_bytes(data)
            mesh, _ = sc.examined_mesh(place, self._units)
            self.known.append(mesh.vertices[mesh.triangles])
            assert same(self.known[-1], corners_of(self.suffix, data)), "the two readers differ on the file as it is"
        if self.fitted:
            sc.Mesh(folder / f"seed-0.{self.suffix}", self._units, cache=False)

    @property
    def _units(self) -> str | None:
        return None if self.suffix in ("glb", "3mf") else "m"

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Change a file, read it and compare."""
        import scatterers as sc

        which = int(rng.integers(len(self.forms)))
        other = self.forms[int(rng.integers(len(self.forms)))]
        inside = self.inner is not None and rng.random() < 0.7
        data = self.inner(rng) if inside else mutated(self.forms[which], rng, other=other, text=self.text)
        path = place.with_suffix(f".{self.suffix}")
        path.write_bytes(data)
        fit = rng.random() < self.fitted
        try:
            mesh, quality = sc.examined_mesh(path, self._units)
            # around a spike the grid of a fit is large, and takes minutes
            if fit and np.ptp(mesh.vertices, axis=0).max() < LARGEST:
                sc.Mesh(path, self._units, cache=False)
        except ValueError as error:
            return Verdict(REFUSED, str(error))
        if mesh.repairs:
            return Verdict(ACCEPTED, "; ".join(mesh.repairs))
        if not np.all(np.isfinite(mesh.vertices)):
            return Verdict(SILENT, "vertices that are not finite")
        found = mesh.vertices[mesh.triangles]
        if any(same(found, known) for known in self.known):
            return Verdict(ACCEPTED, "the file before its change")
        try:
            described = corners_of(self.suffix, data)
        except UnclearError as error:
            return Verdict(SILENT, f"a mesh of {len(found)} triangles is made of a file that has no meaning: {error}")
        if same(found, described):
            return Verdict(ACCEPTED, quality.verdict)
        return Verdict(SILENT, f"{len(found)} triangles are not the {len(described)} of the file")


def _inner_3mf(rng: Generator) -> bytes:
    return seeds.archive_3mf(mutated(seeds.xml_of_3mf(), rng, text=True))


def _inner_glb(rng: Generator) -> bytes:
    import json

    tree, binary = seeds.glb_parts()
    text = json.dumps(tree).encode()
    if rng.random() < 0.6:
        return seeds.glb(text=mutated(text, rng, text=True))
    return seeds.glb(binary=mutated(binary, rng))


def meshes() -> dict[str, Any]:
    """Attacks on mesh files by name."""
    return {
        "stl-text": partial(Meshes, "stl", [seeds.stl_text()], True),
        "stl-binary": partial(Meshes, "stl", [seeds.stl_binary()], False),
        "obj": partial(Meshes, "obj", [seeds.obj()], True),
        "off": partial(Meshes, "off", [seeds.off()], True),
        "ply": partial(Meshes, "ply", [seeds.ply(binary=False), seeds.ply(binary=True)], True),
        "glb": partial(Meshes, "glb", [seeds.glb()], False, _inner_glb),
        "3mf": partial(Meshes, "3mf", [seeds.archive_3mf()], False, _inner_3mf),
    }


class Studies:
    """Study files (TOML)."""

    def prepare(self, folder: Path) -> None:
        """Read the file to begin with."""
        from creeping.sweeping.study import EXAMPLE, parse_study

        self.forms = [seeds.STUDY, EXAMPLE.encode()]
        self.folder = folder
        for data in self.forms:
            assert _number_mistake(parse_study(data.decode(), folder=folder)) == ""

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Change a file and parse it."""
        from creeping import CreepingError
        from creeping.sweeping.study import read_study

        which = int(rng.integers(2))
        data = mutated(self.forms[which], rng, other=self.forms[1 - which], text=True)
        path = place.with_suffix(".toml")
        path.write_bytes(data)
        try:
            study = read_study(path)
        except CreepingError as error:
            return Verdict(REFUSED, str(error))
        mistake = _number_mistake(study)
        return Verdict(SILENT, mistake) if mistake else Verdict(ACCEPTED)


def _number_mistake(study: Any) -> str:
    """What no request may have."""
    request = study.request
    for name, rows in (("incidences", study.incidences), ("observation", request.observation)):
        if len(rows) and not np.allclose(np.linalg.norm(np.asarray(rows), axis=-1), 1.0):
            return f"{name} are not unit vectors"
    numbers = [*np.ravel(request.wavenumbers), request.length]
    if not all(math.isfinite(value) and value > 0 for value in numbers):
        return f"numbers {numbers[:5]}"
    return ""


@dataclass
class Directions:
    """Directions that a study names, as a table or an array."""

    suffix: str

    def prepare(self, folder: Path) -> None:
        """Read the file to begin with."""
        self.seed = seeds.directions_array() if self.suffix == "npy" else seeds.directions_text()

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Change the file, read it, and compare it with what another reader finds."""
        from creeping import CreepingError
        from creeping.sweeping.study_tables import read_directions

        data = mutated(self.seed, rng, text=self.suffix == "csv")
        path = place.with_suffix(f".{self.suffix}")
        path.write_bytes(data)
        mistakes: list[str] = []
        try:
            found = read_directions("incidences", {"kind": "file", "path": path.name}, path.parent, mistakes)
        except CreepingError as error:
            return Verdict(REFUSED, str(error))
        if found is None:
            return Verdict(REFUSED, "; ".join(mistakes)) if mistakes else Verdict(SILENT, "no directions, no mistake")
        try:
            rows = _rows(self.suffix, data)
        except Exception as error:
            return Verdict(SILENT, f"{len(found)} directions of a file without a meaning: {error!r}")
        with np.errstate(all="ignore"):
            expected = rows / np.max(np.abs(rows), axis=1, keepdims=True)
            expected /= np.linalg.norm(expected, axis=1, keepdims=True)
        if found.shape == expected.shape and np.allclose(found, expected, rtol=0, atol=1e-9):
            return Verdict(ACCEPTED)
        return Verdict(SILENT, f"{found.shape} directions are not those of the file {expected.shape}")


def _rows(suffix: str, data: bytes) -> FloatArray:
    if suffix == "npy":
        return np.array(np.load(io.BytesIO(data), allow_pickle=False), dtype=float)
    lines = data.decode().removeprefix("\ufeff").splitlines()
    rows = [line.partition("#")[0].split(",") for line in lines if line.partition("#")[0].strip()]
    named = [word.strip(" \t\"'").lower() for word in rows[0]] == ["x", "y", "z"]
    return np.array([[float(word) for word in row] for row in rows[named:]], dtype=float)


class CadFiles:
    """STEP files, each read by gmsh in a process of its own: about a second a case."""

    def prepare(self, folder: Path) -> None:
        """Have gmsh write an ellipsoid."""
        from scatterers.triangles import cad_file
        from tests.cad_files import write_ellipsoid

        # gmsh tries for ever to mesh some patches that cross themselves: what ends it is the limit, here a short one
        cad_file.TIMEOUT = 10
        write_ellipsoid(folder / "seed.step")
        self.seed = (folder / "seed.step").read_bytes()

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Change the file and make a body of it."""
        import scatterers as sc

        path = place.with_suffix(".step")
        path.write_bytes(mutated(self.seed, rng, text=True))
        try:
            body = sc.Cad(path, points=500, cache=False)
        except ValueError as error:
            return Verdict(REFUSED, str(error))
        except Exception as error:
            return failure(error)
        inside = body.level(np.mean(body.bounds, axis=0))
        good = np.all(np.isfinite(body.bounds)) and np.isfinite(inside)
        return Verdict(ACCEPTED) if good else Verdict(SILENT, f"a body with bounds {body.bounds.tolist()}")
