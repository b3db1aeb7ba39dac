"""Units that STEP and IGES files state."""

import pytest

from scatterers.triangles import cad_file as _cad_files


@pytest.mark.parametrize(
    "head, unit",
    [
        ("SI_UNIT ( .CENTI. ,\n .METRE. )", "cm"),
        ("CONVERSION_BASED_UNIT('INCH',#7)", "in"),
        ("CONVERSION_BASED_UNIT ( 'Foot' , #7 )", "ft"),
        ("SI_UNIT(.NANO.,.METRE.)", None),
        ("", None),
    ],
)
def test_units_of_step_files(tmp_path, head, unit):
    (tmp_path / "a.step").write_text(f"ISO-10303-21;\n{head}")
    assert _cad_files._stated(tmp_path / "a.step", "STEP") == unit


@pytest.mark.parametrize("flag, unit", [(1, "in"), (2, "mm"), (6, "m"), (3, None)])
def test_units_of_iges_files(tmp_path, flag, unit):
    # the names hold commas and an H, which do not separate
    text = f"1H,,1H;,4HPart,9Ha,b;c,5Hd,5Hmaker,1H1,32,38,6,308,15,4HPart,1.,{flag},2HMM,1,0.01;"
    lines = [f"{text[k : k + 72]:72}G{k // 72 + 1:7}" for k in range(0, len(text), 72)]
    (tmp_path / "a.igs").write_text("\n".join([f"{'':72}S      1", *lines]))
    assert _cad_files.kind_of(tmp_path / "a.igs") == "IGES"
    assert _cad_files._stated(tmp_path / "a.igs", "IGES") == unit
