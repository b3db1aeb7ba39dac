"""Pictures show themselves in notebooks under any backend, and open no window."""

import subprocess
import sys

import pytest
from matplotlib import pyplot

PNG = b"\x89PNG\r\n"


@pytest.fixture(scope="module")
def pictures(twisted_fan, twisted_curves, ball_cut, small_map):
    fan = twisted_fan
    return {
        "line": fan.line.plot,
        "curve": twisted_curves[0].plot,
        "far": ball_cut.plot,
        "map": small_map.plot,
        "fan 3d": lambda: fan.plot(kind="3d"),
    }


def size_of(png):
    assert png.startswith(PNG)
    return int.from_bytes(png[16:20]), int.from_bytes(png[20:24])


@pytest.mark.parametrize("name", ["line", "curve", "far", "map", "fan 3d"])
def test_axes_and_figure_answer_as_pictures(pictures, name):
    before = pyplot.get_fignums()
    ax = pictures[name]()
    width, height = size_of(ax._repr_png_())
    assert width == round(6.4 * ax.figure.dpi) and height > 200
    # the layout settles over several drawings: the bytes need not be the same
    assert size_of(ax.figure._repr_png_()) == (width, height)
    assert pyplot.get_fignums() == before


def test_axes_of_pyplot_stay_its_own(twisted_fan):
    figure, ax = pyplot.subplots()
    try:
        assert twisted_fan.plot(ax) is ax and pyplot.gcf() is figure
        # pyplot shows it, once
        assert not hasattr(ax, "_repr_png_")
    finally:
        pyplot.close(figure)


@pytest.mark.slow
def test_a_script_that_plots_imports_no_pyplot():
    code = (
        "import sys, creeping as cr, scatterers as sc;"
        "ax = cr.shadow_line(sc.Sphere(), direction=(0, 0, 1)).plot();"
        "assert ax._repr_png_() and 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
