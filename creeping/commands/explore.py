"""``creeping explore``: the page that follows the hand, or one incidence as a page that needs no server."""

import sys
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

from creeping.commands import options
from creeping.commands.options import is_file, parse_body, title_of
from creeping.errors import CreepingError, InvalidInputError

_page = Group("Page")


def explore(
    body: options.Body,
    *,
    direction: Annotated[tuple[float, float, float], Parameter(help="Where the wave travels at first.")] = (1, 1, 1),
    length: Annotated[float | None, Parameter(help="Travel time of the rays; where the waves have died away.")] = None,
    rays: Annotated[int, Parameter(help="Rays of the fan, 16 to 1024.")] = 256,
    spacing: Annotated[
        float | None, Parameter(help="Of iso-phase curves; an eighth of the length, 0 for none.")
    ] = None,
    wave: options.WaveOptions = options.NO_WAVE,
    boundary: Annotated[
        str, Parameter(group=options.FIELD, help="soft, hard, pec, or impedance:ETA, e.g. impedance:0.5+0.2j.")
    ] = "hard",
    export: Annotated[
        Path | None, Parameter(group=_page, help="Write one incidence as an HTML file, and serve nothing.")
    ] = None,
    port: Annotated[int, Parameter(group=_page, help="The next free one is taken if it is in use.")] = 8080,
    browser: Annotated[bool, Parameter(group=_page, help="Open the page in a browser.")] = True,
    tolerance: Annotated[float, Parameter(help="Error at the ends of the rays.")] = 1e-5,
    speed: options.SpeedOption = None,
    file: options.FileOptions = options.AS_IT_IS,
    cache: options.Cache = True,
) -> int:
    """Turn the incidence by hand, and watch shadow line, rays, iso-phase curves and field follow.

    k is at first 40 over the body's size if no wave is given.
    """
    import creeping as cr
    from creeping.commands.forecast import asked_wavenumber
    from creeping.explorer.frames import step_of, steps_of
    from creeping.explorer.request import ViewRequest, angles
    from creeping.geometry.arguments import rays_refused
    from creeping.geometry.directions import unit_direction
    from creeping.geometry.surface import size, why_no_rays
    from creeping.rays.reach import body_length

    def progress(text: str) -> None:
        print(f"creeping: {text}", file=sys.stderr)

    if not 1 <= port <= 65535:
        raise InvalidInputError(f"port = {port} is not between 1 and 65535")
    try:
        import viser  # noqa: F401
    except ImportError as error:
        raise CreepingError(f"the page needs viser ({error}); pip install 'creeping[web]'") from error
    shape = parse_body(body, speed, options=file, cache=cache, progress=progress)
    if why_no_rays(shape):
        raise InvalidInputError(rays_refused(shape))
    extent = size(shape)
    theta, phi = angles(unit_direction(direction))
    hertz = wave.frequency or wave.wavelength
    k = asked_wavenumber(wave)[0] if hertz else _round(40 / extent) if wave.wavenumber is None else wave.wavenumber
    metres = bool(hertz) or wave.sound_speed is not None or is_file(body)
    far = _round(body_length(shape, k if k > 0 and speed is None else None)) if length is None else length
    gap = _round(far / 8) if spacing is None else spacing
    # the cut runs through the direction of the wave
    cut = float(round(phi))
    request = ViewRequest(theta, phi, rays, far, gap, k, boundary, cut, metres=metres, sound_speed=wave.sound_speed)
    name = title_of(body)
    # a page may be asked for a thousand incidences: what a flow is chosen for
    moves = 1000 if export is None else 1
    steps, step = steps_of(request.length, step_of(shape))
    progress(f"choosing what carries {moves} incidence{'s' * (moves != 1)} of {request.rays} rays")
    asked: dict[str, Any] = {"length": steps * step, "n_steps": steps, "cache": cache, "progress": progress}
    flow = cr.choose_flow(shape, n_rays=moves * request.rays, tolerance=tolerance, **asked)
    if export is not None:
        from creeping.explorer.notebook import page_of
        from creeping.files import write_text

        text, found = page_of(flow, request, name)
        write_text(export, text)
        megabytes, rms = export.stat().st_size / 1e6, found.fan.error.rms
        print(f"{export}  {megabytes:.1f} MB  {len(found.fan.points)} rays, rms {rms:.1e}")
        return 0
    return _serve(flow, request, port, name, browser, progress)


def _round(value: float) -> float:
    """Two digits of a number, as a slider shows them."""
    return float(f"{value:.2g}")


def _serve(flow: Any, request: Any, port: int, name: str, browser: bool, progress: Any) -> int:
    import webbrowser

    from creeping.explorer.door import leading_to
    from creeping.explorer.page import Explorer

    progress("preparing the page")
    page = Explorer(flow, request, port=port, name=name)
    try:
        if page.server.get_port() != port:
            progress(f"port {port} is in use")
        progress(f"{page.address} (Ctrl+C ends it)")
        with leading_to(page.address) as private:
            if browser:
                webbrowser.open(private)
            page.server.sleep_forever()
    except KeyboardInterrupt:
        progress("the page is closed")
    finally:
        page.close()
    return 0
