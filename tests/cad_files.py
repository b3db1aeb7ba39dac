"""CAD files for tests, made by gmsh: it keeps its state in the library, hence a process of its own."""

import subprocess
import sys
from pathlib import Path

START = """
import os, sys, gmsh
os.chdir(sys.argv[1])
gmsh.initialize(readConfigFiles=False, interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
make = gmsh.model.occ
def write(*names):
    make.synchronize()
    for name in names:
        gmsh.write(name)
    gmsh.model.remove()
    gmsh.model.add("next")
"""


def made(folder: Path, script: str) -> Path:
    """Run a script that builds solids with ``make`` and puts them into files of the folder with ``write(name)``."""
    done = subprocess.run(
        [sys.executable, "-c", START + script, str(folder)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder


def write_ellipsoid(path: Path) -> None:
    """STEP file of the ellipsoid 1.2, 0.8, 0.8 m."""
    solid = "s = make.addSphere(0, 0, 0, 1000); make.dilate([(3, s)], 0, 0, 0, 1.2, 0.8, 0.8)"
    made(path.parent, f"{solid}; write({path.name!r})")
