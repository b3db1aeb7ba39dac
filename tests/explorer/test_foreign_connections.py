"""Bursts of connections from elsewhere, messages before, with and after the upgrade: the fuzzing study in small."""

import pytest

pytest.importorskip("viser")


def test_foreign_connections_change_nothing(tmp_path):
    from studies.fuzz.attack import REFUSED, generator
    from studies.fuzz.origins import BURST, Origins

    attack = Origins()
    # here it is seen that the page's own messages do turn the incidence
    attack.prepare(tmp_path)
    try:
        for number in range(6):
            verdict = attack.attempt(number, generator("origin", 1, number), tmp_path / "case")
            assert (verdict.kind, verdict.words) == (REFUSED, f"{BURST} connections")
    finally:
        attack.page.close()
