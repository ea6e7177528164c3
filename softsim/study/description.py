"""Description of a study in a few rows of text."""

import math

import yaml

from softsim.study.axes import Axis
from softsim.study.bisection import Bisection
from softsim.study.factors import Interval, Space
from softsim.study.loading import LoadedStudy

MOST_SHOWN = 6
"""Largest number of values of a factor that are all written; of more, only some are."""


def describe(study: LoadedStudy) -> list[tuple[str, str]]:
    """Return rows of text on the factors and settings of a study."""
    factors = study.composition.factors
    return [(f.axis.column, space_text(f.axis, f.space)) for f in factors] + settings(study)


def settings(study: LoadedStudy) -> list[tuple[str, str]]:
    """Return rows of text on shared settings, design, repeats, measures and goal of a study."""
    rows = []
    if study.study.scene is not None:
        rows.append(("scene", study.study.scene))
    if study.study.robot is not None:
        rows.append(("robot", study.study.robot))
    if study.study.set:
        written = yaml.safe_dump(study.study.set, default_flow_style=True, width=math.inf)
        rows.append(("in all cases", written.strip()[1:-1]))  # without the braces
    if study.bisection is not None:
        rows.append(("design", sought_text(study, study.bisection)))
    if study.design is not None:
        kind = study.design.kind.replace("_", " ")
        rows.append(("design", f"{kind}, {count_text(study.case_count, 'case')}"))
    if study.perturbed:
        perturbed = ", ".join(f"{one.path} by {one.written.text}" for one in study.perturbed)
        rows.append(("repeats", f"{study.repeats} of each case, perturbed: {perturbed}"))
    rows.append(("measures", ", ".join(measure.column for measure in study.measures)))
    if study.goal is not None:
        rows.append(("goal", f"{study.goal.sense} {study.goal.measure}"))
    return rows


def space_text(axis: Axis, space: Space) -> str:
    """Return the values of a factor as text."""
    spacing = ", logarithmic" if axis.logarithmic else ""
    if isinstance(space, Interval):
        return f"{space.low:g} to {space.high:g}, continuous{spacing}"
    shown = [value if isinstance(value, str) else f"{value:g}" for value in space]
    if len(shown) > MOST_SHOWN:
        return f"{len(shown)} values, {', '.join(shown[:3])} ... {shown[-1]}{spacing}"
    return ", ".join(shown) + spacing


def sought_text(study: LoadedStudy, sought: Bisection) -> str:
    """Return a description of a bisection: its target, assumption, and largest number of cases."""
    axis = next(axis for axis in study.factors if axis.name == sought.factor)
    cell_count = study.case_count // sought.most_runs
    return (
        f"bisection: where {sought.measure} crosses {sought.share:g} as {axis.name} increases, to "
        f"within {sought.tolerance:g} {axis.unit}".rstrip()
        + f", assumed to happen once; in {count_text(cell_count, 'cell')} at most "
        f"{count_text(study.case_count, 'case')}"
    )


def count_text(count: int, thing: str) -> str:
    """Return a count with its noun: "1 case", "2 cases"."""
    return f"{count:,} {thing}" + ("" if count == 1 else "s")
