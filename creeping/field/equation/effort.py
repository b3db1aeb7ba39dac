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
from creeping.field.boundary import CONDUCTOR, HARD, Boundary, BoundaryLike, scalar_boundaries
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.columns import STEPS, TOGETHER, is_dense, matrix_bytes
from creeping.field.equation.matrix import EACH, VECTOR
from creeping.field.equation.mirrors import mirrors_of
from creeping.field.equation.split_sums import CURL, ONE_LAYER, TWO_LAYERS, SmoothKernel, best_split
from creeping.field.equation.tiles import Tiles
from creeping.geometry.surface import Surface, memo, size
from creeping.kernels.threads import thread_count
from creeping.storage.memory import budget

SECONDS, ASKED = 30.0, 300.0
"""What the equation of one incidence may take, unless the caller says, and if it is asked for."""
PATIENCE = 4.0
"""Of what one incidence may take, what all of them may by fine tiles: coarse ones take a quarter, and err by 0.1 dB."""
PRODUCTS = 20
"""Products with the matrix, about, that an incidence takes to the tolerance."""
LEAST_STEPS, MOST_STEPS = 3, 10
"""Steps of GMRES from the currents of optics on: fewer serve no one, and more change nothing that coarse tiles know."""
FEWEST = 10.0
"""Nodes that a square wavelength has at least: 12 by the widest of coarse rules, squares of 2 x 2 nodes, less SLACK."""
PER_NODE, PER_PAIR, FEWEST_PAIRS = (2.5e-5, 3e-6), (1.2e-6, 4e-7), 7.0
"""Seconds of a core that integrals take of a node, and of each tile near it, and more of both for each node of a tile;
tiles near to a node at least, as on a sphere (tests/benchmarks/test_forecast.py)."""
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
    """Load of the equation on tiles: nodes; seconds of near tiles, of setup and of a column's product; bytes.

    ``parts`` of the body are images of each other (`creeping.field.equation.mirrors`).
    """

    nodes: int
    near: float
    seconds: float
    product: float
    memory: float
    parts: int


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
    allowed = SECONDS if seconds is None else seconds
    try:
        return _plan(body, wavenumber, equation_boundary(boundary), allowed, incidences, together)
    except SurfaceError as error:
        return Plan(0, np.inf, np.inf, str(error))


def _plan(body: Surface, wavenumber: float, kind: Boundary, allowed: float, incidences: int, together: bool) -> Plan:
    columns, asked = incidences * kind_columns(kind), (incidences if together else 1) * kind_columns(kind)
    fewest = fewest_nodes(body, wavenumber)
    least = near_seconds(fewest, FEWEST_PAIRS * fewest, 1, kind, flat=True)
    plan = Plan(fewest, least, 0.0, f"at least {fewest} nodes take about {least:.2g} s, more than {allowed:g}")
    for coarse in (False, True) if least <= allowed else ():
        load = load_of(body, wavenumber, kind, coarse=coarse)
        # of incidences their values and changes, and what GMRES keeps
        memory = load.memory + 64.0 * load.nodes * incidences * (6 if kind.kind == "conductor" else 1) + TOGETHER
        products = PRODUCTS
        if coarse:
            room = (allowed - load.seconds) / max(asked * load.product, 1e-9)
            products = int(min(MOST_STEPS + 1, max(LEAST_STEPS + 1, room)))
        takes, refused = load.seconds + products * asked * load.product, ""
        if memory > budget():
            refused = f"{load.nodes} nodes take {memory / 1e9:.2g} GB"
        elif takes > allowed:
            refused = f"{load.nodes} nodes take about {takes:.2g} s, more than {allowed:g}"
        effort = Effort(True, products - 1) if coarse else FULL
        plan = Plan(load.nodes, load.seconds + products * columns * load.product, memory, refused, effort)
        if not refused and (coarse or together or plan.seconds <= PATIENCE * allowed):
            break
    return plan


def too_much(body: Surface, wavenumber: float, boundary: BoundaryLike, seconds: float | None = None) -> str:
    """Why the equation of one incidence takes too much time or memory, or cannot be; nothing if it does not."""
    return plan_of(body, wavenumber, boundary, seconds).refused


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


def near_seconds(nodes: float, pairs: float, p: int, kind: Boundary, *, flat: bool) -> float:
    """Seconds of integrals over tiles of p x p nodes near to nodes and to the points beneath them, in ``pairs``."""
    vector = (NEAR_FLAT if flat else NEAR_CURVED) if kind.kind == "conductor" else 1.0
    node, pair = (first + more * p**2 for first, more in (PER_NODE, PER_PAIR))
    return 2 * (nodes * node + pairs * pair) * vector / thread_count()


def fewest_nodes(body: Surface, wavenumber: float) -> int:
    """Nodes that the equation has at least, by the area of the widest tiles that the body has."""
    widest = 2 * np.pi / size(body)
    area = memo(body, "area", lambda: float(body_tiles(body, widest, HARD, coarse=True).weights.sum()))
    return int(FEWEST * area * (wavenumber / (2 * np.pi)) ** 2)


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
    near = near_seconds(nodes, tiles.near_pairs, tiles.p, kind, flat=tiles.planar)
    entries = float(nodes) ** 2 * (4 if vector else 1)
    # signs of three coordinates make eight parts at most
    parts = len(mirrors_of(tiles, kind).images) if is_dense(nodes, kind, 8) else 1
    whole = matrix_bytes(nodes, kind, parts)
    if is_dense(nodes, kind, parts):
        once = (near + pair_seconds(nodes, kind)) / parts
        return Load(nodes, near, once, PER_ENTRY * entries / parts / thread_count(), whole, parts)
    load = CURL if vector else ONE_LAYER if kind.kind in ("soft", "hard") else TWO_LAYERS
    widths = np.ptp(tiles.points, axis=0)
    # as many points beneath the nodes
    places = np.concatenate([tiles.points, tiles.points])
    best = best_split(lambda a: SmoothKernel(wavenumber, widths, a), places, tiles.points, load, np.inf)
    # entries of 12 bytes at the nodes and beneath them, and once more of one of both while they are put together
    sparse = 3 * 12.0 * tiles.near_pairs * tiles.p**2 * (4 if vector else 1)
    if best is None:
        return Load(nodes, near, near, np.inf, whole, parts)
    # a split sum of a conductor is of two columns
    return Load(nodes, near, near, best.seconds / (2 if vector else 1), best.memory + sparse, parts)
