"""Choices between flows, kept beside the cached maps.

A choice rests on measured times, and a run that is repeated is to carry its rays in the same way. A file holds what
was chosen and a digest of it; one that cannot be read, or was changed, is as good as none.
"""

import json
import os
from pathlib import Path

from creeping._typing import Any
from creeping.errors import StoredMapError
from creeping.geodesics.direct_flow import DirectFlow
from creeping.geodesics.integrator import ErrorEstimate
from creeping.geometry.surface import Surface
from creeping.phaseflow.cache import cache_folder, cached_place
from creeping.phaseflow.phase_map import PhaseMap
from creeping.storage.folder import content_digest, private_folder

SUFFIX = ".choice.json"


def remembered_choice(
    body: Surface, key: dict[str, Any], horizon: float, *, stored: bool, folder: bool | str | Path
) -> DirectFlow | str | None:
    """The flow that was chosen before: "map", or the direct one itself with this horizon; None if there is none.

    A map that is ``stored`` now and was not then reopens the choice.
    """
    try:
        content = _read(_file(body, key, folder))
        if content["kind"] == "map":
            return "map"
        if stored and not content["stored"]:
            return None
        step, error = content["step"], content["error"]
        error_estimate = ErrorEstimate(float(error[0]), float(error[1]), int(error[2]))
        return DirectFlow(body, float(content["rtol"]), horizon, None if step is None else float(step), error_estimate)
    except (OSError, ValueError, KeyError, TypeError, IndexError, AttributeError):
        return None


def remember_choice(
    body: Surface, key: dict[str, Any], flow: PhaseMap | DirectFlow, *, stored: bool, folder: bool | str | Path
) -> None:
    """Keep a choice, if there is a place for it."""
    content: dict[str, Any] = {"kind": "map"}
    if isinstance(flow, DirectFlow):
        assert flow.error is not None
        error_estimate = [flow.error.rms, flow.error.max, flow.error.samples]
        content = {"kind": "direct", "rtol": flow.rtol, "step": flow.step, "error": error_estimate, "stored": stored}
    place = _file(body, key, folder)
    try:
        private_folder(place.parent)
        part = place.with_name(f".{place.name}.{os.getpid()}")
        part.write_text(json.dumps(content | {"digest": content_digest(content)}), encoding="utf-8")
        part.replace(place)
    except (OSError, StoredMapError):
        return


def choice_files() -> list[Path]:
    """Files of choices in the user's cache."""
    root = cache_folder()
    return sorted(file for file in root.glob(f"*{SUFFIX}") if _read(file)) if root.is_dir() else []


def _read(file: Path) -> dict[str, Any]:
    """Content of a file of ours, empty if it is damaged or none."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        return dict(content) if content.pop("digest") == content_digest(content) else {}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def _file(body: Surface, key: dict[str, Any], folder: bool | str | Path) -> Path:
    place = cached_place(body, {"choice": key}, folder)
    return place.with_name(place.name + SUFFIX)
