"""A study of files: what is tried after a refusal, and how far a file comes."""

import numpy as np
import pytest
import trimesh

from studies.accuracy.real_files import followed, named_option


def test_one_option_more_at_a_time():
    refusal = "holds 2 surfaces; take one, e.g. part='largest', or all with union=True"
    once = named_option(refusal, {})
    assert once == {"part": "largest"}
    assert named_option(refusal, once) == {"part": "largest", "union": True}
    assert named_option("too coarse for a departure of 3", once) == once


@pytest.mark.slow
def test_a_file_comes_to_its_far_field(tmp_path):
    """A sphere without a unit, and a file of nothing."""
    trimesh.creation.icosphere(subdivisions=4, radius=0.5).export(tmp_path / "ball.obj")
    first, last = followed(tmp_path / "ball.obj", 300.0)
    assert (first["stage"], first["options"], last["stage"], last["options"]) == ("body", {}, "done", {"units": "m"})
    assert last["error"] < 0.1 * last["field"] and last["unresolved"] == 0 and np.isfinite(last["all s"])
    (tmp_path / "nothing.obj").write_text("")
    last = followed(tmp_path / "nothing.obj", 300.0)[-1]
    assert last["stage"] == "body" and last["refusal"]
