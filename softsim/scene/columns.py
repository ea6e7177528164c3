"""Names of the columns of a history: what probes may not be called."""

ROW_FORCE, SIDE_FORCE = "row_force_", "side_force_"
"""Before the name of a row of spikes, of a side of the robot."""

CHAMBER_PRESSURE = "pressure_"
"""Before the name of each chamber of a robot that has several."""

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
"""All that observation.columns names in any model without rows, further chambers, probes."""


def is_probe(column: str) -> bool:
    """Whether a column of a history is a probe's."""
    own = (ROW_FORCE, SIDE_FORCE, CHAMBER_PRESSURE)
    return column not in FIXED_COLUMNS and not column.startswith(own)
