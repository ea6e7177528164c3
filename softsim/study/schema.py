"""The vocabulary of a study: every key, its meaning.

A study names a scene, what varies in it, what is collected of each run, what is drawn, and what an
optimisation seeks. Values are written as in a scene, with units.
"""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, Tag, WithJsonSchema, model_validator

from softsim.scene.part import Part, told_by_key
from softsim.scene.quantities import Name, Number, Text, WholeNumber


def _number_or_text(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError('must be a number, a quantity such as "3 mm", or a text')
    return value


Scalar = Annotated[
    Any, AfterValidator(_number_or_text), WithJsonSchema({"type": ["number", "string"]})
]
References = Annotated[dict[Name, Any], Field(min_length=1)]
Seed = Annotated[WholeNumber, Field(ge=0)]
About = Annotated[Text, Field(description="What it is, in words: for axes and headings.")]


class KeyFactor(Part):
    """One key of the scene. An even spacing has its ends in `range`, or in `log_range`."""

    key: Text = Field(description='Path of a key, as --set has it: "time.end".')
    values: tuple[Scalar, ...] | None = Field(
        default=None, min_length=1, description="Its values, one by one."
    )
    range: tuple[Scalar, Scalar] | None = Field(
        default=None, description="Its lowest and highest value, evenly spaced between them."
    )
    log_range: tuple[Scalar, Scalar] | None = Field(
        default=None, description="The same in equal ratios; both are greater than 0."
    )
    count: WholeNumber | None = Field(
        default=None,
        ge=2,
        le=100_000,
        description="How many values a range has. A grid needs it; without it the other designs, "
        "and optimize, take any value in the range.",
    )
    about: About = ""


class VariantsFactor(Part):
    """Several keys at once, under a label."""

    variants: Annotated[dict[Text, dict[Text, Any]], Field(min_length=1)] = Field(
        description="Label -> what it sets: {as_is: {}, thin: {PATH: VALUE, ...}, thick: {...}}."
    )
    about: About = ""


class ScenesFactor(Part):
    """Another scene, under a label."""

    scenes: Annotated[dict[Text, Text], Field(min_length=1)] = Field(
        description="Label -> scene file, relative to the study's."
    )
    about: About = ""


FACTORS: dict[str, type[Part]] = {
    "key": KeyFactor, "variants": VariantsFactor, "scenes": ScenesFactor,
}  # fmt: skip


FactorPart = Annotated[
    Annotated[KeyFactor, Tag("key")]
    | Annotated[VariantsFactor, Tag("variants")]
    | Annotated[ScenesFactor, Tag("scenes")],
    told_by_key(FACTORS),
]


class GridDesign(Part):
    """Every value of each factor with every value of the others; the last factor varies fastest."""

    kind: Literal["grid"] = Field(description="Kind of design.")


class ListDesign(Part):
    """Cases one by one."""

    kind: Literal["list"] = Field(description="Kind of design.")
    cases: tuple[dict[Text, Scalar], ...] = Field(
        min_length=1, description="A value of each factor: [{rate: 1 kPa/s, pipe: 36 mm}, ...]."
    )


class LatinHypercubeDesign(Part):
    """Random cases of which each factor's values fill its range evenly, one in each of `count`
    equal parts.
    """

    kind: Literal["latin_hypercube"] = Field(description="Kind of design.")
    count: WholeNumber = Field(ge=1, description="Number of cases.")
    seed: Seed = Field(default=1, description="Of the random numbers.")


class SobolDesign(Part):
    """A scrambled Sobol sequence: cases that fill the space of all factors evenly."""

    kind: Literal["sobol"] = Field(description="Kind of design.")
    count: WholeNumber = Field(
        ge=1, description="Number of cases, a power of two: the sequence is even only there."
    )
    seed: Seed = Field(default=1, description="Of the scrambling.")


class BisectionDesign(Part):
    """The boundary at which a measure crosses a share, sought over the range of one factor for all
    combinations of the values of the others. Both ends are asked first; then the bracket is halved.
    """

    kind: Literal["bisection"] = Field(description="Kind of design.")
    factor: Name = Field(description="Factor that is bisected; it has a range without a count.")
    measure: Name = Field(
        description="Measure from 0 to 1, such as `of: crossing.passed`, of which the mean over "
        "the repeats crosses the share once in that range."
    )
    tolerance: Scalar = Field(description="Width of the bracket at the end, such as 1 mm.")
    share: Number = Field(default=0.5, gt=0.0, lt=1.0, description="What it crosses.")


PointDesign = GridDesign | ListDesign | LatinHypercubeDesign | SobolDesign
"""Designs of which all points are known before anything runs."""

Design = Annotated[PointDesign | BisectionDesign, Field(discriminator="kind")]


class Repeats(Part):
    """Each case several times, with what is not known for sure drawn at random.

    Repeat 1 is a draw like the others. Repeat n has the same draws in all cases, so that cases
    differ by their factors alone, and keeps them when there are to be more repeats.
    """

    count: WholeNumber = Field(ge=1, description="How often each case is run.")
    seed: Seed = Field(default=1, description="Of the random numbers.")
    perturb: Annotated[dict[Text, Scalar], Field(min_length=1)] = Field(
        description="Path of a key -> standard deviation of the normal distribution about its "
        'value: "10 %" of it, or "0.1 mm".'
    )


class MeasurePart(Part):
    """A column of the table, read from the summary or the history of each run."""

    of: Text = Field(
        description='Name in summary.json, dotted into mappings: "layout.verdict"; with `take` '
        'also a column of history.csv, such as "body_x".'
    )
    take: Literal["first", "last", "mean", "min", "max", "slope"] | None = Field(
        default=None,
        description="Which of a list, with a number a pressure cycle, node or row, or of a column "
        "of the history; slope, of a column: its rate over time, by least squares.",
    )
    begin: Scalar | None = Field(
        default=None, alias="from", description="Of a column: time of the first row, such as 0.3 s."
    )
    to: Scalar | None = Field(default=None, description="Of a column: time of the last row.")
    unit: Text | None = Field(
        default=None, description="In which it is shown, such as mm; a usual one by default."
    )
    about: About = ""


class CurvePlot(Part):
    """A measure over a factor or another measure; repeats as mean and band of 3 deviations."""

    kind: Literal["curve"] = Field(description="Kind of plot.")
    x: Name = Field(description="Factor or measure.")
    y: Name = Field(description="Measure.")
    by: Name | None = Field(default=None, description="Factor of which each value has a curve.")


class HeatMapPlot(Part):
    """A measure over two factors."""

    kind: Literal["heat_map"] = Field(description="Kind of plot.")
    x: Name = Field(description="Factor.")
    y: Name = Field(description="Factor.")
    colour: Name = Field(description="Measure.")


class ScatterPlot(Part):
    """A point a case."""

    kind: Literal["scatter"] = Field(description="Kind of plot.")
    x: Name = Field(description="Factor or measure.")
    y: Name = Field(description="Factor or measure.")
    colour: Name | None = Field(default=None, description="Factor or measure.")


PlotPart = Annotated[CurvePlot | HeatMapPlot | ScatterPlot, Field(discriminator="kind")]


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
    trials: WholeNumber | None = Field(
        default=None, ge=1, description="How many cases are tried; --trials wins over it."
    )
    seed: Seed = Field(default=1, description="Of the random numbers.")
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


class Study(Part):
    """A scene, what varies in it, what is collected of each run."""

    title: Text = Field(default="", description="One line for people.")
    scene: Text | None = Field(
        default=None, description="Scene file, relative to this one; or a factor has `scenes`."
    )
    robot: Text | None = Field(
        default=None, description="Standard robot that is put into the scene, a bare layout."
    )
    model: Literal["finite_elements", "chain"] = Field(
        default="finite_elements", description="What scene files are of: chain, those that "
        "`softsim chain` takes."
    )  # fmt: skip
    set: dict[Text, Any] = Field(
        default={}, description="What all cases share: {PATH: VALUE}, as --set has it."
    )
    factors: Annotated[dict[Name, FactorPart], Field(min_length=1)] = Field(
        description="What varies, by name."
    )
    design: Design | None = Field(
        default=None, description="Which values are put together; a grid by default."
    )
    repeats: Repeats | None = Field(
        default=None, description="Each case several times, perturbed; once by default."
    )
    measures: Annotated[dict[Name, MeasurePart], Field(min_length=1)] = Field(
        description="What is collected of each run, by name."
    )
    plots: tuple[PlotPart, ...] | None = Field(
        default=None, description="What is drawn; chosen by the factors by default."
    )
    optimize: Objective | None = Field(
        default=None, description="What `softsim optimize` seeks, by choosing the factors."
    )
    keep: Literal["thin", "everything"] = Field(
        default="thin", description="thin: of each run its summary and about 1,000 rows of its "
        "history; everything: also fields and checkpoint."
    )  # fmt: skip

    @property
    def repeat_count(self) -> int:
        """How often each case is run."""
        return self.repeats.count if self.repeats is not None else 1


def study_json_schema() -> dict[str, Any]:
    """JSON schema of a study file, so that an editor completes and checks its keys."""
    return Study.model_json_schema()
