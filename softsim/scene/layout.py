"""Test whether a robot passes a layout of pipes."""

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
    """Test whether a rigid body passes a pipe. The run ends as soon as it has
    passed or is stuck.
    """

    path: Name | None = Field(
        default=None, description="Wall of kind pipe_path. Default: the only one."
    )
    body: Text | None = Field(
        default=None, description="Rigid body that has to pass. Default: the first one."
    )
    goal: PositiveLength | None = Field(
        default=None,
        description="Arc length along the path that the body's centre must reach. Default: the "
        "body has passed when its outline lies entirely in the last segment or, if that is not "
        "longer than the outline, when its front is at the end of the path.",
    )
    patience: WholeNumber = Field(
        default=2,
        ge=1,
        description="Number of pressure cycles without progress after which the body counts as "
        "stuck.",
    )
    patience_time: PositiveTime = Field(
        default=written("3 s"),
        description="Time without progress after which the body counts as stuck, if the pressure "
        "has no cycles.",
    )
    least_progress: PositiveLength = Field(
        default=written("5 mm"),
        description="Distance that counts as progress. During deflation a robot is drawn back by "
        "1 to 2 mm and springs forward again.",
    )
