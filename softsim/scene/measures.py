"""Units of measures, and the parts and columns of a scene's runs that are known before a run.

The measures themselves are in `analysis/catalogue.py`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from softsim.scene.loads import FollowerPressureSpec, Pneumatic, TendonSpec
from softsim.scene.outputs import probe_columns
from softsim.scene.profiles import EventCyclesProfile, ever_falls
from softsim.scene.quantities import COLUMNS
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


LENGTH, SPEED = Measure("m"), Measure("m/s")
FORCE, TIME, FREQUENCY, AREA = Measure("N"), Measure("s"), Measure("Hz"), Measure("m^2")
NUMBER, LABEL, SHARE = Measure(), Measure(is_label=True), Measure(is_share=True)
CYCLES, NODES, ROWS = "pressure cycle", "node", "row"
LENGTHS, PRESSURES = Measure("m", listed=CYCLES), Measure("Pa", listed=CYCLES)

WITHOUT_DERIVATIVE = frozenset(n for n, column in COLUMNS.items() if not column.has_derivative)
"""Columns that are counts, errors, or sums over the load steps."""

OF_PROBES = {
    "displacement": LENGTH,
    "rotation": Measure("rad"),
    "radius": LENGTH,
    "reaction": FORCE,
    "volume": Measure("m^3"),
}
CHAMBERS = ("follower_pressure", "added_volume", "added_gas", "pneumatic")


class Part(Enum):
    """Part of a scene on which it depends which measures its runs have.

    X, Y, Z: axes along which bodies move. In an axisymmetric model x is the radius, and a body lies
    on the axis y: RADIAL stands for the mean radius, because it is not a position. CYCLES: falls of
    the pressure in the robot's chamber. CONTROL: cycles of that pressure by events.
    """

    X = "x"
    Y = "y"
    Z = "z"
    RADIAL = "radial"
    FRAME = "frame"
    ROWS = "rows"
    TRACK = "track"
    CHAMBER = "chamber"
    CYCLES = "cycles"
    CONTROL = "control"
    TENDON = "tendon"
    LAYOUT = "layout"
    CROSSING = "crossing"


def chosen(parts: Mapping[Part, bool]) -> frozenset[Part]:
    """Return the parts that are there."""
    return frozenset(part for part, is_there in parts.items() if is_there)


def parts_of(scene: Scene) -> frozenset[Part]:
    """Return the parts of a scene."""
    formulations = {body.formulation for body in scene.bodies.values()}
    chambers = {name: load for name, load in scene.loads.items() if load.kind in CHAMBERS}
    chamber = chambers.get(scene.robot.chamber or next(iter(chambers), ""))
    profile = chamber.profile if isinstance(chamber, FollowerPressureSpec | Pneumatic) else None
    return chosen(
        {
            Part.X: "axisymmetric" not in formulations,
            Part.Y: True,
            Part.Z: "solid" in formulations,
            Part.RADIAL: "axisymmetric" in formulations,
            Part.FRAME: bool(scene.rigid_bodies),
            Part.ROWS: bool(scene.robot.rows),
            Part.TRACK: scene.robot.track is not None,
            Part.CHAMBER: bool(chambers),
            Part.CYCLES: profile is not None and ever_falls(profile),
            Part.CONTROL: isinstance(profile, EventCyclesProfile),
            Part.TENDON: any(isinstance(load, TendonSpec) for load in scene.loads.values()),
            Part.LAYOUT: scene.layout is not None,
            Part.CROSSING: scene.crossing is not None,
        }
    )


def recorded(scene: Scene) -> dict[str, Measure]:
    """Return the columns of a run's history that a study can evaluate, by name."""
    parts, axes = parts_of(scene), axes_of(scene)
    names = ["contact_area", "wall_force_normal", "energy_error"]
    names += ["internal_energy", "kinetic_energy", "external_work"]
    names += [f"body_{axis}" for axis in axes] + [f"wall_force_{axis}" for axis in axes]
    if Part.FRAME in parts:
        names += [f"frame_{axis}" for axis in axes]
    if Part.CHAMBER in parts:
        names.append("pressure")
    columns = {name: Measure(COLUMNS[name].unit.removeprefix("-")) for name in names}
    return columns | probe_readings(scene)


def axes_of(scene: Scene) -> str:
    """Return the axes of the coordinates of a scene: "xy" or "xyz"."""
    return "xyz" if Part.Z in parts_of(scene) else "xy"


def probe_readings(scene: Scene) -> dict[str, Measure]:
    """Return the columns of the probes of a scene."""
    return {
        column: OF_PROBES[probe.kind]
        for name, probe in scene.output.probes.items()
        for column in probe_columns(name, probe.kind, axes_of(scene))
    }
