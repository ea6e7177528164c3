"""What figures and page of a study say in words."""

from collections.abc import Mapping
from typing import Any

from softsim.output.study_folder import Axis
from softsim.report.study.findings import DONE_COUNT, Findings

BEST = "best case"


def written(axis: Axis, value: Any) -> str:
    """A value with its unit: "1.25 kPa/s"; a dash where there is none."""
    if value is None:
        return "–"
    number = value if axis.is_label or isinstance(value, str) else f"{value:.4g}"
    return f"{number} {axis.unit}".rstrip()


def case_in_words(findings: Findings, row: Mapping[str, Any]) -> list[str]:
    """A row of the table or of the design points: its case, factors and measures, a line each."""
    count = row.get(DONE_COUNT, 1)
    lines = [f"case {row['case']}" + (f" and its repeats, mean of {count}" if count > 1 else "")]
    for axis in (*findings.factors, *findings.measures):
        lines.append(f"{axis.name}: {written(axis, row[axis.column])}")
    return lines


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
