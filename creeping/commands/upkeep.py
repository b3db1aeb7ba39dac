"""Commands that look after an installation: stored maps and fitted bodies, and what the machine offers.

Also here: the process that `creeping.kernels.first_use` starts: a small job compiles the kernels that its parent needs
later.

Which these are is nowhere written down: the job is that of most users, on a sphere.
"""

import gc
import json
import os
import re
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from creeping._version import __version__
from creeping.commands import options
from creeping.errors import CreepingError

LIBRARIES = ("numpy", "scipy", "numba", "matplotlib", "pyvista", "vtk", "trimesh")
OPTIONAL = {
    "sympy": "expressions",
    "gmsh": "CAD files; GPL",
    "xarray": "sweeps",
    "zarr": "stored sweeps",
    "dask": "sweeps on clusters",
    "viser": "creeping explore",
}


def versions() -> dict[str, str | None]:
    """Versions of the package, of Python and of the libraries that results depend on, None of what is not there."""
    import platform
    from importlib.metadata import PackageNotFoundError, version

    found: dict[str, str | None] = {"creeping": __version__, "python": platform.python_version()}
    for name in (*LIBRARIES, *OPTIONAL):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    return found


def plain_numbers(text: str) -> str:
    """Text of a body with its hexadecimal floats as decimal ones.

    Examples
    --------
    >>> plain_numbers("Ellipsoid(a=0x1.3333333333333p+0, b=-0x1.999999999999ap-1)")
    'Ellipsoid(a=1.2, b=-0.8)'
    """
    return re.sub(r"-?0x[01]\.?[0-9a-f]*p[+-]?\d+", lambda found: repr(float.fromhex(found[0])), text)


def list_maps(*, json_: options.Json = False) -> int:
    """List the stored maps and fitted bodies."""
    from creeping.phaseflow import cache as caching
    from creeping.storage import folder as storing
    from scatterers.fits import cache as _fit_cache

    # names of the files that fitted bodies were made from, by the names of the fits; of those that know
    loaded = ((file.stem, _fit_cache.load(file.parent, file.stem)) for file in _fits())
    sources = {stem: str(found[1]["source"]) for stem, found in loaded if found and found[1].get("source")}
    rows: list[dict[str, Any]] = []
    for folder in _stored():
        size, rms = sum(f.stat().st_size for f in folder.iterdir()), None
        try:
            content = storing.read_manifest(folder)
            body, rms = plain_numbers(str(content["body"])), content["error"][0]
            # the fit of a file is told by the name of the file
            body = next((f"{name}: {body}" for stem, name in sources.items() if stem in body), body)
        except CreepingError as error:
            body = f"unreadable: {error}"
        rows.append({"map": folder.name, "MB": round(size / 1e6, 1), "body": body, "error": rms})
    fits: list[dict[str, Any]] = [
        {"fit": file.stem, "source": sources.get(file.stem), "MB": round(file.stat().st_size / 1e6, 1)}
        for file in _fits()
    ]
    if json_:
        print(json.dumps([*rows, *fits], indent=1))
    else:
        total = sum(float(r["MB"]) for r in (*rows, *fits))
        kept = f"{len(rows)} maps, {len(fits)} fitted bodies, {total:.1f} MB"
        print(f"{caching.cache_folder()}: {kept}")
        for row in rows:
            print(f"  {row['map']}  {row['MB']:8.1f} MB  {row['body']}")
        for row in fits:
            print(f"  {row['fit']}  {row['MB']:8.1f} MB  {row['source'] or ''}".rstrip())
    return 0


def verify_maps() -> int:
    """Check every stored map and fitted body against its digests; exit code 3 if one is damaged."""
    from creeping.kernels.cache import require_private
    from creeping.storage import folder as storing
    from scatterers.fits import cache as _fit_cache

    damaged = 0
    for folder in _stored():
        try:
            for path in (folder.parent, folder):
                require_private(path)
            storing.verify_files(folder)
            print(f"ok       {folder.name}")
        except (PermissionError, CreepingError) as error:
            damaged += 1
            print(f"DAMAGED  {folder.name}: {error}")
    for file in _fits():
        whole = _fit_cache.load(file.parent, file.stem) is not None
        damaged += not whole
        why = ", or others can write it: it is fitted anew when it is asked for"
        print(f"ok       {file.stem}" if whole else f"DAMAGED  {file.stem}{why}")
    return 3 if damaged else 0


