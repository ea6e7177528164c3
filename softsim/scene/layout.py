"""The question that a layout of pipes asks: does the robot get through?"""

from pydantic import Field

from softsim.scene.part import Part
from softsim.scene.quantities import (
    Name,
    PositiveLength,
    PositiveTime,
    Text,
    WholeNumber,
    written,
)


class Layout(Part):
    """Asks whether a rigid body gets through a pipe. The run ends as soon as that is answered."""

    path: Name | None = Field(
        default=None, description="Wall of kind pipe_path; the only one by default."
    )
    body: Text | None = Field(
        default=None, description="Rigid body that has to pass; the first by default."
    )
    goal: PositiveLength | None = Field(
        default=None,
        description="Arc length along the path that its centre must reach. By default it has "
        "passed when its whole outline lies in the last segment, or, where that is no longer than "
        "the outline, when its front is at the end of the path.",
    )
    patience: WholeNumber = Field(
        default=2,
        ge=1,
        description="Pressure cycles without progress after which it counts as stuck.",
    )
    patience_time: PositiveTime = Field(
        default=written("3 s"), description="The same where the pressure has no cycles."
    )
    least_progress: PositiveLength = Field(
        default=written("5 mm"),
        description="What it must gain within that to count as progress. As the air leaves, it is "
        "drawn back by 1 to 2 mm and springs forward again.",
    )
