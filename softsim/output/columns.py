"""What the columns of a history are called, for whoever reads one without the model behind it."""

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
        "internal_energy",
        "kinetic_energy",
        "external_work",
        "friction_dissipation",
        "viscous_dissipation",
        "contact_energy",
        "energy_error",
        "unbalanced_share",
    }
)
"""All columns that observation.columns gives to some model; any other column is a probe's."""


def probe_names(units: dict[str, str]) -> dict[str, dict[str, str]]:
    """Probes of a history: unit -> column -> what a person calls it, such as "tip y".

    units: column -> unit, in order, as history.read_units gives them.
    """
    probes: dict[str, dict[str, str]] = {}
    for column, unit in units.items():
        if column not in FIXED_COLUMNS:
            probes.setdefault(unit, {})[column] = column
    return probes
