"""What a sweep is made of: flow, request, incidences, and their cut into tasks; and the computation of one task.

The key of a plan is all that its results depend on, in words and digests: results of equal keys are equal bit for bit.
"""

import hashlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import cached_property
from math import prod
from pathlib import Path

import numpy as np

from creeping._typing import Any, FloatArray
from creeping._version import __version__
from creeping.errors import CreepingError, InvalidInputError
from creeping.geodesics.direct_flow import DirectFlow
from creeping.geodesics.integrator import ErrorEstimate
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface, fingerprint
from creeping.phaseflow.cache import load_phase_map
from creeping.phaseflow.phase_map import PhaseMap
from creeping.rays.transport import Flow
from creeping.shadow.status import LineStatus
from creeping.storage.folder import content_digest
from creeping.sweeping.between import FieldsBetween
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.sweeper import NoFlow, Sweeper

MISTAKES = (MemoryError, TypeError, AttributeError, NameError, ImportError)
"""Errors that tell of the program or the machine, not of an incidence."""
Arrays = dict[str, np.ndarray[Any, Any]]


Maker = Callable[[Flow, SweepRequest], Sweeper | FieldsBetween]


def sweeper_of(flow: Flow, request: SweepRequest) -> Sweeper | FieldsBetween:
    """What gives the results of unit directions (n, 3); bodies with creases have no rays that all go on."""
    plain = request.lattice is None or is_piecewise(flow.body)
    return Sweeper(flow, request) if plain else FieldsBetween(flow, request)


