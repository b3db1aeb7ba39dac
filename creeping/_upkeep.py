"""Commands that look after an installation: stored maps, and what the machine offers."""

import json
import time
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from creeping._version import __version__

Json = Annotated[bool, Parameter(name="--json", negative="", help="Print as JSON.")]


def list_maps(*, json_: Json = False) -> int:
    """List the stored maps."""
    from creeping._errors import CreepingError
    from creeping.phaseflow import caching, storing

    rows = []
    for folder in _stored():
        size = sum(f.stat().st_size for f in folder.iterdir())
        try:
            content = storing.read_manifest(folder)
            rows.append(
                {"map": folder.name, "MB": round(size / 1e6, 1), "body": content["body"], "error": content["error"][0]}
            )
        except CreepingError as error:
            rows.append({"map": folder.name, "MB": round(size / 1e6, 1), "body": f"unreadable: {error}", "error": None})
    if json_:
        print(json.dumps(rows, indent=1))
    else:
        print(f"{caching.cache_folder()}: {len(rows)} maps, {sum(r['MB'] for r in rows):.1f} MB")
        for row in rows:
            print(f"  {row['map']}  {row['MB']:8.1f} MB  {row['body']}")
    return 0


def verify_maps() -> int:
    """Check every stored map against its digests; exit code 3 if one is damaged."""
    from creeping._errors import CreepingError
    from creeping.phaseflow import storing

    damaged = 0
    for folder in _stored():
        try:
            storing.verify_files(folder)
            print(f"ok       {folder.name}")
        except CreepingError as error:
            damaged += 1
            print(f"DAMAGED  {folder.name}: {error}")
    return 3 if damaged else 0


def clear_maps() -> int:
    """Remove every stored map."""
    import shutil

    folders = _stored()
    for folder in folders:
        shutil.rmtree(folder)
    print(f"removed {len(folders)} maps")
    return 0


def _stored() -> list[Path]:
    from creeping.phaseflow import caching, storing

    root = caching.cache_folder()
    return sorted(p.parent for p in root.glob(f"*/{storing.MANIFEST}")) if root.is_dir() else []


def doctor() -> int:
    """Report versions, compiled kernels, graphics and the cache folder; exit code 3 if something is missing."""
    import os
    import platform
    from importlib.metadata import PackageNotFoundError, version

    from creeping.phaseflow.caching import cache_folder
    from creeping.plotting import gl_available

    print(f"creeping {__version__}, Python {platform.python_version()}, {os.cpu_count()} cores")
    missing = 0
    for name in ("numpy", "scipy", "numba", "matplotlib", "pyvista", "vtk", "sympy"):
        try:
            print(f"  {name} {version(name)}")
        except PackageNotFoundError:
            missing += name != "sympy"
            print(f"  {name} is not installed" + (" (needed for expressions)" if name == "sympy" else ""))
    started = time.perf_counter()
    import creeping.phaseflow._integrator  # noqa: F401

    print(f"  compiled kernels: import {time.perf_counter() - started:.1f} s")
    probe = gl_available()
    print(f"  3-D graphics: {'pyvista' if probe.ok else f'matplotlib, because {probe.reason}'}")
    root = cache_folder()
    nearest = next(p for p in [root, *root.parents] if p.exists())
    print(
        f"  cache: {root} ({'writable' if os.access(nearest, os.W_OK) else 'NOT writable: maps are rebuilt each time'})"
    )
    return 3 if missing else 0
