"""``creeping check --wavenumber``: whether the field's expansions reach there, on any body."""

import json

import pytest
from command_line import ran


def check(capsys, *arguments):
    return ran("check", *arguments), capsys.readouterr()


@pytest.mark.parametrize(("wavenumber", "words"), [("15", "within"), ("4", "at the edge of"), ("1", "beyond")])
def test_a_sphere(capsys, wavenumber, words):
    code, said = check(capsys, "sphere:radius=2", "--wavenumber", wavenumber)
    k_rho = 2 * float(wavenumber)
    assert code == 0
    assert f"k = {wavenumber}, on rays of 12 incidences: k rho >= {k_rho:g}, kappa_t rho/m^2 <=" in said.out
    assert words in said.out.splitlines()[-1]


def test_a_weighted_body_has_no_field(capsys):
    code, said = check(capsys, "sphere", "--speed", "1+x/4", "--wavenumber", "54")
    assert code == 3 and "constant speed" in said.err
    code, said = check(capsys, "sphere", "--wavenumber", "54", "--json")
    found = json.loads(said.out)["validity"]
    assert code == 0 and found["least_k_rho"] == pytest.approx(54)


def test_by_frequency(capsys):
    code, said = check(capsys, "sphere:radius=0.15", "--frequency", "10GHz")
    # k a of light at 10 GHz
    assert code == 0 and "k = 209.585, on rays of 12 incidences: k rho >= 31.4" in said.out
    code, said = check(capsys, "sphere", "--frequency", "10GHz", "--wavenumber", "3")
    assert code == 3 and "give one of" in said.err


def test_a_folder_for_what_is_no_mesh_is_told_of(tmp_path, capsys):
    code, said = check(capsys, "sphere", "-o", str(tmp_path / "out"))
    assert code == 0 and "no picture: quality.png is drawn of meshes" in said.out and "genus 0" in said.out
    assert not (tmp_path / "out").exists()
