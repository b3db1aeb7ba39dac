"""What the integral equation of a body takes, and how finely it is solved within a time.

Fine tiles and GMRES to a tolerance of 3e-5 where they take no longer than they may. Else coarse tiles, and as many
steps of GMRES as there is time for, from the currents of physical optics on: after one, three and five the far field of
a cylinder, k = 20 and 40, is within 0.3 to 0.7, 0.1 to 0.3 and 0.05 to 0.1 % rms of the largest amplitude. Both state
what they leave (`creeping.field.equation.currents`).

    seconds = integrals over near tiles/cores + products x seconds of one

Sources: [SS86]; Derivations, F35 and F36.
"""

from typing import NamedTuple

import numpy as np

from creeping.errors import SurfaceError
from creeping.field.boundary import CONDUCTOR, Boundary, BoundaryLike, scalar_boundaries
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.columns import STEPS, TOGETHER, is_dense
from creeping.field.equation.matrix import EACH, VECTOR
from creeping.field.equation.split_sums import CURL, ONE_LAYER, TWO_LAYERS, SmoothKernel, best_split
from creeping.field.equation.tiles import POINTS, SIDE, WIDE, Tiles
from creeping.geometry.memo import memo
from creeping.geometry.quadrature import node_count
from creeping.geometry.surface import Surface
from creeping.kernels.threads import thread_count
from creeping.storage.memory import budget

SECONDS, ASKED = 30.0, 300.0
"""What the equation of one incidence may take, unless the caller says, and if it is asked for."""
PRODUCTS = 20
"""Products with the matrix, about, that an incidence takes to the tolerance."""
LEAST_STEPS, MOST_STEPS = 3, 10
"""Steps of GMRES from the currents of optics on: fewer serve no one, and more change nothing that coarse tiles know."""
PER_NODE, PER_SQUARE = 1.4e-4, 1.4e-5
"""Seconds of a core that integrals over tiles near to a node take, and more for each node of a tile."""
NEAR_CURVED, NEAR_FLAT = 2.3, 1.3
"""What those of a conductor take of that, by whether tiles are curved."""
PER_ENTRY = 4e-10
"""Seconds of an entry of the matrix in a product with one of several columns."""


class Effort(NamedTuple):
    """Whether tiles are coarse, and the steps of GMRES at most."""

    coarse: bool
    steps: int


FULL = Effort(False, STEPS)


class Plan(NamedTuple):
    """Nodes, seconds and bytes that the equation takes, about; why it is not solved, or nothing; and how it is."""

    nodes: int
    seconds: float
    memory: float
    refused: str
    effort: Effort = FULL


class Load(NamedTuple):
    """Of the equation on tiles: nodes; seconds of near tiles, of all made once and of a column's product; bytes."""

    nodes: int
    near: float
    seconds: float
    product: float
    memory: float


def plan_of(
    body: Surface,
    wavenumber: float,
    boundary: BoundaryLike,
    seconds: float | None = None,
    *,
    incidences: int = 1,
    together: bool = False,
) -> Plan:
    """How the equation is solved where one incidence, or all of them ``together``, take no more than some seconds.

    Those are SECONDS if they are not given. What is told is for all incidences.
    """
    allowed, kind = SECONDS if seconds is None else seconds, equation_boundary(boundary)
    columns, asked = incidences * kind_columns(kind), (incidences if together else 1) * kind_columns(kind)
    refused, first = "", Plan(0, np.inf, np.inf, "")
    for coarse in (False, True):
        try:
            load = load_of(body, wavenumber, kind, coarse=coarse)
        except SurfaceError as error:
            return Plan(0, np.inf, np.inf, str(error))
        # of incidences their values and changes, and what GMRES keeps
        memory = load.memory + 64.0 * load.nodes * incidences * (6 if kind.kind == "conductor" else 1) + TOGETHER
        products = PRODUCTS
        if coarse:
            products = int(min(MOST_STEPS + 1, (allowed - load.seconds) / max(asked * load.product, 1e-9)))
        effort = Effort(True, products - 1) if coarse else FULL
        plan = Plan(load.nodes, load.seconds + products * columns * load.product, memory, "", effort)
        if memory > budget():
            refused = refused or f"{load.nodes} nodes take {memory / 1e9:.2g} GB"
        elif coarse and effort.steps < LEAST_STEPS:
            takes = load.seconds + (LEAST_STEPS + 1) * asked * load.product
            refused = f"{load.nodes} nodes take about {takes:.2g} s, more than {allowed:g}"
        elif coarse or load.seconds + products * asked * load.product <= allowed:
            return plan
        first = plan
    return first._replace(refused=refused)