def clear_maps() -> int:
    """Remove every stored map and fitted body; what is not ours, or damaged, is left and named.

    Exit code 3 if anything is left.
    """
    from creeping.storage.folder import remove_folder
    from scatterers.fits import cache as _fit_cache

    folders, files = _stored(), _fits()
    left = [reason for folder in folders if (reason := remove_folder(folder))]
    # by their names, for a damaged one is to go too
    ours = [file for file in files if not file.is_symlink() and _fit_cache.NAME.fullmatch(file.name)]
    left += [f"{file} is no fitted body of ours" for file in files if file not in ours]
    # of processes that were ended while they wrote
    halves = [file for file in _fit_cache.cache_folder().glob(".writing-*") if file.is_file() and not file.is_symlink()]
    for file in (*ours, *halves):
        file.unlink(missing_ok=True)
    maps = len(folders) - sum(1 for folder in folders if folder.exists() or folder.is_symlink())
    print(f"removed {maps} maps, {len(ours)} fitted bodies")
    for reason in left:
        print(f"left: {reason}")
    return 3 if left else 0


def _stored() -> list[Path]:
    from creeping.phaseflow.cache import cache_folder
    from creeping.storage.folder import MANIFEST

    return sorted(path.parent for path in cache_folder().glob(f"*/{MANIFEST}"))


def _fits() -> list[Path]:
    from scatterers.fits import cache as _fit_cache

    return sorted(_fit_cache.cache_folder().glob("*.npz"))


def doctor() -> int:
    """Report versions, compiled kernels, graphics and the cache folder; exit code 3 if something is missing."""
    from creeping.phaseflow.cache import cache_folder
    from creeping.plotting import gl_available

    there = versions()
    print(f"creeping {there.pop('creeping')}, Python {there.pop('python')}, {os.cpu_count()} cores")
    for name, found in there.items():
        needed = f" (needed for {OPTIONAL[name]})" if name in OPTIONAL else ""
        print(f"  {name} {found}" if found else f"  {name} is not installed{needed}")
    started = time.perf_counter()
    import creeping.geodesics.kernels.integrator  # noqa: F401

    print(f"  compiled kernels: import {time.perf_counter() - started:.1f} s")
    probe = gl_available()
    print(f"  3-D graphics: {'pyvista' if probe.ok else f'matplotlib, because {probe.reason}'}")
    root = cache_folder()
    nearest = next(p for p in [root, *root.parents] if p.exists())
    writable = "writable" if os.access(nearest, os.W_OK) else "NOT writable: maps are rebuilt each time"
    print(f"  cache: {root} ({writable})")
    return 3 if any(there[name] is None for name in LIBRARIES) else 0


def main(first: str, folder: str, digest: str) -> None:
    """Compile what a process needs that began with a kernel of the module ``first``; end when standard input does.

    One process at a time does so for a ``folder`` of compiled kernels; it notes there for which sources it is done.
    """
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # there is much of a compiler's, and it does not live long enough to be worth it
    gc.disable()
    from filelock import FileLock, Timeout

    from creeping.kernels.first_use import STAMP, is_done

    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    try:
        with FileLock(place / "ahead.lock", blocking=False):
            if not is_done(place, digest):
                for step in steps(first):
                    step()
                (place / STAMP).write_text(digest)
    except Timeout:
        return


def _end_with_parent() -> None:
    sys.stdin.buffer.read()
    # at once: a thread that compiles does not hear of anything gentler
    os._exit(0)


def steps(first: str) -> list[Callable[[], object]]:
    """Parts of the job, those that the parent comes to last first.

    But for rays: from their line the parent comes to them whatever it does, and not so soon that they would be compiled
    twice.
    """
    import numpy as np

    import creeping as cr
    import scatterers as sc
    from creeping.geodesics.states import pack
    from creeping.shadow.line import shadow_lines

    body = sc.Sphere()
    directions = cr.fibonacci_directions(2)
    waves: dict[str, Any] = {"wavenumbers": [20.0], "boundary": ["hard"]}

    def rays() -> None:
        start = pack(np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]), lanes=12)
        cr.DirectFlow(body).transport(start, np.linspace(0.0, 1.0, 9))

    def lines() -> None:
        shadow_lines(body, np.asarray(directions), 8)

    def sweeps() -> None:
        cr.sweep_directions(cr.DirectFlow(body), directions, **waves)
        cr.sweep_directions(cr.DirectFlow(body), directions, quantity="rays", n_rays=16)

    def one_incidence() -> None:
        fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, directions[0]), wavenumber=20.0, n_rays=16)
        cr.far_field(fan, directions, wavenumber=20.0, boundary="hard")

    def maps() -> None:
        cr.sweep_directions(cr.build_phase_map(body, tolerance=1e-3, cache=False), directions, **waves)

    if first.startswith("creeping.shadow"):
        return [rays, maps, sweeps, one_incidence]
    return [lines, sweeps, one_incidence, maps]
