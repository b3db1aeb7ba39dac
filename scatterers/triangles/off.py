"""Faces of OFF files as triangles: trimesh reads those of three and four corners alone.

A face of n corners becomes n - 2 triangles about its first one, as in OBJ files.
"""

MOST_CORNERS = 4


def with_triangles(data: bytes, most: int) -> bytes:
    r"""The same file with its larger faces as triangles; as it is if it has none.

    Its rows are those that its header states, as `scatterers.triangles.form.check_whole` has made sure.

    Raises
    ------
    ValueError
        If it has more than ``most`` triangles then.

    Examples
    --------
    >>> pentagon = b"OFF\n5 1 0\n" + b"0 0 0\n" * 5 + b"5 0 1 2 3 4\n"
    >>> with_triangles(pentagon, 100).splitlines()[-3:]
    [b'3 0 1 2', b'3 0 2 3', b'3 0 3 4']
    """
    lines = [line for line in (raw.partition(b"#")[0].split() for raw in data.splitlines()) if line]
    begin = 1 if lines and len(lines[0]) > 1 else 2
    counts = [word for line in lines[:begin] for word in line if word.isdigit()]
    if len(counts) < 2:
        return data
    vertices, faces = int(counts[0]), int(counts[1])
    rows = lines[begin + vertices : begin + vertices + faces]
    corners = [int(row[0]) if row[0].isdigit() else 0 for row in rows]
    if max(corners, default=0) <= MOST_CORNERS:
        return data
    whole = sum(max(n - 2, 0) for n in corners)
    if whole > most:
        raise ValueError(f"its faces are {whole} triangles, more than {most}")
    split = [
        [b"3", row[1], *row[k : k + 2]] for row, n in zip(rows, corners, strict=True) for k in range(2, n) if n > 2
    ]
    first = lines[0][0] if begin == 2 or not lines[0][0].isdigit() else b"OFF"
    header = [[first], [str(vertices).encode(), str(len(split)).encode(), b"0"]]
    return b"\n".join(b" ".join(row) for row in [*header, *lines[begin : begin + vertices], *split]) + b"\n"
