"""CAD files for tests, made by gmsh: it keeps its state in the library, hence a process of its own."""

import subprocess
import sys

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


def made(folder, script):
    """Run a script that builds solids with ``make`` and puts them into files of the folder with ``write(name)``."""
    done = subprocess.run(
        [sys.executable, "-c", START + script, str(folder)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return folder
