"""VTK XML PolyData of polylines, written without VTK: arrays inline, base64, little-endian, with 64-bit headers.

Binary and not ascii, because VTK's reader stops at an ascii nan; a binary array begins with its length in bytes.
"""

import base64
from collections.abc import Mapping, Sequence
from xml.sax.saxutils import quoteattr

import numpy as np

from creeping._typing import Any, FloatArray, IntArray

_TYPES = {"f": ("Float64", "<f8"), "i": ("Int64", "<i8")}


def document(
    points: FloatArray,
    polylines: Sequence[IntArray],
    point_data: Mapping[str, Any],
    cell_data: Mapping[str, Any],
) -> str:
    """Text of a .vtp file.

    Parameters
    ----------
    points : (n, 3), L
    polylines : sequence of (k,)
        Point numbers of each line.
    point_data, cell_data : mapping
        Arrays (n,) or (n, c) by name, one entry per point or per polyline.
    """
    lengths = np.array([len(line) for line in polylines], dtype=np.int64)
    connectivity = np.concatenate([np.zeros(0, dtype=np.int64), *polylines])
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        "<PolyData>",
        f'<Piece NumberOfPoints="{len(points)}" NumberOfVerts="0" NumberOfLines="{len(lengths)}" '
        'NumberOfStrips="0" NumberOfPolys="0">',
        "<PointData>",
        *(_array(name, values) for name, values in point_data.items()),
        "</PointData>",
        "<CellData>",
        *(_array(name, values) for name, values in cell_data.items()),
        "</CellData>",
        "<Points>",
        _array("Points", points),
        "</Points>",
        "<Lines>",
        _array("connectivity", connectivity),
        _array("offsets", np.cumsum(lengths)),
        "</Lines>",
        "</Piece>",
        "</PolyData>",
        "</VTKFile>",
    ]
    return "\n".join(lines) + "\n"


def _array(name: str, values: Any) -> str:
    values = np.asarray(values)
    kind, dtype = _TYPES["f" if values.dtype.kind == "f" else "i"]
    data = np.ascontiguousarray(values, dtype=dtype).tobytes()
    text = base64.b64encode(np.array([len(data)], dtype="<u8").tobytes() + data).decode("ascii")
    components = values.shape[1] if values.ndim == 2 else 1
    head = f'<DataArray type="{kind}" Name={quoteattr(name)} NumberOfComponents="{components}" format="binary">'
    return f"{head}{text}</DataArray>"
