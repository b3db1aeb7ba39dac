"""Files to begin with: an ellipsoid of 642 vertices in every format of meshes, and what other parts read."""

import io
import json
import struct
import zipfile

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def body_mesh() -> tuple[FloatArray, IntArray]:
    """Vertices and triangles of an ellipsoid, coordinates exact in single precision."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices = (np.asarray(ball.vertices) * (1.1, 1.0, 0.9)).astype(np.float32)
    return vertices.astype(float), np.asarray(ball.faces, dtype=np.int64)


def stl_text() -> bytes:
    """ASCII STL."""
    vertices, triangles = body_mesh()
    lines = ["solid ellipsoid"]
    for corners in vertices[triangles]:
        lines += ["facet normal 0 0 0", " outer loop"]
        lines += [f"  vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners]
        lines += [" endloop", "endfacet"]
    return ("\n".join([*lines, "endsolid ellipsoid"]) + "\n").encode()


def stl_binary() -> bytes:
    """Binary STL."""
    vertices, triangles = body_mesh()
    rows = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["corners"] = vertices[triangles]
    return b"binary".ljust(80, b" ") + struct.pack("<I", len(triangles)) + rows.tobytes()


def obj() -> bytes:
    """Wavefront OBJ."""
    vertices, triangles = body_mesh()
    rows = ["# an ellipsoid", "o ellipsoid"]
    rows += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    rows += [f"f {a} {b} {c}" for a, b, c in triangles + 1]
    return ("\n".join(rows) + "\n").encode()


def off() -> bytes:
    """Object File Format."""
    vertices, triangles = body_mesh()
    rows = ["OFF", f"{len(vertices)} {len(triangles)} 0"]
    rows += [f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    rows += [f"3 {a} {b} {c}" for a, b, c in triangles]
    return ("\n".join(rows) + "\n").encode()


def ply(*, binary: bool) -> bytes:
    """Stanford PLY, in text or little-endian."""
    vertices, triangles = body_mesh()
    kind = "binary_little_endian" if binary else "ascii"
    head = ["ply", f"format {kind} 1.0", "comment an ellipsoid", f"element vertex {len(vertices)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header"]
    if binary:
        faces = np.zeros(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
        faces["count"], faces["corners"] = 3, triangles
        return ("\n".join(head) + "\n").encode() + vertices.astype("<f4").tobytes() + faces.tobytes()
    rows = [f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    rows += [f"3 {a} {b} {c}" for a, b, c in triangles]
    return ("\n".join([*head, *rows]) + "\n").encode()


def glb_parts() -> tuple[dict[str, object], bytes]:
    """JSON and binary part of a GLB file."""
    vertices, triangles = body_mesh()
    places, corners = vertices.astype("<f4").tobytes(), triangles.astype("<u4").tobytes()
    tree: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "ellipsoid"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": triangles.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(places)},
            {"buffer": 0, "byteOffset": len(places), "byteLength": len(corners)},
        ],
        "buffers": [{"byteLength": len(places) + len(corners)}],
    }
    return tree, places + corners


def glb(text: bytes | None = None, binary: bytes | None = None) -> bytes:
    """GLB of its two parts, lengths as they are."""
    tree, held = glb_parts()
    text = json.dumps(tree).encode() if text is None else text
    binary = held if binary is None else binary
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def xml_of_3mf() -> bytes:
    """Model part of a 3MF archive."""
    vertices, triangles = body_mesh()
    rows = ['<?xml version="1.0" encoding="UTF-8"?>']
    rows += ['<model unit="meter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">', "<resources>"]
    rows += ['<object id="1" type="model"><mesh><vertices>']
    rows += [f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in vertices]
    rows += ["</vertices><triangles>"]
    rows += [f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in triangles]
    rows += ["</triangles></mesh></object></resources>"]
    return ("\n".join([*rows, '<build><item objectid="1"/></build></model>']) + "\n").encode()


def archive_3mf(model: bytes | None = None) -> bytes:
    """3MF archive of a model part, the same bytes each time."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        place = zipfile.ZipInfo("3D/3dmodel.model", (2020, 1, 1, 0, 0, 0))
        place.compress_type = zipfile.ZIP_DEFLATED
        archive.writestr(place, xml_of_3mf() if model is None else model)
    return packed.getvalue()


STUDY = b"""\
[study]
name = "seed"
body = "ellipsoid:a=1.2,b=0.8,c=0.8"
quantity = "bistatic"
boundary = ["soft", "hard"]
wavenumbers_per_length = { first = 10.0, last = 40.0, count = 4 }
rays = 64
order = 2
length_in_body_sizes = 3.0

[incidences]
kind = "theta-phi"
theta_deg_min = 0.0
theta_deg_max = 180.0
theta_count = 5
phi_deg_min = 0
phi_deg_max = 360
phi_count = 4

[observation]
kind = "list"
directions = [[0, 0, 1], [1.0, 0.5, 0]]

[flow]
kind = "auto"
tolerance = 1e-6

[run]
output = "sweep.zarr"
chunk = 4
"""


def directions_text() -> bytes:
    """Directions as a table."""
    from creeping import fibonacci_directions

    rows = [",".join(f"{value:.12g}" for value in row) for row in fibonacci_directions(40)]
    return ("x,y,z\n" + "\n".join(rows) + "\n").encode()


def directions_array() -> bytes:
    """Directions as a .npy file."""
    from creeping import fibonacci_directions

    held = io.BytesIO()
    np.save(held, fibonacci_directions(40))
    return held.getvalue()


def far_field_text() -> bytes:
    """Two blocks of a FEKO far field, five polar angles and six azimuths each."""
    lines = ["##File Type: Far field", "##File Format: 3", "** an ellipsoid"]
    for number, name in enumerate(("incident_theta", "incident_phi")):
        lines += [f"#Configuration Name: {name}", f"#Frequency:   {3 + number}.0E+08", "#Coordinate System: Spherical"]
        lines += ["#No. of Theta Samples: 5", "#No. of Phi Samples: 6", "#Incident Wave Direction: (180, 0)"]
        lines += ["#Result Type: RCS", "#No. of Header Lines: 1"]
        names = ("Theta", "Phi", "Re(Etheta)", "Im(Etheta)", "Re(Ephi)", "Im(Ephi)", "RCS(Total)")
        lines.append("#" + "".join(f"{chr(34) + one + chr(34):>18}" for one in names))
        for k in range(30):
            values = (45.0 * (k % 5), 60.0 * (k // 5), *(np.cos(k + c + number) for c in range(4)), 0.1 * k)
            lines.append("".join(f"{value:18.9E}" for value in values))
        lines.append("")
    return "\n".join(lines).encode()
