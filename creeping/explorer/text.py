"""The numbers beside the picture, as short Markdown."""

import numpy as np

from creeping._version import __version__
from creeping.explorer.colours import FIELD_COLOURS
from creeping.explorer.preview import Preview
from creeping.explorer.refined import Refined
from creeping.rays.fan import RayFan


def preview_text(frame: Preview, seconds: float, span: tuple[float, float]) -> str:
    """The fan in a few words, with the range of its colours in dB."""
    request, fan = frame.request, frame.fan
    at = f"theta {request.theta:.1f}, phi {request.phi:.1f} degrees"
    kind = "" if frame.levels is None else f"; colours: {span[0]:g} to {span[1]:g} dB, {field_name(request.boundary)}"
    return (
        f"d = ({', '.join(f'{c:.4f}' for c in request.direction)}), {at}\n\n"
        f"{_counts(fan)}; length {fan.length:.3g}; {1e3 * seconds:.0f} ms{kind}"
    )


def refined_text(found: Refined) -> str:
    """Line, errors and what the far field leaves open."""
    line, drawn = found.line, found.drawn
    shares = ", ".join(f"{share:.3g} {name}" for name, share in line.fractions.items() if share)
    lines = [
        f"shadow line: {len(line.curves)} {'curve' if len(line.curves) == 1 else 'curves'}, "
        f"length {line.length:.8g} L; {shares}",
        f"rays drawn: {_counts(drawn)}, length {drawn.length:.4g}; error at their ends rms {drawn.error.rms:.1e}, "
        f"max {drawn.error.max:.1e} ({drawn.error.samples} traced)",
    ]
    if found.far is not None:
        doubt, fan, request = int(np.sum(found.far.unresolved)), found.fan, found.request
        lines.append(
            f"fields of {len(fan.points)} rays, rms {fan.error.rms:.1e}: k = {request.wavenumber:g} 1/L, "
            f"{request.boundary}; {doubt} of {len(found.cut_angles)} directions of the cut unresolved"
        )
    else:
        lines.append("a weighted body has no field here: only its rays")
    return "\n\n".join([*lines, f"creeping {__version__}"])


def field_name(boundary: str) -> str:
    """What the colours show."""
    return "|du/dn|/k" if boundary == "soft" else "|u|"


def colour_bar(span: tuple[float, float], boundary: str) -> str:
    """A bar of the field's colours as SVG."""
    stops = "".join(
        f'<stop offset="{share:.2f}" stop-color="{FIELD_COLOURS.hexadecimal(share)}"/>'
        for share in np.linspace(0, 1, 9)
    )
    text = 'font-size="9" font-family="sans-serif" fill="#333"'
    return (
        '<svg id="bar" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 360 26" width="100%"><defs>'
        f'<linearGradient id="field">{stops}</linearGradient></defs>'
        '<rect x="34" y="2" width="318" height="9" fill="url(#field)"/>'
        f'<text x="34" y="22" {text}>{span[0]:g} dB</text><text x="352" y="22" text-anchor="end" {text}>{span[1]:g} dB'
        f'</text><text x="193" y="22" text-anchor="middle" {text}>20 log10 {field_name(boundary)}</text></svg>'
    )


def _counts(fan: RayFan) -> str:
    counts = ", ".join(f"{count} {name}" for name, count in fan.status_counts.items())
    return f"{len(fan.points)} rays" + (f" ({counts})" if counts else ": no part of the line launches any")
