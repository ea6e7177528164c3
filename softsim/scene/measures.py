"""Names and units of the measures that summary.json will have, known before a run.

`analysis/measures.py` computes their values. A test checks that both agree.
"""

from dataclasses import dataclass

from softsim.scene.loads import FollowerPressureSpec, Pneumatic, TendonSpec
from softsim.scene.outputs import probe_columns
from softsim.scene.profiles import EventCyclesProfile, ever_falls
from softsim.scene.schema import Scene


@dataclass(frozen=True)
class Measure:
    """Measure in summary.json.

    unit: SI unit, empty for bare numbers and texts. listed: for a list, what each entry belongs to.
    is_label: True for a text. is_share: True for a fraction from 0 to 1.
    """

    unit: str = ""
    listed: str = ""
    is_label: bool = False
    is_share: bool = False


LENGTH, SPEED, PRESSURE = Measure("m"), Measure("m/s"), Measure("Pa")
ENERGY = Measure("J")
FORCE, TIME, FREQUENCY, AREA = Measure("N"), Measure("s"), Measure("Hz"), Measure("m^2")
NUMBER, LABEL, SHARE = Measure(), Measure(is_label=True), Measure(is_share=True)
CYCLES, NODES, ROWS = "pressure cycle", "node", "row"
LENGTHS, PRESSURES = Measure("m", listed=CYCLES), Measure("Pa", listed=CYCLES)

WITHOUT_DERIVATIVE = (
    "time", "cycles_done", "contact_count", "contact_area", "rows_in_contact", "slip_share",
    "kinetic_energy", "external_work", "friction_dissipation", "viscous_dissipation",
    "damage_dissipation", "energy_error", "unbalanced_share",
)  # fmt: skip
"""Columns that are counts, errors, or sums over the load steps."""

OF_RUNS = {
    "simulated_time": TIME,
    "wall_time": TIME,
    "time_increment": TIME,
    "increments": NUMBER,
    "node_count": NUMBER,
    "element_count": NUMBER,
    "energy_error": NUMBER,
}
OF_BODIES = {
    "body_displacement": LENGTH,
    "body_displacement_axis": LABEL,
    "body_speed": SPEED,
    "slip_share": SHARE,
    "largest_contact_area": AREA,
    "mean_contact_area": AREA,
}
OF_ROWS = {
    "rows_in_contact": NUMBER,
    "row_contacts": Measure(listed=ROWS),
    "row_contact_shares": Measure(listed=ROWS),
}
OF_RIGID_BODIES = {
    "frame_displacement": LENGTH,
    "frame_displacement_axis": LABEL,
    "mean_speed": SPEED,
    "dominant_frequency": FREQUENCY,
}
OF_ROWS_ON_RIGID_BODIES = {"rows_at_highest": NUMBER}
OF_RIGID_BODIES_IN_CYCLES = {
    "displacement_per_cycle": LENGTHS,
    "displacement_while_falling": LENGTHS,
    "onset_pressure": PRESSURES,
    "end_pressure": PRESSURES,
}
OF_CHAMBERS = {"cycles_done": NUMBER}
OF_CONTROLLED_CYCLES = {
    "deflation_begin_pressure": PRESSURES,
    "deflation_end_pressure": PRESSURES,
}
OF_TENDONS = {"peak_pull": FORCE, "mean_pull": FORCE}
OF_LAYOUTS = {
    "layout.verdict": LABEL,
    "layout.exit": LABEL,
    "layout.blocked_by": LABEL,
    "layout.sentence": LABEL,
    "layout.time": TIME,
    "layout.start": LENGTH,
    "layout.goal": LENGTH,
    "layout.final_arc_length": LENGTH,
    "layout.longest_standstill.began": TIME,
    "layout.longest_standstill.duration": TIME,
    "layout.longest_standstill.where.arc_length": LENGTH,
    "layout.longest_standstill.where.what": LABEL,
    "layout.idle_cycles": NUMBER,
    "layout.patience_used": SHARE,
    "layout.where.arc_length": LENGTH,
    "layout.where.branch": LABEL,
    "layout.where.segment": NUMBER,
    "layout.where.what": LABEL,
}
OF_CROSSINGS = {
    "crossing.verdict": LABEL,
    "crossing.passed": SHARE,
    "crossing.time": TIME,
    "crossing.farthest_rear": LENGTH,
    "crossing.farthest_front": LENGTH,
    "crossing.sentence": LABEL,
}
OF_TRACKS = {
    "track.curvature": Measure("1/m"),
    "track.turning_rate": Measure("rad/s"),
    "track.speed": SPEED,
    "track.forward_displacement": LENGTH,
    "track.sideways_displacement": LENGTH,
}
OF_PROBES = {
    "displacement": LENGTH,
    "rotation": Measure("rad"),
    "radius": LENGTH,
    "reaction": FORCE,
    "volume": Measure("m^3"),
}
RADIAL = "radial"
CHAMBERS = ("follower_pressure", "added_volume", "added_gas", "pneumatic")