@dataclass(frozen=True, eq=False)
class SweepPlan:
    """A sweep to be done.

    Attributes
    ----------
    flow : PhaseMap or DirectFlow
    request : SweepRequest
    incidences : (n, 3)
        Unit directions.
    chunk : int
        Incidences of one task.
    make : callable
        Makes the sweeper of a flow and a request; importable by workers.
    asked : dict
        What led to the flow, as of a study file; a part of the key.
    text : str
        Of the study file.
    """

    flow: Flow
    request: SweepRequest
    incidences: FloatArray
    chunk: int
    make: Maker = sweeper_of
    asked: dict[str, Any] = field(default_factory=dict)
    text: str = ""

    def __post_init__(self) -> None:
        reason = too_large(self.request)
        if reason:
            raise InvalidInputError(reason, bytes=bytes_of(self.request))

    @property
    def body(self) -> Surface:
        """Body of the flow."""
        return self.flow.body

    @property
    def tasks(self) -> int:
        """Number of tasks."""
        return -(-len(self.incidences) // self.chunk)

    def rows(self, task: int) -> slice:
        """Incidences of a task."""
        return slice(task * self.chunk, min((task + 1) * self.chunk, len(self.incidences)))

    @cached_property
    def flow_content(self) -> dict[str, Any]:
        """See `describe_flow`."""
        return describe_flow(self.flow)

    @cached_property
    def key(self) -> dict[str, Any]:
        """All that the results depend on, as json makes it."""
        request = asdict(self.request)
        request["observation"] = array_digest(np.array(self.request.observation, dtype=float))
        content = {
            "body": fingerprint(self.body),
            "flow": self.flow_content,
            "request": request,
            "incidences": {"count": len(self.incidences), "digest": array_digest(self.incidences)},
            "chunk": self.chunk,
            "sweeper": f"{self.make.__module__}.{self.make.__qualname__}",
            "version": __version__,
            "asked": self.asked,
        }
        return dict(json.loads(json.dumps(content)))

    @property
    def digest(self) -> str:
        """Digest of the key."""
        return content_digest(self.key)


def task_size(request: SweepRequest, count: int, asked: int | None = None, *, shared: bool = True) -> int:
    """Incidences of a task unless asked for: not too large in memory, and ``shared`` enough of them to save often."""
    if asked:
        return min(int(asked), count)
    if request.lattice is not None:
        # nodes are computed together and serve a task: `studies sweep_speed --tables between`
        most = min(count, 4096)
    else:
        most = min(-(-count // 32), 1024) if shared else min(count, 256)
    # 64 MB of results: memory that the next task takes again costs less than new memory
    return max(1, min(most, 64_000_000 // bytes_of(request)))


def bytes_of(request: SweepRequest) -> int:
    """Results of one incidence, in memory."""
    sizes = request.sizes
    return sum(np.dtype(v.dtype).itemsize * prod(sizes[d] for d in v.dims) for v in request.variables.values())


def too_large(request: SweepRequest) -> str:
    """Why the results of one incidence are too many; nothing if they are not."""
    size = bytes_of(request)
    # an incidence is computed whole and is a chunk of its own at least
    if size <= 1e9:
        return ""
    fewer = "rays or steps" if request.quantity == "rays" else "wavenumbers, boundaries or directions of observation"
    return f"one incidence gives {size / 1e9:.1f} GB of results, more than 1 GB; ask for fewer {fewer}"


def compute(sweeper: Sweeper | FieldsBetween, incidences: FloatArray) -> tuple[Arrays, dict[int, str]]:
    """Results of incidences (n, 3), and the errors of those that failed, by row.

    If the sweeper raises, each incidence is tried alone, so that one does not cost the others their results. `MISTAKES`
    are raised.
    """
    try:
        arrays, errors = sweeper(incidences), dict[int, str]()
    except MISTAKES:
        raise
    except Exception as error:
        if len(incidences) > 1:
            pieces = [compute(sweeper, incidences[row : row + 1]) for row in range(len(incidences))]
            joined = {name: np.concatenate([piece[0][name] for piece in pieces]) for name in pieces[0][0]}
            return joined, {row: piece[1][0] for row, piece in enumerate(pieces) if piece[1]}
        return sweeper.request.empty(1), {0: f"{type(error).__name__}: {error}"}
    for row in np.flatnonzero(arrays["incidence_status"] == LineStatus.FAILED):
        errors[int(row)] = "no reason is known"
    return arrays, errors


def common_error(errors: dict[int, str], count: int) -> str:
    """Error that all of ``count`` incidences failed with; nothing if there is no such error."""
    texts = set(errors.values())
    return texts.pop() if len(errors) == count and len(texts) == 1 else ""


class FirstTaskGuard:
    """What the first task of a run came to: if all in it fail alike, so would the rest; one incidence is too few."""

    def __init__(self) -> None:
        self._count, self._text, self._passed = 0, "", False

    def add(self, count: int, error: str) -> None:
        """Add a task: how many incidences it has, and their `common_error`.

        Raises
        ------
        CreepingError
            If nothing would come of the rest.
        """
        if not error or self._text not in ("", error):
            self._passed = True
        self._count, self._text = self._count + count, error
        if not self._passed and self._count > 1:
            raise CreepingError(
                f"the first {self._count} incidences failed, all with {error}; nothing would come of the rest",
                incidences=self._count,
            )


def describe_flow(flow: Flow) -> dict[str, Any]:
    """Parameters of a flow, from which `open_flow` makes it again; the tables of a map by their digest."""
    measured = None if flow.error is None else [flow.error.rms, flow.error.max, flow.error.samples]
    if isinstance(flow, PhaseMap):
        return {
            "kind": "map",
            "horizon": flow.horizon,
            "nodes": [int(n) for n in flow.grid.nodes],
            "degree": flow.grid.degree,
            "charts": len(flow.leaps[-1].state),
            "type": str(flow.leaps[-1].state.dtype),
            "tables": flow.digest,
            "error": measured,
        }
    if isinstance(flow, NoFlow):
        return {"kind": "none", "error": None}
    if isinstance(flow, DirectFlow):
        return {"kind": "direct", "horizon": flow.horizon, "rtol": flow.rtol, "step": flow.step, "error": measured}
    return {"kind": "other", "repr": repr(flow), "horizon": flow.horizon, "error": measured}


def save_flow(flow: Flow, folder: Path) -> None:
    """Write what `open_flow` needs beside the description: the tables of a map.

    Raises
    ------
    InvalidInputError
        If the flow is neither a phase map nor a direct flow.
    """
    if isinstance(flow, PhaseMap):
        flow.save(folder / "map")
    elif not isinstance(flow, DirectFlow | NoFlow):
        raise InvalidInputError(f"a {type(flow).__name__} cannot be stored; give a PhaseMap or a DirectFlow")


def open_flow(content: dict[str, Any], folder: Path, body: Surface) -> PhaseMap | DirectFlow | NoFlow:
    """Make the flow of a description; a map from its folder, its tables mapped from the files.

    Raises
    ------
    CreepingError
        If the description is of another kind of flow, or the map cannot be opened.
    """
    if content["kind"] == "map":
        return load_phase_map(folder / "map", body)
    if content["kind"] == "direct":
        error = content["error"] and ErrorEstimate(*content["error"])
        return DirectFlow(body, content["rtol"], content["horizon"], content["step"], error)
    if content["kind"] == "none":
        return NoFlow(body)
    raise CreepingError(f"{folder} holds a flow of kind {content['kind']!r}, which is neither 'map' nor 'direct'")


def differing(first: dict[str, Any], second: dict[str, Any], prefix: str = "") -> list[str]:
    """Names of the entries in which two keys differ, with both values; entries of dicts as ``outer.inner``."""
    found = []
    for name in sorted({*first, *second}):
        a, b = first.get(name), second.get(name)
        if isinstance(a, dict) and isinstance(b, dict):
            found += differing(a, b, f"{prefix}{name}.")
        elif a != b:
            found.append(f"{prefix}{name} (stored {short(a)}, now {short(b)})")
    return found


def array_digest(array: FloatArray) -> str:
    """Digest of shape and values."""
    digest = hashlib.blake2b(str(array.shape).encode(), digest_size=16)
    digest.update(np.ascontiguousarray(array).view(np.uint8).reshape(-1).data)
    return digest.hexdigest()


def short(value: Any) -> str:
    """Value as text for a message, at most 60 characters of it."""
    try:
        text = str(value)
    except ValueError:
        # of a number with thousands of digits
        text = "a number too long to be shown"
    return text if len(text) <= 60 else text[:57] + "..."
