"""Keys of a study and their meaning; columns and plots of its table.

A study names a scene, what varies in it, what is collected of each run, what is drawn, and what an
optimisation seeks. Values are written as in a scene, with units.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, Tag, WithJsonSchema, model_validator

from softsim.applications import STUDY_MODELS
from softsim.errors import SceneError
from softsim.scene.quantities import (
    Name,
    Number,
    Spec,
    Text,
    WholeNumber,
    chosen_by_key,
    json_schema,
)
from softsim.scene.reporting import did_you_mean
from softsim.scene.text import Tree, child, listed


def _number_or_text(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError('must be a number, a quantity such as "3 mm", or a text')
    return value


MODELS = ("finite_elements", *STUDY_MODELS)
"""Values of `model`: the engine and the applications whose files a study can run."""


def _one_of_models(model: str) -> str:
    if model not in MODELS:
        raise ValueError(f"{model!r} is not one of: {', '.join(MODELS)}")
    return model


StudyModel = Annotated[
    Text,
    AfterValidator(_one_of_models),
    WithJsonSchema({"enum": list(MODELS), "type": "string"}),
]
Scalar = Annotated[
    Any, AfterValidator(_number_or_text), WithJsonSchema({"type": ["number", "string"]})
]
References = Annotated[dict[Name, Any], Field(min_length=1)]
Seed = Annotated[WholeNumber, Field(ge=0)]
About = Annotated[Text, Field(description="Label for axes and headings.")]


class KeyFactor(Spec):
    """Factor that sets one key of the scene to given values, or to values in a range."""

    key: Text = Field(description='Path of the key, as in --set: "time.end".')
    values: tuple[Scalar, ...] | None = Field(
        default=None, min_length=1, description="List of values."
    )
    range: tuple[Scalar, Scalar] | None = Field(
        default=None,
        description="Lowest and highest value, with equal differences between the values.",
    )
    log_range: tuple[Scalar, Scalar] | None = Field(
        default=None,
        description="Lowest and highest value, both positive, with equal ratios between the "
        "values.",
    )
    count: WholeNumber | None = Field(
        default=None,
        ge=2,
        le=100_000,
        description="Number of values in the range. Required for a grid. Without it the other "
        "designs, and optimize, use any value in the range.",
    )
    about: About = ""


class VariantsFactor(Spec):
    """Factor that sets several keys at once, by label."""

    variants: Annotated[dict[Text, dict[Text, Any]], Field(min_length=1)] = Field(
        description="Label -> keys to set: {as_is: {}, thin: {PATH: VALUE, ...}, thick: {...}}."
    )
    about: About = ""


class ScenesFactor(Spec):
    """Factor that chooses a scene file, by label."""

    scenes: Annotated[dict[Text, Text], Field(min_length=1)] = Field(
        description="Label -> scene file, relative to the study's file."
    )
    about: About = ""


FACTORS: dict[str, type[Spec]] = {
    "key": KeyFactor, "variants": VariantsFactor, "scenes": ScenesFactor,
}  # fmt: skip


FactorPart = Annotated[
    Annotated[KeyFactor, Tag("key")]
    | Annotated[VariantsFactor, Tag("variants")]
    | Annotated[ScenesFactor, Tag("scenes")],
    chosen_by_key(FACTORS),
]


class GridDesign(Spec):
    """Full grid: all combinations of the values of the factors. The last factor
    varies fastest.
    """

    kind: Literal["grid"] = Field(description="Kind of design.")


class ListDesign(Spec):
    """List of cases."""

    kind: Literal["list"] = Field(description="Kind of design.")
    cases: tuple[dict[Text, Scalar], ...] = Field(
        min_length=1,
        description="Cases with a value of each factor: [{rate: 1 kPa/s, pipe: 36 mm}, ...].",
    )


class LatinHypercubeDesign(Spec):
    """Latin hypercube: random cases with one value of each factor in each of
    `count` equal intervals of its range.
    """

    kind: Literal["latin_hypercube"] = Field(description="Kind of design.")
    count: WholeNumber = Field(ge=1, description="Number of cases.")
    seed: Seed = Field(default=1, description="Seed of the random numbers.")


class SobolDesign(Spec):
    """Scrambled Sobol sequence, which fills the space of the factors evenly."""

    kind: Literal["sobol"] = Field(description="Kind of design.")
    count: WholeNumber = Field(ge=1, description="Number of cases, a power of two.")
    seed: Seed = Field(default=1, description="Seed of the scrambling.")


class BisectionDesign(Spec):
    """Bisection: finds the value of one factor at which a measure crosses a threshold, for all
    combinations of the other factors. Both ends of the range are run first, then the interval is
    halved.
    """

    kind: Literal["bisection"] = Field(description="Kind of design.")
    factor: Name = Field(description="Factor that is bisected. It has a range without a count.")
    measure: Name = Field(
        description="Measure between 0 and 1, such as `of: crossing.passed`. Its mean over the "
        "repeats crosses the threshold once in the range."
    )
    tolerance: Scalar = Field(description="Width of the final interval, such as 1 mm.")
    share: Number = Field(default=0.5, gt=0.0, lt=1.0, description="Threshold.")


PointDesign = GridDesign | ListDesign | LatinHypercubeDesign | SobolDesign
"""Designs of which all points are known before anything runs."""

Design = Annotated[PointDesign | BisectionDesign, Field(discriminator="kind")]


class Repeats(Spec):
    """Repeated runs of each case with random perturbations. Repeat n has the same perturbations in
    all cases, so that cases differ only by their factors; they do not change when `count` is
    increased. Repeat 1 is perturbed like the others.
    """

    count: WholeNumber = Field(ge=1, description="Number of runs of each case.")
    seed: Seed = Field(default=1, description="Seed of the random numbers.")
    perturb: Annotated[dict[Text, Scalar], Field(min_length=1)] = Field(
        description="Path of a key -> standard deviation of a normal distribution about its "
        'value, relative ("10 %") or absolute ("0.1 mm"). "spread" for a material, such as '
        "materials.skin, draws its initial shear modulus."
    )


class MeasurePart(Spec):
    """Result of each run that is collected in the table, from summary.json or history.csv."""

    of: Text = Field(
        description='Name in summary.json, with dots for nested names: "layout.verdict"; with '
        '`take` also a column of history.csv, such as "body_x".'
    )
    take: Literal["first", "last", "mean", "min", "max", "slope"] | None = Field(
        default=None,
        description="Reduction of a list (one number per pressure cycle, node or row) or of a "
        "history column to one number. slope: rate of change of a column, by least squares.",
    )
    begin: Scalar | None = Field(
        default=None,
        alias="from",
        description="Start of the time interval in which a history column is evaluated, such as "
        "0.3 s.",
    )
    to: Scalar | None = Field(
        default=None, description="End of the time interval in which a history column is evaluated."
    )
    unit: Text | None = Field(
        default=None,
        description="Unit in which the measure is shown, such as mm. Default: a usual one.",
    )
    about: About = ""


class CurvePlot(Spec):
    """Curve of a measure over a factor or another measure. Repeats are drawn as the
    mean with a band of 3 standard deviations.
    """

    kind: Literal["curve"] = Field(description="Kind of plot.")
    x: Name = Field(description="Factor or measure on the horizontal axis.")
    y: Name = Field(description="Measure on the vertical axis.")
    by: Name | None = Field(
        default=None, description="Factor; one curve is drawn for each of its values."
    )


class HeatMapPlot(Spec):
    """Heat map of a measure over two factors."""

    kind: Literal["heat_map"] = Field(description="Kind of plot.")
    x: Name = Field(description="Factor on the horizontal axis.")
    y: Name = Field(description="Factor on the vertical axis.")
    colour: Name = Field(description="Measure that is shown as colour.")


class ScatterPlot(Spec):
    """Scatter plot with one point per case."""

    kind: Literal["scatter"] = Field(description="Kind of plot.")
    x: Name = Field(description="Factor or measure on the horizontal axis.")
    y: Name = Field(description="Factor or measure on the vertical axis.")
    colour: Name | None = Field(
        default=None, description="Factor or measure that is shown as colour."
    )


PlotPart = Annotated[CurvePlot | HeatMapPlot | ScatterPlot, Field(discriminator="kind")]


class Prune(Spec):
    """Early stopping of poor trials. At every tenth of its duration (of the time or of
    `time.cycles`) a trial is compared with the finished trials at the same point. It is stopped if
    its objective has so far always been worse than their median. This suits measures that indicate
    their final value early, such as a mean speed.
    """

    after_trials: WholeNumber = Field(
        default=5,
        ge=1,
        description="Number of trials that are completed before any trial is stopped.",
    )
    after_share: Number = Field(
        default=0.3, ge=0.0, lt=1.0, description="Fraction of its run that every trial completes."
    )


class Objective(Spec):
    """Objective of an optimisation: one of `maximize`, `minimize` and `match`. Each
    trial is one run, without `repeats`.
    """

    maximize: Name | None = Field(default=None, description="Measure to maximise.")
    minimize: Name | None = Field(default=None, description="Measure to minimise.")
    match: References | None = Field(
        default=None,
        description="Measure -> target value with its unit: {speed: 25 mm/s}. The column "
        "`mismatch`, the sum of ((measure - target) / scale)^2, is minimised.",
    )
    scale: References = Field(
        default={},
        validate_default=False,
        description="Measure -> deviation from the target that counts as 1, such as {speed: 2 "
        "mm/s}. Default: the target value.",
    )
    method: Literal["sampling", "gradient"] = Field(
        default="sampling",
        description="sampling: trials where earlier ones were good (tree-structured Parzen "
        "estimator), for any objective. gradient: trials one after the other by the derivatives "
        "of the measures (L-BFGS-B), from the values of the scene on. It needs a static scene, "
        "factors with a range, and measures with `take: last` of a column of the history.",
    )
    trials: WholeNumber | None = Field(
        default=None, ge=1, description="Number of trials; the option --trials overrides it."
    )
    seed: Seed = Field(default=1, description="Seed of the random numbers.")
    prune: Prune | None = Field(
        default=None,
        description="Early stopping of poor trials. Default: all trials are completed.",
    )

    @model_validator(mode="after")
    def _one_goal(self) -> "Objective":
        if sum(goal is not None for goal in (self.maximize, self.minimize, self.match)) != 1:
            raise ValueError("needs one of maximize, minimize, match")
        stray = [name for name in self.scale if name not in (self.match or {})]
        if stray:
            raise ValueError(f"scale: {stray[0]} is not matched")
        return self


class StudySpec(Spec):
    """Parameter study: a scene, factors that vary, and measures that are collected
    from each run.
    """

    title: Text = Field(default="", description="Title of the report, one line.")
    scene: Text | None = Field(
        default=None,
        description="Scene file, relative to the study's file. Not needed if a factor has "
        "`scenes`.",
    )
    robot: Text | None = Field(
        default=None,
        description="Standard robot that is added to the scene, which is then a layout.",
    )
    model: StudyModel = Field(
        default="finite_elements",
        description="finite_elements: the scene files are scenes. "
        + " ".join(f"{name}: they are files for `softsim {name}`." for name in STUDY_MODELS),
    )
    set: dict[Text, Any] = Field(
        default={}, description="Keys set in all cases: {PATH: VALUE}, as in --set."
    )
    factors: Annotated[dict[Name, FactorPart], Field(min_length=1)] = Field(
        description="Factors that vary, by name."
    )
    design: Design | None = Field(
        default=None, description="Combinations of factor values that are run. Default: grid."
    )
    repeats: Repeats | None = Field(
        default=None,
        description="Repeated runs of each case with random perturbations. Default: one "
        "unperturbed run.",
    )
    measures: Annotated[dict[Name, MeasurePart], Field(min_length=1)] = Field(
        description="Results that are collected from each run, by name."
    )
    plots: tuple[PlotPart, ...] | None = Field(
        default=None, description="Plots. Default: chosen from the factors."
    )
    optimize: Objective | None = Field(
        default=None, description="Objective of `softsim optimize`, which varies the factors."
    )
    keep: Literal["thin", "everything"] = Field(
        default="thin",
        description="Results stored for each run. thin: the summary and about 1,000 rows of the "
        "history. everything: also fields and checkpoint.",
    )

    @property
    def repeat_count(self) -> int:
        """Number of repeats of each case."""
        return self.repeats.count if self.repeats is not None else 1


def study_json_schema() -> dict[str, Any]:
    """Return the JSON schema of a study file, for completion and checks in editors."""
    return json_schema(StudySpec)


# -------------------------------------------------------------------------------------------------
# Columns of a study's table, and its plots: as given, or chosen by its factors.


def column(name: str, unit: str = "") -> str:
    """Heading of a column: "rate [kPa/s]", "passes"."""
    return f"{name} [{unit}]" if unit else name


@dataclass(frozen=True)
class StudyAxis:
    """A factor or a measure. unit: of its column, empty for labels and bare numbers. logarithmic:
    it is spaced, and drawn, so. about: in words, for axes and headings of figures.
    """

    name: str
    unit: str = ""
    is_label: bool = False
    logarithmic: bool = False
    about: str = ""

    @property
    def column(self) -> str:
        """Heading of its column."""
        return column(self.name, self.unit)


@dataclass(frozen=True)
class Plot:
    """Figure: kind is curve, heat_map or scatter; x, y, by, colour are names of axes. by: a curve
    each; colour: what a heat map or the points of a scatter show.
    """

    kind: str
    x: str
    y: str
    by: str | None = None
    colour: str | None = None


@dataclass(frozen=True)
class Goal:
    """Goal of an optimisation: sense is "maximize" or "minimize"; measure names a measure."""

    measure: str
    sense: str


AXES = ("x", "y", "by", "colour")
FACTORS_ONLY = {"curve": ("by",), "heat_map": ("x", "y")}


def given_plots(
    parts: Sequence[PlotPart],
    tree: Tree,
    factors: Sequence[StudyAxis],
    measures: Sequence[StudyAxis],
) -> tuple[Plot, ...]:
    """Return the plots given in a study. Raises SceneError for an unknown axis."""
    for part, held in zip(parts, listed(tree, "plots"), strict=True):
        for role in AXES:
            named = child(held, role)
            if named is None or named.value is None:
                continue
            only_factors = role in FACTORS_ONLY.get(part.kind, ())
            allowed = [axis.name for axis in (*factors, *(() if only_factors else measures))]
            if named.text not in allowed:
                what = "factor" if only_factors else "factor or measure"
                message = f"{role}: there is no {what} {named.text!r}"
                raise SceneError(message, did_you_mean(named.text, allowed), named.origin)
    return tuple(Plot(**part.model_dump()) for part in parts)


def chosen_plots(
    factors: Sequence[StudyAxis], measures: Sequence[StudyAxis], is_grid: bool
) -> tuple[Plot, ...]:
    """Plots of each measure that is a number. Of one factor a curve. Of two in a grid a heat map,
    where a label is among them a curve a value of it. Else a scatter over each factor.
    """
    shown = [axis.name for axis in measures if not axis.is_label]
    if len(factors) == 1:
        return tuple(Plot("curve", factors[0].name, name) for name in shown)
    if len(factors) > 2 or not is_grid:
        return tuple(Plot("scatter", axis.name, name) for name in shown for axis in factors)
    x, other = sorted(factors, key=lambda axis: axis.is_label)
    if other.is_label:
        return tuple(Plot("curve", x.name, name, by=other.name) for name in shown)
    return tuple(Plot("heat_map", x.name, other.name, colour=name) for name in shown)