def produced(scene: Scene) -> dict[str, Measure]:
    """Return the measures that a run of `scene` may have, by name, such as "layout.verdict".

    A run that is too short has fewer: only whole pressure cycles count.
    """
    chambers = {name: load for name, load in scene.loads.items() if load.kind in CHAMBERS}
    chamber = chambers.get(scene.robot.chamber or next(iter(chambers), ""))
    profile = chamber.profile if isinstance(chamber, FollowerPressureSpec | Pneumatic) else None
    axes = axes_of(scene)
    found = OF_RUNS | OF_BODIES
    found |= {f"body_displacement_{axis}": LENGTH for axis in axes}
    found |= {f"body_speed_{axis}": SPEED for axis in axes}
    if scene.robot.rows:
        found |= OF_ROWS
    if scene.rigid_bodies:
        found |= OF_RIGID_BODIES
        found |= {f"frame_displacement_{axis}": LENGTH for axis in axes if axis != RADIAL}
        if scene.robot.rows:
            found |= OF_ROWS_ON_RIGID_BODIES
        if profile is not None and ever_falls(profile):
            found |= OF_RIGID_BODIES_IN_CYCLES
    if scene.robot.track is not None:
        found |= OF_TRACKS
    if chambers:
        found |= OF_CHAMBERS
    if isinstance(profile, EventCyclesProfile):
        found |= OF_CONTROLLED_CYCLES
    if any(isinstance(load, TendonSpec) for load in scene.loads.values()):
        found |= OF_TENDONS
    if scene.layout is not None:
        found |= OF_LAYOUTS
    if scene.crossing is not None:
        found |= OF_CROSSINGS
    return found | of_probes(scene)


def axes_of(scene: Scene) -> tuple[str, ...]:
    """Return the components of a displacement in a scene, as suffixes of names in summary.json.

    In an axisymmetric model x is the radius, and a body lies on the axis: this component is called
    RADIAL, because it is not a position.
    """
    formulations = {body.formulation for body in scene.bodies.values()}
    if "axisymmetric" in formulations:
        return ("y", RADIAL)
    return ("x", "y", "z") if "solid" in formulations else ("x", "y")


def recorded(scene: Scene) -> dict[str, Measure]:
    """Return the columns of a run's history that a study can evaluate, by name."""
    axes = axes_of(scene)
    found = {"contact_area": AREA, "wall_force_normal": FORCE, "energy_error": NUMBER}
    found |= {"internal_energy": ENERGY, "kinetic_energy": ENERGY, "external_work": ENERGY}
    found |= {f"body_{axis}": LENGTH for axis in axes}
    found |= {f"wall_force_{axis}": FORCE for axis in axes}
    if scene.rigid_bodies:
        found |= {f"frame_{axis}": LENGTH for axis in axes}
    if any(load.kind in CHAMBERS for load in scene.loads.values()):
        found |= {"pressure": PRESSURE}
    probes = {
        column: OF_PROBES[probe.kind]
        for name, probe in scene.output.probes.items()
        for column in probe_columns(name, probe.kind, "".join(axes))
    }
    return found | probes


def of_probes(scene: Scene) -> dict[str, Measure]:
    """Return the last, lowest and highest readings of the probes of a scene."""
    in_space = any(body.formulation == "solid" for body in scene.bodies.values())
    axes = "xyz" if in_space else "xy"
    return {
        f"{of}.{column}": OF_PROBES[probe.kind]
        for of in ("probes", "probes_min", "probes_max")
        for name, probe in scene.output.probes.items()
        for column in probe_columns(name, probe.kind, axes)
    }
