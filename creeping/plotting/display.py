"""Can this machine draw with OpenGL? Asked once, in a process of its own.

A missing libX11, libEGL or Mesa vendor file does not raise in VTK, it ends the process with a segmentation fault.
Hence the question is put to a subprocess, and VTK is imported here only after it has come back with a picture.
"""

import hashlib
import json
import os
import platform
import subprocess
import sys
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from creeping.storage.reading import bytes_of

REMEDY = "on Debian or Ubuntu install libegl1 libgl1-mesa-dri libx11-6"
TIMEOUT = 60.0
LIBRARIES = ("/usr/lib", "/usr/lib64", f"/usr/lib/{platform.machine()}-linux-gnu", "/usr/share/glvnd")
"""Folders of the libraries that a picture needs."""
_SCRIPT = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(16, 16))
plotter.add_mesh(pyvista.Sphere(), color="red")
image = plotter.screenshot(return_img=True)
plotter.close()
raise SystemExit(0 if image.max() > image.min() else 3)
"""


@dataclass(frozen=True)
class GLProbe:
    """Verdict on off-screen OpenGL.

    Attributes
    ----------
    ok : bool
        Whether pyvista can render here.
    reason : str
        Why not, and what would help; "rendered" if it can.
    """

    ok: bool
    reason: str


def gl_available() -> GLProbe:
    """Whether pyvista can render on this machine, without risking this process.

    The verdict is kept in memory and in the user's cache folder, for this interpreter, machine, VTK, display and set
    of installed libraries. ``CREEPING_NO_GL=1`` in the environment says no without asking.

    Returns
    -------
    GLProbe
    """
    if os.environ.get("CREEPING_NO_GL", "") not in ("", "0"):
        return GLProbe(False, "CREEPING_NO_GL is set; unset it to draw with pyvista")
    return _verdict(_key())


@cache
def _verdict(key: str) -> GLProbe:
    stored = _stored(key)
    if stored is not None:
        return stored
    probe, final = _probe()
    if final:
        _store(key, probe)
    return probe


def _probe() -> tuple[GLProbe, bool]:
    """Render in a subprocess; the second value is False where the verdict may be different next time."""
    try:
        # no terminal, and its messages kept: VTK warns about a missing X server even where EGL then succeeds
        done = subprocess.run(
            [sys.executable, "-c", _SCRIPT], capture_output=True, stdin=subprocess.DEVNULL, timeout=TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        return GLProbe(False, f"the trial rendering took more than {TIMEOUT:.0f} s"), False
    except OSError as error:
        return GLProbe(False, f"the trial rendering could not start ({error})"), False
    if done.returncode == 0:
        return GLProbe(True, "rendered"), True
    if done.returncode == 3:
        return GLProbe(False, f"the trial rendering was blank; {REMEDY}"), True
    if done.returncode < 0:
        return GLProbe(False, f"the trial rendering ended with signal {-done.returncode}; {REMEDY}"), True
    last = done.stderr.decode(errors="replace").strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
    return GLProbe(False, f"the trial rendering failed ({last[0][:200]}); {REMEDY}"), True


def _key() -> str:
    """Everything the verdict hangs on.

    The time of the linker's cache changes whenever a library is installed or removed; sizes of the libraries tell a
    container that hides them. The machine's name keeps apart the nodes that share one home folder.
    """
    prefixes = ("PYVISTA", "VTK_", "LIBGL_", "EGL_", "MESA_", "__GLX", "__EGL")
    names = ("DISPLAY", "WAYLAND_DISPLAY", "LD_LIBRARY_PATH")
    surroundings = sorted(item for item in os.environ.items() if item[0] in names or item[0].startswith(prefixes))
    try:
        libraries = os.stat("/etc/ld.so.cache").st_mtime_ns
    except OSError:
        libraries = 0
    found = sorted(
        (str(file), file.stat().st_size)
        for root in LIBRARIES
        for name in ("libX11.so*", "libEGL*.so*", "libGL*.so*", "libOpenGL.so*", "libgallium*.so*", "egl_vendor.d/*")
        for file in Path(root).glob(name)
        if file.is_file()
    )
    parts = [sys.executable, platform.node(), _version("vtk"), _version("pyvista"), libraries, found, surroundings]
    return hashlib.blake2b(json.dumps(parts).encode(), digest_size=16).hexdigest()


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def _cache_file() -> Path:
    from platformdirs import user_cache_dir

    return Path(user_cache_dir("creeping")) / "gl.json"


def _read() -> dict[str, object]:
    """All stored verdicts; a damaged file counts as an empty one."""
    try:
        content = json.loads(bytes_of(_cache_file(), 10**6))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _stored(key: str) -> GLProbe | None:
    entry = _read().get(key)
    if isinstance(entry, dict) and isinstance(entry.get("ok"), bool) and isinstance(entry.get("reason"), str):
        return GLProbe(entry["ok"], entry["reason"])
    return None


def _store(key: str, probe: GLProbe) -> None:
    """Keep the verdict; an unwritable cache folder only means that the next run asks again."""
    file = _cache_file()
    # the newest few: every new library or display adds a key
    verdicts = dict(list(_read().items())[-15:]) | {key: asdict(probe)}
    aside = file.with_name(f"{file.name}.{os.getpid()}")
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        aside.write_text(json.dumps(verdicts, indent=1), encoding="utf-8")
        os.replace(aside, file)
