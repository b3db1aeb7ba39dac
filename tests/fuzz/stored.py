"""Mutated phase maps, fitted bodies and sweep stores.

Bytes of a file are changed as they may rot, and what is then accepted must be equal to what was stored. Of maps and
fits, in as many cases, content is changed and signed anew, as by somebody who means harm: then nothing says what
it ought to be, but kernels must not leave their arrays.

Also here: mutated files of fields: FEKO text.

What is accepted is read a second time, by code of its own, strictly. The same numbers must come of both, else it is
"silent".
"""

import hashlib
import io
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from tests.fuzz import seeds
from tests.fuzz.calls import ACCEPTED, REFUSED, SILENT, Verdict
from tests.fuzz.mutation import mutated, shuffled_array
from tests.fuzz.readers import UnclearError

ODD = (None, True, -1, 0, 1, 3, 2**31, 2**63, 10**30, 1e308, 1e-308, float("nan"), float("inf"), "", "nan", "sphere")
ODD_LISTS: tuple[Any, ...] = ([], [[]], {}, [1], [1, 2, 3], [None], {"a": 1})

COLUMNS = ("Theta", "Phi", "Re(Etheta)", "Im(Etheta)", "Re(Ephi)", "Im(Ephi)")


def odd(rng: Generator) -> Any:
    """A value that JSON can hold and nobody means."""
    values = [*ODD, *ODD_LISTS]
    return values[int(rng.integers(len(values)))]


def with_odd_leaf(tree: Any, rng: Generator) -> Any:
    """A copy of a tree of lists and dictionaries with one value replaced, removed or repeated."""
    if not isinstance(tree, (dict, list)) or not tree or rng.random() < 0.15:
        return odd(rng)
    keys = list(tree) if isinstance(tree, dict) else list(range(len(tree)))
    key = keys[int(rng.integers(len(keys)))]
    found = tree.copy()
    if rng.random() < 0.1:
        del found[key]
    elif isinstance(found, list) and rng.random() < 0.1:
        found.append(found[key])
    else:
        found[key] = with_odd_leaf(tree[key], rng)
    return found


def changed_file(folder: Path, rng: Generator) -> str:
    """Change, remove, empty or exchange a file of a folder; what was done."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    chosen = files[int(rng.integers(len(files)))]
    # small files, of which there may be few, hold what others are read by
    small = [path for path in files if path.suffix == ".json"]
    if small and rng.random() < 0.5:
        chosen = small[int(rng.integers(len(small)))]
    name, kind = chosen.relative_to(folder), rng.random()
    if kind < 0.05:
        chosen.unlink()
        return f"{name} removed"
    if kind < 0.1:
        chosen.write_bytes(b"")
        return f"{name} emptied"
    other = files[int(rng.integers(len(files)))].read_bytes()
    if kind < 0.15 and other != chosen.read_bytes():
        chosen.write_bytes(other)
        return f"{name} replaced by another file of the folder"
    chosen.write_bytes(mutated(chosen.read_bytes(), rng, other=other or None, text=chosen.suffix == ".json"))
    return f"{name} changed"


class Maps:
    """Stored phase maps."""

    def prepare(self, folder: Path) -> None:
        """Build and store two maps."""
        import creeping as cr
        import scatterers as sc

        self.bodies: list[Any] = [sc.Ellipsoid(1.2, 0.8, 0.8), sc.Torus()]
        options: dict[str, Any] = {"horizon": 0.5, "grid": (12, 12), "degree": 3, "cache": False}
        self.maps = [cr.build_phase_map(body, **options) for body in self.bodies]
        self.places = [found.save(folder / f"map-{k}") for k, found in enumerate(self.maps)]
        points = [np.array([[1.2, 0.0, 0.0]] * 3), np.array([[1.5, 0.0, 0.0]] * 3)]
        turns = np.array([0.1, 1.3, 4.0])
        self.starts = [(x, np.stack([0 * turns, np.cos(turns), np.sin(turns)], axis=1)) for x in points]
        self.ends = [found.flow(*start, 1.7) for found, start in zip(self.maps, self.starts, strict=True)]

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Change a map, open it and let it carry rays."""
        import creeping as cr

        which = int(rng.integers(len(self.maps)))
        shutil.copytree(self.places[which], place)
        signed = rng.random() < 0.5
        what = self._signed_anew(place, rng) if signed else changed_file(place, rng)
        try:
            found = cr.load_phase_map(place, self.bodies[which])
            with np.errstate(all="ignore"):
                ends = found.flow(*self.starts[which], 1.7)
        except cr.CreepingError as error:
            return Verdict(REFUSED, str(error))
        equal = all(np.array_equal(one, other) for one, other in zip(ends, self.ends[which], strict=True))
        if signed or (equal and _same_tables(found, self.maps[which])):
            return Verdict(ACCEPTED, what)
        return Verdict(SILENT, f"{what}: the map is another")

    def _signed_anew(self, place: Path, rng: Generator) -> str:
        """Change an array or the manifest, and make all digests fit."""
        from creeping.storage.folder import MANIFEST, content_digest

        content = json.loads((place / MANIFEST).read_text())["content"]
        names = sorted(content["files"])
        if rng.random() < 0.5:
            name = names[int(rng.integers(len(names)))]
            array = shuffled_array(np.load(place / name), rng)
            np.save(place / name, array)
            digest = hashlib.blake2b((place / name).read_bytes(), digest_size=32).hexdigest()
            content["files"][name] = {"shape": list(array.shape), "type": str(array.dtype), "blake2b": digest}
            what = f"{name} signed anew"
        else:
            content, what = with_odd_leaf(content, rng), "manifest signed anew"
        document = {"content": content, "blake2b": content_digest(content)}
        (place / MANIFEST).write_text(json.dumps(document))
        return what


