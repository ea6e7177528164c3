"""The question whether a body crosses its ground."""

from pydantic import Field

from softsim.scene.part import Part
from softsim.scene.quantities import Length, Text


class Crossing(Part):
    """Asks whether a body gets over its ground, along x, before `time.end`. The run ends when it
    has.
    """

    body: Text | None = Field(default=None, description="Which; the first by default.")
    goal: Length | None = Field(
        default=None,
        description="x that its rear end must be past; by default the upper edge of a ramp, the "
        "far foot of a semicircle, the end of a field of steps, where the scene has one of them.",
    )
