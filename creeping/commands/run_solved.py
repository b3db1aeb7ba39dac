"""``creeping run`` of a body without rays, on its facets or of several: its far field. Part of the command line."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from creeping._progress import Progress
from creeping._version import __version__
from creeping.commands.body import title_of
from creeping.commands.resuming import Unfinished, kept
from creeping.commands.run_field import Job
from creeping.commands.run_plane import Plane, plane_words, write_planes
from creeping.commands.run_report import wave_entry
from creeping.errors import InvalidInputError
from creeping.geometry.arguments import rays_refused
from creeping.geometry.parts import why_no_rays


def run_solved(
    shape: Any,
    job: Job | None,
    incident: Any,
    output: Path,
    body: str,
    planes: Sequence[Plane],
    formats: Sequence[str],
    pictures: bool,
    backend: str,
    progress: Progress,
    unfinished: Unfinished,
) -> dict[str, Any]:
    """Write the far field of a plane wave on a body without rays; returns the summary.

    Raises
    ------
    InvalidInputError
        If no field is asked for, or one of a point source.
    """
    if job is None:
        raise InvalidInputError(f"{rays_refused(shape)}; give --wavenumber, --frequency or --wavelength")
    if not hasattr(incident, "direction"):
        raise InvalidInputError(f"--source is of bodies with rays; {why_no_rays(shape)}: give --direction")
    started = time.perf_counter()
    with kept(unfinished, progress.message):
        solution, far, seconds = job.solved(shape, incident.direction, progress, unfinished)
        progress("pictures and files" if pictures else "files")
        summary: dict[str, Any] = {"body": body, "version": __version__, **wave_entry(incident)}
        summary |= {"rays": None, "without_rays": why_no_rays(shape), "nodes": solution.nodes}
        summary["field"], names = job.write(
            far, solution, output, backend, title_of(body), pictures=pictures, formats=formats
        )
        summary["planes"], more = write_planes(
            planes, job, solution, output, title_of(body), progress, pictures=pictures, formats=formats
        )
        summary["field"]["seconds"], summary["files"] = seconds, [*names, *more, "summary.json"]
        summary["seconds"] = round(time.perf_counter() - started, 2)
        unfinished.write_summary(summary, complete=True)
        unfinished.finished()
    return summary


def readable(summary: dict[str, Any], output: Path) -> str:
    """The summary in a few lines."""
    field = summary["field"]
    error = field["error"]
    told = "" if error["rms"] is None else f"; error by {error['by']} {error['rms']:.2g} {field['unit']} rms"
    return "\n".join(
        [
            f"no creeping rays: {summary['without_rays']}",
            f"{field['boundary']} far field in {field['directions']} directions by the integral equation between "
            f"{summary['nodes']} nodes, |f| up to {field['largest']:.4g} {field['unit']}{told}, "
            f"{field['unresolved']} unresolved",
            *map(plane_words, summary["planes"]),
            f"{len(summary['files'])} files in {output} ({', '.join(summary['files'])}), {summary['seconds']:.1f} s",
        ]
    )
