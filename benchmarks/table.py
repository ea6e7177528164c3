"""Rows of measured numbers against their targets, as a table and as JSON."""

import json
import os
import platform
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from rich.console import Console

from softsim.compute.machine import processor_name
from softsim.report.table import Table, cell


@dataclass(frozen=True)
class Row:
    """One measured number.

    rate: in `unit`; M/s are million element updates a second. ceiling: the same of the reference,
    or None. ratio: what the target is about, or None. met: None where there is no target, or
    nothing to hold against it.
    """

    name: str
    rate: float
    unit: str
    ceiling: float | None = None
    ratio: float | None = None
    target: str = ""
    met: bool | None = None
    remark: str = ""


def ratio_row(
    name: str,
    rate: float,
    ceiling: float | None,
    target: float,
    remark: str = "",
) -> Row:
    """A rate [M/s] that shall reach a share of the ceiling."""
    ratio = None if ceiling is None else rate / ceiling
    met = None if ratio is None else ratio >= target
    text = f">= {target:g}"
    return Row(name, rate, "M/s", ceiling, ratio, text, met, remark)


def limit_row(name: str, value: float, unit: str, limit: float, remark: str = "") -> Row:
    """A number that shall stay below a limit."""
    return Row(name, value, unit, None, None, f"<= {limit:g} {unit}", value <= limit, remark)


def machine() -> dict[str, Any]:
    """Where this was measured."""
    return {
        "processor": processor_name(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "load_average": os.getloadavg()[0],
        "precision": "f64",
        "versions": {
            "python": platform.python_version(),
            **{name: version(name) for name in ("softsim", "taichi", "numpy")},
        },
    }


def write_json(path: Path, rows: list[Row], about: dict[str, Any]) -> None:
    """Everything, for programs."""
    content = about | {"rows": [asdict(row) for row in rows]}
    path.write_text(json.dumps(content, indent=1) + "\n")


def show(console: Console, rows: list[Row], about: dict[str, Any]) -> None:
    """Everything, for people."""
    versions = ", ".join(f"{name} {number}" for name, number in about["versions"].items())
    console.print(f"{about['processor']}, {about['cores']} cores, {about['precision']}; {versions}")
    console.print(
        f"load before: {about['load_average']:.2g}; rates on two threads need both cores free"
    )
    verdicts = {True: "met", False: "missed", None: ""}
    lines = [
        (
            row.name, cell(row.rate, unit=f" {row.unit}"), cell(row.ceiling, ".3g"),
            cell(row.ratio, ".3g"), row.target, verdicts[row.met],
        )
        for row in rows
    ]  # fmt: skip
    headings = ("work", "measured", "ceiling", "ratio", "target", "verdict")
    console.print(Table(lines, headings))
    console.print("M/s: million element updates a second. Rates: best of several rounds, in turn.")
    for row in rows:
        if row.remark:
            console.print(f"{row.name}: {row.remark}", highlight=False)
