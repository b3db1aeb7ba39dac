"""Faces of OFF files as triangles: trimesh reads those of three and four corners alone.

A face of n corners becomes n - 2 triangles about one of them from which all of it is seen.
"""

import numpy as np
from numpy.typing import NDArray

MOST_CORNERS = 4


def with_triangles(data: bytes, most: int) -> bytes:
    r"""The same file with its larger faces as triangles; as it is if it has none, or is no OFF file.

    Its rows are those that its header states, as `scatterers.triangles.form.check_whole` has made sure.

    Raises
    ------
    ValueError
        If it has more than ``most`` triangles then, or a larger face that is no fan about a corner.

    Examples
    --------
    >>> pentagon = b"OFF\n5 1 0\n0 0 0\n2 0 0\n3 1 0\n2 2 0\n0 2 0\n5 0 1 2 3 4\n"
    >>> with_triangles(pentagon, 100).splitlines()[-3:]
    [b'3 0 1 2', b'3 0 2 3', b'3 0 3 4']
    """
    lines = [line for line in (raw.partition(b"#")[0].split() for raw in data.splitlines()) if line]
    begin = 1 if lines and len(lines[0]) > 1 else 2
    header = [word for line in lines[:begin] for word in line]
    if len(header) < 3 or not header[0].endswith(b"OFF") or not (header[1] + header[2]).isdigit():
        return data
    vertices, faces = int(header[1]), int(header[2])
    rows = lines[begin + vertices : begin + vertices + faces]
    corners = [int(row[0]) if row[0].isdigit() else 0 for row in rows]
    if max(corners, default=0) <= MOST_CORNERS:
        return data
    whole = sum(max(n - 2, 0) for n in corners)
    if whole > most:
        raise ValueError(f"its faces are {whole} triangles, more than {most}")
    points = np.array([row[:3] for row in lines[begin : begin + vertices]], dtype=float)
    split: list[list[bytes]] = []
    for number, (row, n) in enumerate(zip(rows, corners, strict=True)):
        face = row[1 : n + 1]
        if n > MOST_CORNERS:
            face = _turned(face, points, number)
        split += [[b"3", face[0], *face[k : k + 2]] for k in range(1, n - 1)]
    states = [[header[0]], [str(vertices).encode(), str(len(split)).encode(), b"0"]]
    return b"\n".join(b" ".join(row) for row in [*states, *lines[begin : begin + vertices], *split]) + b"\n"


def _turned(face: list[bytes], points: NDArray[np.float64], number: int) -> list[bytes]:
    """The corners of a face, begun with one about which no triangle is turned over."""
    places = np.array([int(word) for word in face])
    if places.max() >= len(points):
        raise ValueError(f"face {number} refers to vertex {places.max()} of {len(points)}")
    for first in range(len(face)):
        away = np.roll(points[places], -first, axis=0) - points[places[first]]
        areas = np.cross(away[1:-1], away[2:])
        if np.all(areas @ areas.sum(axis=0) >= 0):
            return face[first:] + face[:first]
    raise ValueError(f"face {number} of {len(face)} corners is no fan about any of them; triangulate the mesh")
