"""Names of the columns of a history: what probes may not be called."""

FIXED_COLUMNS = frozenset(
    {
        "time",
        "pressure",
        "section_pressure",
        "chamber_volume",
        *(f"frame_{axis}" for axis in "xyz"),
        "frame_angle",
        *(f"frame_rotation_{axis}" for axis in "xyz"),
        *(f"body_{axis}" for axis in "xyz"),
        "contact_count",
        "rows_in_contact",
        *(f"wall_force_{axis}" for axis in "xyz"),
        "wall_force_normal",
        "slip_share",
        "pull",
        "internal_energy",
        "kinetic_energy",
        "external_work",
        "friction_dissipation",
        "viscous_dissipation",
        "contact_energy",
        "energy_error",
        "unbalanced_share",
        "arc_length",
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
"""All that observation.columns names in any model without probes; further columns are probes'."""
