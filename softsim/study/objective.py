"""What an optimisation seeks."""

from typing import Annotated, Any

from pydantic import Field, model_validator

from softsim.scene.part import Part
from softsim.scene.quantities import Name, WholeNumber


class Objective(Part):
    """The best values of the factors: one of `maximize`, `minimize`, `match`."""

    maximize: Name | None = Field(default=None, description="Measure that should be large.")
    minimize: Name | None = Field(default=None, description="Measure that should be small.")
    match: Annotated[dict[Name, Any], Field(min_length=1)] | None = Field(
        default=None, description="Measure -> reference value, with its unit: {speed: 25 mm/s}."
    )
    trials: WholeNumber = Field(ge=1, description="How many cases are tried.")
    seed: Annotated[WholeNumber, Field(ge=0)] = Field(
        default=1, description="Of the random numbers."
    )

    @model_validator(mode="after")
    def _one_goal(self) -> "Objective":
        if sum(goal is not None for goal in (self.maximize, self.minimize, self.match)) != 1:
            raise ValueError("needs one of maximize, minimize, match")
        return self
