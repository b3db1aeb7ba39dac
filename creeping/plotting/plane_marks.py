"""What stands on pictures of the field on a plane: the body's section, the shadow line, axes, what is not known.

Hatched is what is not OK, dotted where the field is less than its error.
"""

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray
from creeping.field.cut_result import FieldCut, grid_points, status_words
from creeping.field.point_result import FieldStatus
from creeping.plotting.coloured_body import NOTHING

FRONT = "#ffffff"
"""Colour of wave fronts."""

SECTION = "#5a6872"
"""Colour of the body's section."""
HATCH, HATCHED = "///", "#6d767d"
DOUBTFUL = "#a3476a", "#ffffff"
"""Colours in the legend of what is hatched upon the colours of the field."""
DOTS, DOTTED = "....", "#9db4c2"
OUTLINE = 400
"""Points along the longer side by which the body's section is drawn."""
_CENTRE: dict[str, Any] = {"ha": "center", "va": "center"}


def missing_of(cut: FieldCut) -> BoolArray:
    """Where most of the field is missing: neither OK nor merely of a large error."""
    kept = (FieldStatus.OK, FieldStatus.UNRESOLVED)
    return np.asarray(cut.outside & ~np.isin(cut.status, kept))


def below_error(cut: FieldCut, size: FloatArray) -> BoolArray:
    """Where the field is OK, and less than its error."""
    with np.errstate(invalid="ignore"):
        return np.asarray((cut.status == FieldStatus.OK) & (size < cut.error))


def hatch(cut: FieldCut, ax: Any, size: FloatArray | None) -> None:
    """Hatch what is not OK, and dot what is below its error if the size is given."""
    missing = missing_of(cut)
    doubtful = cut.outside & ~missing & (cut.status != FieldStatus.OK)
    marks = [(missing, HATCH, HATCHED), (doubtful, HATCH, DOUBTFUL[1])]
    if size is not None:
        marks.append((below_error(cut, size), DOTS, DOTTED))
    for where, pattern, colour in marks:
        if not np.any(where):
            continue
        # the colour of hatches is that of edges
        filled = ax.contourf(
            cut.across, cut.up, where.astype(float), [0.5, 1.5], colors="none", hatches=[pattern], zorder=1.5
        )
        filled.set_edgecolor(colour)
        filled.set_linewidth(0.0)


def dress(cut: FieldCut, ax: Any) -> None:
    """Section of the body, shadow line, direction of the wave and axes."""
    from matplotlib.patheffects import withStroke

    share = max(1, int(np.ceil(OUTLINE / max(cut.outside.shape))))
    across, up = (np.linspace(one[0], one[-1], share * (len(one) - 1) + 1) for one in (cut.across, cut.up))
    points = grid_points(cut.point, cut.axes, across, up)
    level = np.nan_to_num(cut.body.level(points.reshape(-1, 3)).reshape(points.shape[:2]), nan=-1.0)
    if level.min() < 0 < level.max():
        ax.contourf(across, up, level, [level.min() - 1.0, 0.0], colors=SECTION, zorder=2)
        ax.contour(across, up, level, [0.0], colors="#111111", linewidths=0.8, zorder=2.1)
    ax.plot(*cut.shadow_points().T, "o", color="#111111", markeredgecolor="#ffffff", markersize=5, zorder=3)
    along = cut.axes @ cut.line.direction
    if np.hypot(*along) > 0.2:
        middle = np.array([0.14, 0.9])
        box = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
        ax.annotate(
            "d", middle - 0.085 * along, xycoords="axes fraction", fontsize=9, weight="bold", bbox=box, **_CENTRE
        )
        arrow = {"arrowstyle": "-|>", "color": "#111111", "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
        arrow["path_effects"] = [withStroke(linewidth=3.2, foreground="#ffffff")]
        ends = middle + 0.08 * along, middle - 0.05 * along
        ax.annotate("", *ends, xycoords="axes fraction", textcoords="axes fraction", arrowprops=arrow)
    ax.set_aspect("equal")
    ax.set_xlim(cut.across[0], cut.across[-1])
    ax.set_ylim(cut.up[0], cut.up[-1])
    ax.set_xlabel(_axis(cut, 0) + _place(cut), fontsize=9)
    ax.set_ylabel(_axis(cut, 1), fontsize=9)
    ax.tick_params(labelsize=8, width=0.5)


def _axis(cut: FieldCut, number: int) -> str:
    axis, unit = cut.axes[number], cut.field.length_unit
    place = int(np.argmax(np.abs(axis)))
    if abs(axis[place]) > 1 - 1e-9:
        offset = cut.point[place]
        name = f"{'-' if axis[place] < 0 else ''}{'xyz'[place]}"
        return f"{name} ({unit})" if abs(offset) < 1e-9 else f"{name} from {'xyz'[place]} = {offset:.4g} ({unit})"
    if abs(axis @ cut.line.direction) > 1 - 1e-9:
        return f"along d ({unit})"
    return f"along ({', '.join(f'{v:.3g}' for v in axis + 0.0)}) ({unit})"


def _place(cut: FieldCut) -> str:
    """Where the plane is, unless it passes through the origin."""
    normal = np.cross(*cut.axes)
    height = float(normal @ cut.point)
    if abs(height) < 1e-9:
        return ""
    place = int(np.argmax(np.abs(normal)))
    if abs(normal[place]) > 1 - 1e-9:
        return f", at {'xyz'[place]} = {cut.point[place]:.4g}"
    return f", through ({', '.join(f'{v:.4g}' for v in cut.point + 0.0)})"


def add_cut_legend(cut: FieldCut, ax: Any, *, fresh: bool, fronts: bool = False) -> None:
    """Legend below a new figure, or on axes that were given."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
    from matplotlib.patheffects import withStroke

    handles: list[Any] = []
    if np.any(~cut.outside):
        handles.append(Patch(facecolor=SECTION, edgecolor="#111111", label="body"))
    if len(cut.shadow_points()):
        look: dict[str, Any] = {"color": "#111111", "markeredgecolor": "#ffffff", "markersize": 5}
        handles.append(Line2D([], [], marker="o", linestyle="none", label="shadow line", **look))
    if fronts:
        # white on white would not be seen
        around = [withStroke(linewidth=4.0, foreground="#8c4a6e")]
        handles.append(Line2D([], [], color=FRONT, linewidth=1.0, path_effects=around, label="wave front"))
    if words := status_words(cut):
        face, edge = (NOTHING, HATCHED) if np.any(missing_of(cut)) else DOUBTFUL
        handles.append(Patch(facecolor=face, edgecolor=edge, linewidth=0, hatch=HATCH, label=f"not OK: {words}"))
    if any(np.any(below_error(cut, cut.magnitude(name))) for name in cut.quantities):
        handles.append(Patch(facecolor="#2b2140", edgecolor=DOTTED, linewidth=0, hatch=DOTS, label="below its error"))
    columns = len(handles) if sum(len(one.get_label()) for one in handles) < 70 else 2
    if handles and fresh:
        ax.figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False, fontsize=8)
    elif handles:
        ax.legend(handles=handles, frameon=True, fontsize=8)
