"""An echo as a table: a row for each channel, angle and frequency, columns explained in lines that begin with #."""

import os
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any
from creeping.storage.atomic import written_aside

if TYPE_CHECKING:
    from creeping.field.echo import Echo
    from creeping.field.slant_range import RangeProfile

COLUMNS = {
    "channel": "polarisation received and transmitted (V along theta, H along phi), or the boundary",
    "azimuth_deg": "as seen from the body",
    "elevation_deg": "as seen from the body",
    "frequency_hz": "",
    "wavenumber_1_m": "k",
    "level_db": "",
    "low_db": "level of |f| less its error",
    "high_db": "level of |f| and its error",
    "phase_deg": "of f, relative to the origin of the body's coordinates; time factor exp(-i w t)",
    "re_m": "real part of f",
    "im_m": "imaginary part of f",
    "error_m": "of |f|",
}


def write_echo(path: str | os.PathLike[str], echo: "Echo") -> None:
    """Write an echo as CSV.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    from creeping.field.echo import LEVELS

    total, levels, (low, high) = echo.total, echo.levels(), echo.bounds()
    phase = np.degrees(np.angle(total))
    name, unit = LEVELS[echo.quantity]
    words = COLUMNS | {"level_db": f"{name}, {unit}"}
    words |= {f"{part}_{axis}_m": f"{part} part of f" for part in echo.parts for axis in ("re", "im")}
    words |= {
        "unresolved": "1 where an expansion fails or the error is large",
        "method": "rays, currents, or rays+optics of a body with edges, joints or tips",
    }
    hertz = echo.hertz
    with written_aside(path) as aside, open(aside, "w", encoding="utf-8", newline="\n") as stream:
        stream.writelines(f"# {key}: {text}\n" for key, text in words.items() if text)
        stream.write(",".join(words) + "\n")
        for at in np.ndindex(total.shape):
            c, n, k = at
            row: list[Any] = [
                echo.channels[c],
                echo.azimuth[n],
                echo.elevation[n],
                hertz[k],
                echo.wavenumbers[k],
                levels[at],
            ]
            row += [low[at], high[at], phase[at], total[at].real, total[at].imag, echo.error[at]]
            for part in echo.parts.values():
                row += [part[at].real, part[at].imag]
            row += [echo.unresolved[at].astype(int), "currents" if echo.by_currents[at] else echo.otherwise]
            stream.write(",".join(map(_text, row)) + "\n")


def _text(value: object) -> str:
    """Shortest text that reads back to the same number."""
    return value if isinstance(value, str) else repr(getattr(value, "item", lambda: value)())


def write_profile(path: str | os.PathLike[str], profiles: "dict[str, RangeProfile]", echo: "Echo") -> None:
    """Write range profiles by channel as CSV.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    with written_aside(path) as aside, open(aside, "w", encoding="utf-8", newline="\n") as stream:
        stream.write("# range_m: along the line of sight, 0 at the origin, negative towards the radar\n")
        stream.write("# level_db: of the echo from there\n")
        stream.write("channel,range_m,level_db,phase_deg\n")
        for channel, found in profiles.items():
            levels, phase = echo.levels(found.values), np.degrees(np.angle(found.values))
            for values in zip(found.range.tolist(), levels.tolist(), phase.tolist(), strict=True):
                stream.write(f"{channel},{','.join(map(repr, values))}\n")
