"""What figures and page of a study say in words."""

from typing import Any

from softsim.report.study.findings import DONE_COUNT, FAILED_COUNT, Findings
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
    count, failed = best.values[DONE_COUNT], best.values[FAILED_COUNT]
    repeats = [f"mean of {count} cases"] * (count > 1) + [f"{failed} more failed"] * (failed > 0)
    remark = f" ({', '.join(repeats)})" if repeats else ""
    at = ", ".join(f"{f.name} {written(f, best.values[f.column])}" for f in findings.factors)
    value = f"{measure.name} {written(measure, best.value)}"
    return f"{BEST} {best.case}: {value}{remark} at {at}"