def too_much(body: Surface, wavenumber: float, boundary: BoundaryLike, seconds: float | None = None) -> str:
    """Why the equation of one incidence takes too much time or memory, or cannot be; nothing if it does not."""
    return plan_of(body, wavenumber, boundary, seconds).refused


def is_large(body: Surface, wavenumber: float, boundary: BoundaryLike) -> bool:
    """Whether the equation of one incidence costs more than SECONDS; of large bodies told without making tiles."""
    kind = equation_boundary(boundary)
    # quadrature of the currents has no more than twice the nodes of fine tiles
    p = POINTS - 1
    least = 0.5 * node_count(body, wavenumber) * (p * SIDE / (POINTS * WIDE)) ** 2
    if near_seconds(least, p, kind, flat=True) > SECONDS:
        return True
    return bool(too_much(body, wavenumber, boundary))


def expected_seconds_of(body: Surface, wavenumber: float, boundary: BoundaryLike) -> float:
    """About what the equation of one incidence costs, 0 where it is not solved by itself."""
    plan = plan_of(body, wavenumber, boundary)
    return 0.0 if plan.refused else plan.seconds


def equation_boundary(boundary: BoundaryLike) -> Boundary:
    """The boundary of the equation: of a conductor one, not two scalar ones."""
    kinds = scalar_boundaries(boundary)
    return CONDUCTOR if len(kinds) == 2 else kinds[0]


def kind_columns(kind: Boundary) -> int:
    """Right sides of an incidence: a conductor has two polarisations."""
    return 2 if kind.kind == "conductor" else 1


def near_seconds(nodes: float, p: int, kind: Boundary, *, flat: bool) -> float:
    """Seconds of integrals over tiles of p x p nodes near to the nodes and to the points beneath them."""
    vector = (NEAR_FLAT if flat else NEAR_CURVED) if kind.kind == "conductor" else 1.0
    return nodes * (PER_NODE + PER_SQUARE * p**2) * vector / thread_count()


def load_of(body: Surface, wavenumber: float, kind: Boundary, *, coarse: bool = False) -> Load:
    """What the equation takes on tiles of a body, known once these are made.

    Raises
    ------
    SurfaceError
        If the body has no tiles.
    """
    known: dict[tuple[float, str, bool, bool], Load] = memo(body, "loads of the equation", dict)
    key = wavenumber, kind.kind, kind.varies, coarse
    if key not in known:
        known[key] = load_on(body_tiles(body, wavenumber, kind, coarse=coarse), wavenumber, kind)
    return known[key]


def pair_seconds(nodes: int, kind: Boundary) -> float:
    """Seconds of all pairs of the nodes, and of these and the points beneath them."""
    return 2 * float(nodes) ** 2 * EACH * (VECTOR if kind.kind == "conductor" else 1.0) / thread_count()


def load_on(tiles: Tiles, wavenumber: float, kind: Boundary) -> Load:
    """What the equation takes on tiles."""
    nodes, vector = len(tiles.points), kind.kind == "conductor"
    near = near_seconds(nodes, tiles.p, kind, flat=tiles.planar)
    if is_dense(nodes, kind):
        entries = float(nodes) ** 2 * (4 if vector else 1)
        made = near + pair_seconds(nodes, kind)
        # the matrix and its transpose
        return Load(nodes, near, made, PER_ENTRY * entries / thread_count(), 16 * entries)
    load = CURL if vector else ONE_LAYER if kind.kind in ("soft", "hard") else TWO_LAYERS
    widths = np.ptp(tiles.points, axis=0)
    # as many points beneath the nodes
    places = np.concatenate([tiles.points, tiles.points])
    best = best_split(lambda a: SmoothKernel(wavenumber, widths, a), places, tiles.points, load, np.inf)
    sparse = 2e4 * nodes * (4 if vector else 1) * max(tiles.p, 2) ** 2 / 25
    if best is None:
        return Load(nodes, near, near, np.inf, np.inf)
    # a split sum of a conductor is of two columns
    return Load(nodes, near, near, best.seconds / (2 if vector else 1), best.memory + sparse)
