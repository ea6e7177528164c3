"""What a run writes, and what it is expected to find."""

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from softsim.scene.columns import is_probe
from softsim.scene.part import Part
from softsim.scene.quantities import (
    Force,
    Length,
    Name,
    Number,
    PositiveTime,
    SetReference,
    Velocity,
    written,
)


class DisplacementProbe(Part):
    """Mean displacement of a node set: columns NAME_x, NAME_y, in space NAME_z."""

    kind: Literal["displacement"] = Field(description="What is recorded.")
    nodes: SetReference = Field(description='Node set, such as "skin.equator_outer".')


class RadiusProbe(Part):
    """Mean distance of a node set from the axis: x in space, y in an axisymmetric model."""

    kind: Literal["radius"] = Field(description="What is recorded.")
    nodes: SetReference = Field(description='Node set, such as "skin.equator_outer".')


class ReactionProbe(Part):
    """Force that holds a node set, against the rest of its body and its own weight: NAME_x, NAME_y,
    in space NAME_z.
    """

    kind: Literal["reaction"] = Field(description="What is recorded.")
    nodes: SetReference = Field(description='Node set, held or prescribed: "block.right".')


class VolumeProbe(Part):
    """Volume on the free side of facet sets, closed as a chamber's are: column NAME."""

    kind: Literal["volume"] = Field(description="What is recorded.")
    facets: tuple[SetReference, ...] = Field(
        min_length=1, description="Facet sets, such as [skin.chamber]."
    )


Probe = Annotated[
    DisplacementProbe | RadiusProbe | ReactionProbe | VolumeProbe, Field(discriminator="kind")
]


def probe_columns(name: str, kind: str, axes: str) -> list[str]:
    """Columns of a probe: its name, or one a component."""
    has_components = kind in ("displacement", "reaction")
    return [f"{name}_{a}" for a in axes] if has_components else [name]


class Output(Part):
    """What is written, how often."""

    history_interval: PositiveTime = Field(
        default=written("2 ms"), description="Time between history rows."
    )
    frame_interval: PositiveTime = Field(
        default=written("100 ms"), description="Between stored fields."
    )
    checkpoint_interval: PositiveTime = Field(
        default=written("30 s"), description="Between checkpoints, of wall time."
    )
    fields: tuple[Literal["velocity", "contact_force", "stress"], ...] = Field(
        default=(),
        description="Stored with each frame beside displacement, pressure, stretch and von Mises "
        "stress: velocity of nodes (half an increment later), force of walls on nodes, Cauchy "
        "stress of elements (xx, yy, zz, xy, yz, zx; without Maxwell branches).",
    )
    snapshot_field: Literal["displacement", "pressure", "stretch", "von_mises"] = Field(
        default="stretch", description="What colours the snapshots."
    )
    probes: dict[Name, Probe] = Field(
        default={}, description="Further columns of the history, by name."
    )

    @field_validator("probes")
    @classmethod
    def _columns_are_new(cls, probes: dict[str, Probe]) -> dict[str, Probe]:
        taken: dict[str, str] = {}
        for name, probe in probes.items():
            for column in probe_columns(name, probe.kind, "xyz"):
                owner = taken.get(column) if is_probe(column) else "the history's own"
                if owner is not None:
                    raise ValueError(
                        f"the column {column} of the probe '{name}' is {owner} already: "
                        "give the probe another name"
                    )
                taken[column] = f"that of the probe '{name}'"
        return probes


class Range(Part):
    """Limits of a value; each kind of value reads them in its own unit."""

    min: float | None = None
    max: float | None = None

    @model_validator(mode="after")
    def _limits_leave_room(self) -> "Range":
        if self.min is None and self.max is None:
            raise ValueError("gives no limit: give min, max or both")
        if self.min is not None and self.max is not None and self.min > self.max:
            raise ValueError("min must not be above max")
        return self


class LengthRange(Range):
    """Limits of a length."""

    min: Length | None = Field(default=None, description="Smallest allowed value.")
    max: Length | None = Field(default=None, description="Largest allowed value.")


class VelocityRange(Range):
    """Limits of a velocity."""

    min: Velocity | None = Field(default=None, description="Smallest allowed value.")
    max: Velocity | None = Field(default=None, description="Largest allowed value.")


class ForceRange(Range):
    """Limits of a force."""

    min: Force | None = Field(default=None, description="Smallest allowed value.")
    max: Force | None = Field(default=None, description="Largest allowed value.")


class NumberRange(Range):
    """Limits of a number."""

    min: Number | None = Field(default=None, description="Smallest allowed value.")
    max: Number | None = Field(default=None, description="Largest allowed value.")


class Expect(Part):
    """Values the scene expects of its own run; outside them the run ends with exit code 5."""

    passes: bool | None = Field(
        default=None,
        strict=True,
        description="The verdict of the layout: true, passed; false, stuck.",
    )
    exit: Name | None = Field(
        default=None, description="By which exit of the layout's pipes the robot leaves."
    )
    frame_displacement: LengthRange | None = Field(
        default=None,
        description="Displacement of the robot's frame from start to end, along x; along y where "
        "it cannot move along x.",
    )
    displacement_per_cycle: LengthRange | None = Field(
        default=None, description="The same for every pressure cycle."
    )
    mean_speed: VelocityRange | None = Field(
        default=None,
        description="Speed of the robot's frame along the same axis, over the whole pressure "
        "cycles (over the whole run without any).",
    )
    peak_pull: ForceRange | None = Field(
        default=None, description="Largest tension of the first tendon, mean of a history row."
    )
    body_displacement: LengthRange | None = Field(
        default=None,
        description="Displacement of the meshed bodies' centre of mass from start to end, along "
        "the axis of its largest displacement (`body_displacement_axis` in summary.json).",
    )
    body_displacement_x: LengthRange | None = Field(
        default=None, description="Its component along x. Not in an axisymmetric model."
    )
    body_displacement_y: LengthRange | None = Field(
        default=None, description="Its component along y."
    )
    body_displacement_z: LengthRange | None = Field(
        default=None, description="Its component along z. In space only."
    )
    body_speed: VelocityRange | None = Field(
        default=None,
        description="Speed along the axis of body_displacement, mean over the last tenth of the "
        "run.",
    )
    rows_in_contact: NumberRange | None = Field(
        default=None, description="Most rows of spikes that touched at a time."
    )
    energy_error: NumberRange | None = Field(
        default=None, description="Largest error of the energy balance."
    )
