"""Results of a body whose lengths are metres say so, in words, tables and pictures."""

import pytest
import shared_bodies as sc

import creeping as cr
from creeping.files import write_csv
from creeping.plotting import _strokes, coloured_body, line_plots, pages
from creeping.plotting.coloured_body import currents_picture, decay_picture, surface_field_picture


@pytest.fixture(scope="module")
def fan():
    ball = sc.Metric()
    return cr.launch(cr.DirectFlow(ball, rtol=1e-8), cr.shadow_line(ball, (0, 0.6, 0.8)), length=2.0, n_rays=24)


def test_words(fan):
    (curve,) = cr.iso_phase_curves(fan, 1.0)
    assert curve.unit == "m"
    for one in (fan.line, fan.line.curves[0], fan, curve):
        assert " m" in repr(one) and not any(word in repr(one) for word in (" L,", " L)", " L\n", "/L", " L at"))


def test_pictures_say_metres(fan, monkeypatch, tmp_path):
    curves = cr.iso_phase_curves(fan, [0.5, 1.0])
    assert _strokes.LevelColours.of(curves[:1]).label(True) == "travel time = 0.5 m"
    ax = line_plots.plot_line(fan.line, fan=fan, curves=curves)
    labels = [one.get_ylabel() for one in (*ax.figure.axes, *ax.child_axes)]
    assert "iso-phase curves: travel time (m)" in labels
    drawn, said = [], []
    monkeypatch.setattr(pages, "save_figure", lambda figure, *_: drawn.append(figure.axes[0]))
    decay_picture(tmp_path / "a.png", fan, wavenumber=12.0, boundary="hard")
    assert drawn[0].get_xlabel() == "arclength from the shadow line (m)"
    assert drawn[0].get_title() == "Field of single rays, k = 12/m, hard boundary"
    monkeypatch.setattr(coloured_body, "save_painted", lambda *_, label, **__: said.append(label) or "matplotlib")
    asked = {"wavenumber": 12.0, "boundary": "hard", "cells": 12, "backend": "matplotlib"}
    surface_field_picture(tmp_path / "a.png", fan, **asked)
    surface_field_picture(tmp_path / "b.png", fan, wave="38 kHz", **asked)
    currents = cr.surface_currents(fan, wavenumber=12.0, boundary="hard")
    currents_picture(tmp_path / "c.png", currents, cells=12, backend="matplotlib")
    for text, words in zip(said, ("k = 12/m, hard", "38 kHz, hard", "k = 12/m, hard"), strict=True):
        assert text.endswith(words)


def test_tables(fan, tmp_path):
    curves = cr.iso_phase_curves(fan, 1.0)
    for name, given in (("line", {"line": fan.line}), ("fan", {"fan": fan}), ("curves", {"curves": curves})):
        write_csv(tmp_path / f"{name}.csv", **given)
        notes = [row for row in (tmp_path / f"{name}.csv").read_text().splitlines() if row.startswith("#")]
        assert "# x: position, m" in notes and not any(note.endswith(" L") or " L " in note for note in notes)
    assert "# kappa_n: normal curvature along the ray, 1/m, positive where convex" in (
        (tmp_path / "fan.csv").read_text()
    )