def _same_tables(one: Any, other: Any) -> bool:
    pairs = zip(one.leaps, other.leaps, strict=True)
    return all(
        np.array_equal(getattr(a, name), getattr(b, name))
        for a, b in pairs
        for name in ("state", "centre", "jacobi", "matrix", "curvature")
    )


class Fits:
    """Stored fits of bodies."""

    def prepare(self, folder: Path) -> None:
        """Fit a body and store it."""
        import scatterers as sc
        from tests.fuzz import seeds

        (folder / "body.obj").write_bytes(seeds.obj())
        self.source, self.stored = folder / "body.obj", folder / "fits"
        body = sc.Mesh(self.source, "m", cache=self.stored)
        (held,) = self.stored.glob("*.npz")
        self.whole, self.key = held.read_bytes(), held.stem
        self.points = np.array([[1.3, 0.1, 0.2], [0.0, 0.9, 0.3]])
        self.values = body.level(self.points)

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Change the fit and make the body of it."""
        import scatterers as sc
        from scatterers.fits.cache import DIGEST, load

        signed = rng.random() < 0.5
        if signed:
            content = self._changed(rng)
            data = hashlib.blake2b(content, digest_size=DIGEST).digest() + content
        else:
            data = mutated(self.whole, rng)
        place.mkdir(mode=0o700)
        (place / f"{self.key}.npz").write_bytes(data)
        if not signed:
            # a body would be fitted again
            found = load(place, self.key)
            return Verdict(REFUSED) if found is None else Verdict(SILENT, "a changed fit is taken")
        try:
            with np.errstate(all="ignore"):
                values = sc.Mesh(self.source, "m", cache=place).level(self.points)
        except ValueError as error:
            return Verdict(REFUSED, str(error))
        return Verdict(ACCEPTED, "as fitted" if np.array_equal(values, self.values) else "another, signed anew")

    def _changed(self, rng: Generator) -> bytes:
        from scatterers.fits.cache import DIGEST

        if rng.random() < 0.3:
            return mutated(self.whole[DIGEST:], rng)
        with np.load(io.BytesIO(self.whole[DIGEST:])) as held:
            arrays = {name: held[name] for name in held.files}
        names = sorted(arrays)
        name = names[int(rng.integers(len(names)))]
        if name == "text" or rng.random() < 0.3:
            text = with_odd_leaf(json.loads(arrays["text"].tobytes()), rng)
            arrays["text"] = np.frombuffer(json.dumps(text).encode(), dtype=np.uint8)
        elif rng.random() < 0.1:
            del arrays[name]
        else:
            arrays[name] = shuffled_array(np.atleast_1d(arrays[name]), rng)
        packed = io.BytesIO()
        np.savez(packed, **arrays)
        return packed.getvalue()


class Stores:
    """Stores of sweeps (zarr): what has rotted is computed again on resuming, or refused."""

    def prepare(self, folder: Path) -> None:
        """Make a store of a sweep of six tasks."""
        import creeping as cr
        import scatterers as sc

        self.flow = cr.DirectFlow(sc.Ellipsoid(1.2, 0.8, 0.8), rtol=1e-8)
        self.folder = folder / "sweep.zarr"
        self.known = self._sweep(self.folder)

    def _sweep(self, store: Path, *, resume: bool = False) -> dict[str, Any]:
        import creeping as cr

        found = cr.sweep_directions(
            self.flow, cr.fibonacci_directions(12), wavenumbers=[10.0, 20.0], boundary=["soft", "hard"], length=3.0,
            n_rays=32, chunk=2, store=store, resume=resume,
        )  # fmt: skip
        return {name: np.array(found[name].values) for name in (*found.data_vars, *found.coords)}

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Change a file of the store and resume the sweep."""
        import creeping as cr

        shutil.copytree(self.folder, place)
        what = changed_file(place, rng)
        try:
            found = self._sweep(place, resume=True)
        except cr.CreepingError as error:
            return Verdict(REFUSED, str(error))
        differ = [n for n in self.known if n not in found or not _equal(found[n], self.known[n])]
        return Verdict(SILENT, f"{what}: {', '.join(differ)} differ") if differ else Verdict(ACCEPTED, what)


