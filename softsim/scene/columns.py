"""Names of the columns of a history, which probes must not have."""

ROW_FORCE, SIDE_FORCE = "row_force_", "side_force_"
"""Prefixes of the columns of rows of spikes and of sides of the robot."""

CHAMBER_PRESSURE = "pressure_"
"""Prefix of the columns of chambers, for a robot with several of them."""

FIXED_COLUMNS = frozenset(
    {
        "time",
        "pressure",
        "section_pressure",
        "chamber_volume",
        "cycle",
        "phase",
        *(f"frame_{axis}" for axis in "xyz"),
        "frame_angle",
        *(f"frame_rotation_{axis}" for axis in "xyz"),
        *(f"body_{axis}" for axis in "xyz"),
        "contact_count",
        "contact_area",
        "rows_in_contact",
        *(f"wall_force_{axis}" for axis in "xyz"),
        "wall_force_normal",
        "slip_share",
        "pull",
        "tether_drag",
        "internal_energy",
        "hourglass_energy",
        "kinetic_energy",
        "external_work",
        "friction_dissipation",
        "viscous_dissipation",
        "contact_energy",
        "energy_error",
        "unbalanced_share",
        "rear_x",
        "front_x",
        "arc_length",
        "branch",
        "cycles_done",
        "clearance",
        "frame_wall_force",
        "frame_pinch",
        "frame_drag",
        "thrust",
        "drag",
        "narrowing_drag",
    }
)
"""All columns of observation.columns, except those of rows, further chambers and probes."""


def is_probe(column: str) -> bool:
    """Return True if a column of a history belongs to a probe."""
    own = (ROW_FORCE, SIDE_FORCE, CHAMBER_PRESSURE)
    return column not in FIXED_COLUMNS and not column.startswith(own)
