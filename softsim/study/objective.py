"""What an optimisation seeks, as a study file says it."""

from typing import Annotated, Any

from pydantic import Field, model_validator

from softsim.scene.part import Part
from softsim.scene.quantities import Name, Number, WholeNumber

References = Annotated[dict[Name, Any], Field(min_length=1)]


class Prune(Part):
    """Trials that promise little are stopped early. At every tenth of its run a trial is held
    against the finished ones at the same tenth: it goes on unless its objective has always been
    worse than their median. The tenths are those of the time, or of `time.cycles`. It suits a
    measure that tells early how it will end, such as a mean speed.
    """

    after_trials: WholeNumber = Field(
        default=5, ge=1, description="So many trials run to their end before any is stopped."
    )
    after_share: Number = Field(
        default=0.3, ge=0.0, lt=1.0, description="Share of its run that every trial is given."
    )


class Objective(Part):
    """The best values of the factors: one of `maximize`, `minimize`, `match`. Each trial is one
    run, without `repeats`.
    """

    maximize: Name | None = Field(default=None, description="Measure that should be large.")
    minimize: Name | None = Field(default=None, description="Measure that should be small.")
    match: References | None = Field(
        default=None,
        description="Measure -> reference value, with its unit: {speed: 25 mm/s}. Small should be "
        "the column `mismatch`, the sum of ((measure - reference) / scale)^2.",
    )
    scale: References = Field(
        default={},
        validate_default=False,
        description="Measure -> deviation that counts as 1, such as {speed: 2 mm/s}; by default "
        "the reference value itself.",
    )
    trials: WholeNumber = Field(ge=1, description="How many cases are tried.")
    seed: Annotated[WholeNumber, Field(ge=0)] = Field(
        default=1, description="Of the random numbers."
    )
    prune: Prune | None = Field(
        default=None,
        description="Stop trials early that promise little; by default all run to their end.",
    )

    @model_validator(mode="after")
    def _one_goal(self) -> "Objective":
        if sum(goal is not None for goal in (self.maximize, self.minimize, self.match)) != 1:
            raise ValueError("needs one of maximize, minimize, match")
        stray = [name for name in self.scale if name not in (self.match or {})]
        if stray:
            raise ValueError(f"scale: {stray[0]} is not matched")
        return self
