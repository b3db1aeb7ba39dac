"""``creeping check``: what is right and wrong with a body, before anything is traced. Part of the command line."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from creeping.commands import options
from creeping.commands.options import CAD, MESHES, is_file, parse_body
from creeping.errors import CreepingError, InvalidInputError

Output = Annotated[
    Path | None, Parameter(name=["-o", "--output"], help="Folder for quality.png, a file's mesh where it is rough.")
]


def check(
    body: options.Body,
    *,
    speed: options.SpeedOption = None,
    file: options.FileOptions = options.AS_IT_IS,
    wave: options.WaveOptions = options.NO_WAVE,
    output: Output = None,
    json_: options.Json = False,
) -> int:
    """Verify a body: derivatives, closedness, orientation, cover and overlap of its charts; of a file its quality too.

    With a wave also whether the field's expansions reach there, and a file's size in wavelengths. Exit code 3 if
    something is wrong.
    """
    wavenumber: float | None = None
    asked: dict[str, Any] = {}
    if wave != options.NO_WAVE:
        from creeping.commands.forecast import asked_wavenumber

        wavenumber, hertz, cure = asked_wavenumber(wave)
        asked = {"metres": hertz is not None, "cure": cure}
    mesh = is_file(body) and Path(body).suffix.lower() not in CAD
    if wavenumber is not None and speed is not None:
        raise InvalidInputError("--wavenumber is for rays of constant speed; leave out one of --speed and --wavenumber")
    answer: dict[str, Any] = {}
    texts: list[str] = []
    if output is not None and not mesh:
        # the rest of the check is worth having
        texts.append(f"no picture: quality.png is drawn of meshes ({', '.join(MESHES)}); {body!r} is none")
        output = None
    shape, refusal = None, None
    try:
        shape = parse_body(body, speed, options=file)
    except InvalidInputError as error:
        # an option of CAD files says nothing of a mesh
        if not mesh or file.sew is not None:
            raise
        refusal = error
    if refusal is not None or output is not None:
        # what is known of a mesh that can be read is worth more than the refusal alone
        found, told = _mesh(body, file, wavenumber, output)
        answer |= found
        texts += told
    if shape is None:
        ok, answer["refused"] = False, str(refusal)
        texts.append(f"refused: {refusal}")
    else:
        ok = _surface(shape, wavenumber, answer, texts, asked)
    answer["ok"] = ok
    print(json.dumps(answer, indent=1) if json_ else "\n".join(texts))
    return 0 if ok else 3


def _surface(
    shape: Any, wavenumber: float | None, answer: dict[str, Any], texts: list[str], asked: dict[str, Any]
) -> bool:
    """Whether nothing is wrong with a surface; adds how its field is made, its checks, its fit and its range."""
    from creeping import check_surface
    from creeping.commands.forecast import forecast
    from creeping.field.arguments import wavelengths_across
    from creeping.geometry.surface import why_no_rays

    if getattr(shape, "speed", None) is None:
        # of a body six wavelengths across where no wavenumber is given
        k = wavenumber or 6.0 / wavelengths_across(shape, 1.0)
        told, conductor = (forecast(shape, k, boundary, **asked) for boundary in ("hard", "pec"))
        answer["field"] = {"body": told.body, "wavenumber": k, "nodes": told.nodes, "by": told.by}
        answer["field"]["conductor"] = {"nodes": conductor.nodes, "by": conductor.by}
        texts[:0] = [
            told.body,
            f"far field at k = {k:.4g}, rigid: {told.by}",
            f"far field at k = {k:.4g}, perfect conductor: {conductor.by}",
        ]
    if why_no_rays(shape):
        answer["repairs"] = list(getattr(shape, "repairs", ()))
        texts += answer["repairs"]
        return True
    report = check_surface(shape)
    rows = [asdict(c) | {"ok": c.ok} for c in report.checks]
    answer |= {"genus": report.genus, "area": report.area, "checks": rows}
    if report.creases:
        creases = [{"kind": c.kind, "pieces": [int(number) for number in c.pieces]} for c in report.creases]
        answer |= {"pieces": report.pieces, "creases": creases}
    if getattr(shape, "fit", None) is not None:
        known = "quality" in answer
        answer |= {"fit": shape.fit.to_json(), "quality": shape.quality.to_json(), "repairs": list(shape.repairs)}
        if not known:
            judged = shape.quality.summary(wavenumber)
            if report.creases and shape.quality.verdict not in ("smooth", "noisy"):
                judged = f"one smooth surface through its vertices, which is not taken, would be:\n{judged}"
            texts += [*shape.repairs, judged]
        texts.append(str(shape.fit))
    texts.append(str(report))
    if wavenumber is not None:
        _range(shape, wavenumber, answer, texts)
    return report.ok


def _range(shape: Any, wavenumber: float, answer: dict[str, Any], texts: list[str]) -> None:
    """Whether the field's expansions hold, on rays of evenly spread incidences."""
    from math import isfinite

    from creeping.field.validity_range import body_validity, validity_words
    from creeping.rays.reach import INCIDENCES

    try:
        found = body_validity(shape, wavenumber=wavenumber)
    except CreepingError as error:
        # of the check the rest stands
        answer["validity"] = None
        texts.append(f"k = {wavenumber:g}: k rho is not told: {error}")
        return
    answer["validity"] = {name: value if isfinite(value) else None for name, value in found._asdict().items()}
    if isfinite(found.least_k_rho):
        texts.append(f"k = {wavenumber:g}, on rays of {INCIDENCES} incidences: {validity_words(found)}")
    else:
        texts.append(f"k = {wavenumber:g}: none of {INCIDENCES} incidences launches a creeping ray")


def _mesh(
    body: str, file: options.FileOptions, wavenumber: float | None, output: Path | None
) -> tuple[dict[str, Any], list[str]]:
    """The quality of a mesh as it is in the file, and its picture; also of one that cannot be fitted."""
    from scatterers import examined_mesh

    try:
        mesh, quality = examined_mesh(body, **{k: v for k, v in file.given().items() if k not in ("strict", "surface")})
    except (ValueError, ModuleNotFoundError) as error:
        raise InvalidInputError(f"{body}: {error}") from error
    answer = {"quality": quality.to_json(), "repairs": list(mesh.repairs)}
    texts = [*mesh.repairs, quality.summary(wavenumber)]
    if output is None:
        return answer, texts
    from creeping.commands.resuming import make_folder
    from creeping.plotting.pictures import MeshValues, mesh_picture

    make_folder(output)
    shown = MeshValues(mesh.vertices, mesh.triangles, quality.badness, quality.bad, Path(body).name)
    mesh_picture(output / "quality.png", shown)
    answer["picture"] = str(output / "quality.png")
    return answer, [*texts, f"picture: {output / 'quality.png'}"]
