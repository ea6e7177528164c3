"""Output of a run, and expected limits of its results."""

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from softsim.scene.quantities import (
    Force,
    Length,
    Name,
    Number,
    PositiveTime,
    SetReference,
    Spec,
    Text,
    Velocity,
    is_probe,
    written,
)


class DisplacementProbe(Spec):
    """Mean displacement of a node set. History columns NAME_x, NAME_y and in 3D NAME_z."""

    kind: Literal["displacement"] = Field(description="Kind of probe.")
    nodes: SetReference = Field(description='Node set, such as "skin.equator_outer".')


class RadiusProbe(Spec):
    """Mean distance of a node set from the axis (x in 3D, y in an axisymmetric
    model). History column NAME.
    """

    kind: Literal["radius"] = Field(description="Kind of probe.")
    nodes: SetReference = Field(description='Node set, such as "skin.equator_outer".')


class RotationProbe(Spec):
    """Mean rotation of a node set about its centre, for example of the tip of a finger. History
    column NAME, in 2D: the angle about z between -180 and 180 degrees; in 3D the columns NAME_x,
    NAME_y, NAME_z: the rotation vector.
    """

    kind: Literal["rotation"] = Field(description="Kind of probe.")
    nodes: SetReference = Field(description='Node set, such as "finger.tip".')


class ReactionProbe(Spec):
    """Reaction force on a fixed or prescribed node set, against the rest of its body and its own
    weight. History columns NAME_x, NAME_y and in 3D NAME_z.
    """

    kind: Literal["reaction"] = Field(description="Kind of probe.")
    nodes: SetReference = Field(description='Fixed or prescribed node set: "block.right".')


class VolumeProbe(Spec):
    """Volume on the free side of facet sets, closed like a chamber. History column NAME."""

    kind: Literal["volume"] = Field(description="Kind of probe.")
    facets: tuple[SetReference, ...] = Field(
        min_length=1, description="Facet sets, such as [skin.chamber]."
    )


Probe = Annotated[
    DisplacementProbe | RotationProbe | RadiusProbe | ReactionProbe | VolumeProbe,
    Field(discriminator="kind"),
]


def probe_columns(name: str, kind: str, axes: str) -> list[str]:
    """Return the history columns of a probe: its name, or one per component."""
    has_components = kind in ("displacement", "reaction") or (kind == "rotation" and len(axes) == 3)
    return [f"{name}_{a}" for a in axes] if has_components else [name]


class Derivatives(Spec):
    """Derivatives of the columns of the history with respect to numbers of the scene. They are
    computed at equilibria of a static run by Newton's method, and stand in summary.json.
    """

    parameters: tuple[Text, ...] = Field(
        min_length=1,
        description="Paths of numbers of the scene, as in --set: materials.rubber.C10. A dimension "
        "of a mesh must not change the number of its elements.",
    )
    at: tuple[PositiveTime, ...] = Field(
        default=(),
        description="Load times; taken is the last row of the history up to each of them. Default: "
        "the last row of the run.",
    )


class Output(Spec):
    """Results to write, and how often."""

    history_interval: PositiveTime = Field(
        default=written("2 ms"), description="Simulated time between rows of history.csv."
    )
    frame_interval: PositiveTime = Field(
        default=written("100 ms"),
        description="Simulated time between stored fields (frames). A dynamic run stores them with "
        "rows, so it should be a multiple of `history_interval`.",
    )
    checkpoint_interval: PositiveTime = Field(
        default=written("30 s"), description="Wall time between checkpoints."
    )
    fields: tuple[Literal["velocity", "contact_force", "stress"], ...] = Field(
        default=(),
        description="Fields stored in each frame in addition to displacement, pressure, stretch "
        "and von Mises stress. velocity: of the nodes, half a time step later. contact_force: of "
        "walls on nodes. stress: Cauchy stress of the elements (xx, yy, zz, xy, yz, zx; without "
        "Maxwell branches).",
    )
    snapshot_field: Literal["displacement", "pressure", "stretch", "von_mises"] = Field(
        default="stretch", description="Field that colours the snapshots."
    )
    probes: dict[Name, Probe] = Field(
        default={}, description="Additional columns of the history, by name."
    )
    derivatives: Derivatives | None = Field(
        default=None, description="Derivatives in a static run. Default: none."
    )

    @field_validator("probes")
    @classmethod
    def _columns_are_new(cls, probes: dict[str, Probe]) -> dict[str, Probe]:
        taken: dict[str, str] = {}
        for name, probe in probes.items():
            in_plane, in_space = (probe_columns(name, probe.kind, axes) for axes in ("xy", "xyz"))
            for column in dict.fromkeys(in_plane + in_space):
                owner = taken.get(column) if is_probe(column) else "the history's own"
                if owner is not None:
                    raise ValueError(
                        f"the column {column} of the probe '{name}' is {owner} already: "
                        "give the probe another name"
                    )
                taken[column] = f"that of the probe '{name}'"
        return probes


class Range(Spec):
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

    min: Length | None = Field(default=None, description="Lower limit.")
    max: Length | None = Field(default=None, description="Upper limit.")


class VelocityRange(Range):
    """Limits of a velocity."""

    min: Velocity | None = Field(default=None, description="Lower limit.")
    max: Velocity | None = Field(default=None, description="Upper limit.")


class ForceRange(Range):
    """Limits of a force."""

    min: Force | None = Field(default=None, description="Lower limit.")
    max: Force | None = Field(default=None, description="Upper limit.")


class NumberRange(Range):
    """Limits of a number."""

    min: Number | None = Field(default=None, description="Lower limit.")
    max: Number | None = Field(default=None, description="Upper limit.")


class Expect(Spec):
    """Limits of results. If a result of the run is outside its limits, the exit code is 5."""

    passes: bool | None = Field(
        default=None,
        strict=True,
        description="Verdict on the layout. true: passed. false: stuck.",
    )
    exit: Name | None = Field(
        default=None,
        description="Name of the exit of the branched pipes by which the robot leaves.",
    )
    frame_displacement: LengthRange | None = Field(
        default=None,
        description="Displacement of the robot's frame from start to end, along x, or along y if "
        "it cannot move along x.",
    )
    displacement_per_cycle: LengthRange | None = Field(
        default=None,
        description="Displacement of the robot's frame in each pressure cycle, along the same "
        "axis.",
    )
    mean_speed: VelocityRange | None = Field(
        default=None,
        description="Mean speed of the robot's frame along the same axis over all complete "
        "pressure cycles, or over the whole run if there are none.",
    )
    peak_pull: ForceRange | None = Field(
        default=None,
        description="Largest tension of the first tendon, as a mean over a history row.",
    )
    body_displacement: LengthRange | None = Field(
        default=None,
        description="Displacement of the deformable bodies' centre of mass from start to end, "
        "along the axis with the largest displacement (`body_displacement_axis` in summary.json).",
    )
    body_displacement_x: LengthRange | None = Field(
        default=None,
        description="Component of body_displacement along x. Not in an axisymmetric model.",
    )
    body_displacement_y: LengthRange | None = Field(
        default=None, description="Component of body_displacement along y."
    )
    body_displacement_z: LengthRange | None = Field(
        default=None, description="Component of body_displacement along z. In 3D only."
    )
    body_speed: VelocityRange | None = Field(
        default=None,
        description="Mean speed along the axis of body_displacement over the last tenth of the "
        "run.",
    )
    rows_in_contact: NumberRange | None = Field(
        default=None, description="Largest number of rows in contact at the same time."
    )
    energy_error: NumberRange | None = Field(
        default=None, description="Largest relative error of the energy balance."
    )
