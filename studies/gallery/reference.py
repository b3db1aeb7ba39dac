"""Pages of the API reference: every public name by what one wants to do with it, from the docstrings.

A page a task; Sphinx reads the docstrings (autodoc, napoleon), and writes ``objects.inv`` for other sites.
"""

from pathlib import Path

TASKS: dict[str, tuple[str, dict[str, str]]] = {
    "bodies": (
        "Bodies",
        {
            "scatterers": "Sphere Ellipsoid TwistedEllipsoid Torus Cylinder Cone Capsule ConeSphere Ogive DoubleOgive "
            "Almond Revolution Implicit Gridded Mesh Cad Facets Bodies examined_mesh ExpressionSpeed Coating",
            "creeping": "check_surface body_uncertainty BodyUncertainty",
        },
    ),
    "waves": (
        "Waves and boundaries",
        {"creeping": "PlaneWave PointSource ImpedanceBoundary wavenumber fibonacci_directions"},
    ),
    "rays": (
        "Shadow lines and creeping rays",
        {
            "creeping": "shadow_line ShadowLine launch RayFan RayStatus iso_phase_curves IsoPhaseCurve trace "
            "ErrorEstimate"
        },
    ),
    "flows": (
        "Phase maps and other flows",
        {"creeping": "choose_flow build_phase_map PhaseMap ErrorGrowth load_phase_map DirectFlow"},
    ),
    "fields": (
        "Fields of one incidence",
        {
            "creeping": "solve Solution far_field FarField near_field NearField surface_field SurfaceField field_cut "
            "FieldCut conductor_field ConductorField Fields conductor_current ConductorCurrent surface_currents "
            "SurfaceCurrents FieldStatus validity Validity far_field_uncertainty compare Comparison"
        },
    ),
    "sweeps": (
        "Echoes, sweeps and T-matrices",
        {
            "creeping": "backscatter bistatic Echo sweep_directions t_matrix t_matrices "
            "orientation_averages TMatrix impulse_response ImpulseResponse range_profile RangeProfile"
        },
    ),
    "antennas": (
        "Sources and antennas",
        {
            "creeping": "source_pattern SourcePattern coupling Coupling CouplingPaths slot_coupling monopole_coupling "
            "antenna_coupling port_field PortField"
        },
    ),
    "errors": (
        "Errors that are raised",
        {
            "creeping": "CreepingError InvalidInputError SurfaceError IntegrationError ToleranceError "
            "SingularIncidenceError StoredMapError"
        },
    ),
}
"""Title of each page, and its names by package."""


def write_reference(folder: Path) -> None:
    """Write the pages, and one that lists them, as ``folder/*.md``."""
    folder.mkdir(parents=True)
    for name, (title, packages) in TASKS.items():
        blocks = [
            f".. {_directive(package, each)}:: {package}.{each}"
            for package, names in packages.items()
            for each in names.split()
        ]
        text = "\n".join(["```{eval-rst}", *blocks, "```"])
        (folder / f"{name}.md").write_text(f"# {title}\n\n{text}\n", encoding="utf-8")
    index = ["# Reference", "", "Every public name, by task.", "", "```{toctree}", *TASKS, "```", ""]
    (folder / "index.md").write_text("\n".join(index), encoding="utf-8")


def _directive(package: str, name: str) -> str:
    kind = getattr(__import__(package), name)
    if not isinstance(kind, type):
        return "autofunction"
    return "autoexception" if issubclass(kind, Exception) else "autoclass"
