"""What figures and page of a study say in words."""

from typing import Any

from softsim.report.study.findings import DONE_COUNT, Findings
from softsim.study.axes import Axis

BEST = "best case"


def written(axis: Axis, value: Any) -> str:
    """A value with its unit: "1.25 kPa/s"; a dash where there is none."""
    if value is None:
        return "–"
    number = value if axis.is_label or isinstance(value, str) else f"{value:.4g}"
    return f"{number} {axis.unit}".rstrip()


def best_in_words(findings: Findings) -> str:
    """The best design point in a sentence; empty where there is none."""
    best, goal = findings.best, findings.record.goal
    if best is None or goal is None:
        return ""
    measure = findings.axis(goal.measure)
    count = best.values[DONE_COUNT]
    mean = f" (mean of {count} cases)" if count > 1 else ""
    at = ", ".join(f"{f.name} {written(f, best.values[f.column])}" for f in findings.factors)
    value = f"{measure.name} {written(measure, best.value)}"
    return f"{BEST} {best.case}: {value}{mean} at {at}"
