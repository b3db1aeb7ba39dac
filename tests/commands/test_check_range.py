"""``creeping check --wavenumber``: whether the field's expansions reach there, on any body."""

import json

import pytest

from creeping.commands import main as cli


def check(capsys, *arguments):
    with pytest.raises(SystemExit) as caught:
        cli.main(["check", *arguments])
    return caught.value.code, capsys.readouterr()


@pytest.mark.parametrize(("wavenumber", "words"), [("15", "within"), ("4", "at the edge of"), ("1", "beyond")])
def test_a_sphere(capsys, wavenumber, words):
    code, said = check(capsys, "sphere:radius=2", "--wavenumber", wavenumber)
    k_rho = 2 * float(wavenumber)
    assert code == 0
    assert f"k = {wavenumber}, on rays of 12 incidences: k rho >= {k_rho:g}, kappa_t rho/m^2 <=" in said.out
    assert words in said.out.splitlines()[-1]


def test_as_json(capsys):
    code, said = check(capsys, "sphere", "--wavenumber", "54", "--json")
    found = json.loads(said.out)["validity"]
    assert (
        code == 0 and found["least_k_rho"] == pytest.approx(54) and found["largest_transverse"] == pytest.approx(1 / 9)
    )


def test_a_weighted_body_has_no_field(capsys):
    code, said = check(capsys, "sphere", "--speed", "1+x/4", "--wavenumber", "54")
    assert code == 3 and "constant speed" in said.err
