"""``creeping rcs`` and ``creeping ts``: the echo of a body as a radar or a sonar measures it, with its error.

Lengths of the body are metres. Angles are those of the radar or the observer as seen from the body.
"""

import time
from typing import Annotated, Any

from cyclopts import Parameter

from creeping.commands import options


def rcs(
    body: options.Body,
    *,
    polarisation: Annotated[
        str | None, Parameter(help="HH, VV, HV, VH, joined by commas: received, then transmitted. HH,VV.")
    ] = None,
    echo: options.EchoOptions = options.AS_USUAL,
    file: options.FileOptions = options.AS_IT_IS,
) -> int:
    """Radar cross section of a perfect conductor in dBsm: over angle, frequency or both, or in the mean."""
    return _run("rcs", body, echo, file, sound_speed=None, polarisation=polarisation, boundary="pec")


def ts(
    body: options.Body,
    *,
    sound_speed: Annotated[float, Parameter(help="Of the medium, m/s, e.g. 1477 of sea water.")],
    boundary: Annotated[str, Parameter(help="soft (pressure release), hard (rigid) or impedance:ETA.")] = "soft",
    echo: options.EchoOptions = options.AS_USUAL,
    file: options.FileOptions = options.AS_IT_IS,
) -> int:
    """Target strength of a body in dB re 1 m: over angle, frequency or both, or in the mean."""
    from creeping.errors import InvalidInputError

    if boundary == "pec":
        raise InvalidInputError("--boundary pec is of radar: creeping rcs")
    return _run("ts", body, echo, file, sound_speed=sound_speed, polarisation=None, boundary=boundary)


def _run(quantity: str, body: str, echo: options.EchoOptions, file: options.FileOptions, **wave: Any) -> int:
    """Refuse what makes no sense before the body is read, and its size before libraries of fields are loaded."""
    from creeping._progress import Progress
    from creeping.commands.body import parse_body
    from creeping.commands.echo_request import EchoJob, echo_request
    from creeping.commands.forecast import size_words

    started = time.perf_counter()
    asked: dict[str, Any] = {"frequency": echo.frequency, "wavelength": echo.wavelength, **wave}
    asked |= {"monostatic": echo.monostatic, "bistatic": echo.bistatic, "incidence": echo.incidence}
    request = echo_request(quantity, **asked)
    job = EchoJob(body, echo, file, asked, request, started)
    job.check()
    if echo.compare:
        from creeping.commands.echo_report import reference_of

        # before the body is read, which may take minutes
        reference_of(request, echo.compare, echo.column, echo.align)
    with Progress("frequencies" if echo.average else "", quiet=echo.json_) as progress:
        shape = parse_body(body, options=file, cache=echo.cache, progress=progress)
        size_words(shape, request.wavenumbers, metres=True, cure=request.cure)
        from creeping.commands.echo_report import run_averages, run_echo

        told = (run_averages if echo.average else run_echo)(job, shape, progress)
    print(told)
    return 0