def _equal(one: Any, other: Any) -> bool:
    return bool(one.shape == other.shape and one.dtype == other.dtype and one.tobytes() == other.tobytes())


def described(data: bytes) -> list[tuple[float, Any]]:
    """Frequency and numbers (n, 6) of each block of FEKO text, in the columns' order.

    Raises
    ------
    UnclearError
        If the text has no one meaning.
    """
    blocks: list[tuple[float, Any]] = []
    keys: dict[str, set[str]] = {}
    rows: list[list[float]] = []
    names: list[str] = []
    lines = re.split("\r\n|\r|\n", data.decode(errors="replace"))
    for line in [*map(str.strip, lines), "#"]:
        if not line or line[:2] in ("##", "**"):
            continue
        if not line.startswith("#"):
            words = line.split()
            if len(words) != len(names) or not names:
                raise UnclearError("another number of columns")
            rows.append([_number(words[names.index(name)]) for name in COLUMNS])
            continue
        if rows:
            counts = [int(_only(keys, f"No. of {angle} Samples")) for angle in ("Theta", "Phi")]
            if counts[0] * counts[1] != len(rows):
                raise UnclearError("another number of rows")
            blocks.append((_number(_only(keys, "Frequency")), np.array(rows)))
            keys, rows, names = {}, [], []
        found = re.match(r'#([^:"]*):(.*)', line)
        if found:
            keys.setdefault(found[1].strip(), set()).add(found[2].strip())
        elif '"' in line:
            names = line.split('"')[1::2]
    return blocks


def _only(keys: dict[str, set[str]], name: str) -> str:
    values = keys.get(name, set())
    if len(values) != 1:
        raise UnclearError(f"{len(values)} values of {name}")
    return next(iter(values))


def _number(text: str) -> float:
    if not text.isascii() or "_" in text or not np.isfinite(float(text)):
        raise UnclearError(f"{text!r} is no number")
    return float(text)


class FarFiles:
    """FEKO text (.ffe)."""

    def prepare(self, folder: Path) -> None:
        """Read the file to begin with."""
        self.seed = seeds.far_field_text()
        assert self._compared(self.seed, folder / "seed.ffe") == ""

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Change the file and read it twice."""
        from creeping import CreepingError

        try:
            mistake = self._compared(mutated(self.seed, rng, text=True), place.with_suffix(".ffe"))
        except CreepingError as error:
            return Verdict(REFUSED, str(error))
        return Verdict(SILENT, mistake) if mistake else Verdict(ACCEPTED)

    def _compared(self, data: bytes, path: Path) -> str:
        from creeping.files import read_ffe

        path.write_bytes(data)
        found = read_ffe(path)
        try:
            expected = described(data)
        except (UnclearError, ValueError) as error:
            return f"{len(found)} blocks of a file that has no meaning: {error}"
        if len(found) != len(expected):
            return f"{len(found)} blocks, not {len(expected)}"
        for block, (frequency, rows) in zip(found, expected, strict=True):
            field = np.stack([rows[:, 2] - 1j * rows[:, 3], rows[:, 4] - 1j * rows[:, 5]], axis=-1)
            same = block.frequency == frequency and np.array_equal(block.field, field)
            if not (same and np.array_equal(np.stack([block.theta, block.phi], axis=-1), rows[:, :2])):
                return "other numbers than those of the file"
        return ""
