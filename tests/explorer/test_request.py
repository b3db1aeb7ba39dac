"""What the page may be asked, and the queue that keeps the latest of it."""

import threading
import time

import numpy as np
import pytest

from creeping import InvalidInputError
from creeping.explorer.page import Latest
from creeping.explorer.request import ViewRequest, angles

GOOD = {"theta": 30.0, "phi": -120.0, "rays": 64, "length": 2.0, "spacing": 0.25, "wavenumber": 30.0}
GOOD["boundary"] = "hard"


@pytest.mark.parametrize("theta, phi", [(0.0, 0.0), (30.0, -120.0), (90.0, 180.0), (180.0, 0.0)])
def test_angles_come_back(theta, phi):
    request = ViewRequest(**(GOOD | {"theta": theta, "phi": phi}))
    assert np.linalg.norm(request.direction) == pytest.approx(1.0)
    assert angles(request.direction)[0] == pytest.approx(theta, abs=1e-9)
    if 0 < theta < 180:
        assert angles(request.direction)[1] == pytest.approx(phi)


def test_levels_end_with_the_rays():
    np.testing.assert_allclose(ViewRequest(**GOOD).levels, 0.25 * np.arange(1, 9))
    assert len(ViewRequest(**(GOOD | {"spacing": 0.0})).levels) == 0


BAD = {"theta": [float("nan"), True], "phi": [float("inf")], "rays": [15, 2000], "length": [0.0], "wavenumber": [0.0]}
BAD |= {"spacing": [-0.1, 1e-4], "boundary": ["impedance:x"], "sound_speed": [1500.0], "cut": [float("nan")]}


@pytest.mark.parametrize("name, value", [(name, value) for name, values in BAD.items() for value in values])
def test_what_is_out_of_range_is_refused_by_name(name, value):
    with pytest.raises(InvalidInputError, match=name):
        ViewRequest(**(GOOD | {name: value}))


def test_only_the_newest_is_taken():
    queue = Latest()
    for value in range(5):
        queue.put(value)
    assert queue.take() == (4, 5)
    taken = []
    reader = threading.Thread(target=lambda: taken.append(queue.take()))
    reader.start()
    time.sleep(0.05)
    assert taken == []
    queue.put("late")
    reader.join(5)
    assert taken == [("late", 6)] and queue.number == 6
    queue.close()
    assert queue.take() is None
