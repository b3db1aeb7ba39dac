"""What does one more frequency cost? A fan of 512 rays, 361 directions of the far field, triaxial ellipsoid.

By rays the geometry (rays shed, specular points, nodes of the integrals) is found for the first frequency and kept with
the fan; currents are made anew for each. Processor time, the error of each value included. Run
``python -m studies.field_cost``.
"""

import time

import numpy as np

import creeping as cr
import scatterers as sc


def seconds(boundary: str = "soft", method: str = "rays") -> tuple[float, list[float]]:
    """Processor time of the first frequency, geometry included, and of four more, s."""
    body = sc.Ellipsoid(1, 0.8, 0.6)
    flow = cr.build_phase_map(body, tolerance=1e-6)
    fan = cr.launch(flow, cr.shadow_line(body, (0.3, 0.5, 0.812)), length=5.0, n_rays=512)
    theta = np.radians(np.arange(-180, 181))
    directions = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    spent = []
    for wavenumber in (40.0, 40.5, 41.0, 41.5, 42.0):
        started = time.process_time()
        cr.far_field(fan, directions, wavenumber=wavenumber, boundary=boundary, method=method)  # type: ignore[arg-type]
        spent.append(time.process_time() - started)
    return spent[0], spent[1:]


def main() -> None:
    """Print the table."""
    for method in ("currents", "rays"):
        for boundary in ("soft", "hard", "pec"):
            seconds(boundary, method)
            first, more = seconds(boundary, method)
            each = f"first frequency {first:.2f} s, each further one {np.median(more):.3f} s"
            print(f"{method:8} {boundary:5} {each}")


if __name__ == "__main__":
    main()
