"""Folders of studies made up for the figures and the page: no case of them was ever run."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import polars

from softsim.output.folder import StudyRecord, read_study, write_study, write_table
from softsim.study.bisection import Bisection, boundary
from softsim.study.factors import Interval
from softsim.study.schema import Goal, Plot, StudyAxis

RATE = StudyAxis("rate", "kPa/s", logarithmic=True, about="deflation rate")
FRICTION = StudyAxis("friction", about="friction coefficient")
PIPE = StudyAxis("pipe", is_label=True, about="pipe")
SPEED = StudyAxis("speed", "mm/s", about="mean speed")
TRAVEL = StudyAxis("travel", "mm")

RATES = np.geomspace(0.5, 10.0, 8).round(3).tolist()


def speed(rate: float = 1.3, friction: float = 0.6, pipe: str = "36 mm") -> float:
    """Best at 1.3 kPa/s and a friction of 0.6; negative far from it."""
    narrow = 4.0 * (36.0 - float(pipe.split()[0])) / 6.0
    return 25.0 - 6.0 * np.log(rate / 1.3) ** 2 - 40.0 * (friction - 0.6) ** 2 - narrow


def write_made_up(
    folder: Path,
    factors: Sequence[StudyAxis],
    rows: Sequence[dict[str, Any]],
    result: Callable[..., float] = speed,
    *,
    measures: Sequence[StudyAxis] = (SPEED, TRAVEL),
    plots: Sequence[Plot] = (),
    goal: Goal | None = None,
    repeats: int = 1,
    noise: float = 0.4,
    title: str = "Speed in pipes",
) -> Path:
    """A study whose rows say their factors by name, perhaps a repeat, and a status that is not
    done; the first measure is `result` of the factors, the second twice as much.
    """
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(1)
    table: list[dict[str, Any]] = []
    for number, row in enumerate(rows, start=1):
        status = row.get("status", "done")
        named = {axis.name: row[axis.name] for axis in factors}
        value = result(**named) if status == "done" else None
        if value is not None and "repeat" in row:
            value += float(random.normal(0.0, noise))
        table.append(
            {"case": number}
            | {axis.column: row[axis.name] for axis in factors}
            | ({"repeat": row["repeat"]} if "repeat" in row else {})
            | {measures[0].column: value}
            | {axis.column: None if value is None else 2.0 * value for axis in measures[1:]}
            | {
                "status": status,
                "reason": "an element is inverted" if status == "failed" else "",
                "wall_time [s]": 1.5,
                "key": f"{number:08x}",
            }
        )
    types = {axis.column: polars.Float64 for axis in measures}
    write_table(folder, polars.DataFrame(table, schema_overrides=types))
    record = StudyRecord(
        title, "study.yaml", tuple(factors), tuple(measures), tuple(plots), goal, repeats,
        len(table), "done", 12.0, "0.1.0", {"design": "grid", "scene": "pfr_36mm.yaml"},
    )  # fmt: skip
    write_study(folder, record)
    return folder


SLOPE = StudyAxis("slope", "deg", about="slope of the ramp")
HEIGHT = StudyAxis("height", "mm", about="height of the ramp")
PATTERN = StudyAxis("pattern", is_label=True, about="rows of limbs")
PASSED = StudyAxis("passed", about="share of the robots that get over")
SOUGHT = Bisection("height", "passed", 0.5, 3.0, Interval(1.0, 25.0), 4)


def write_bisection(
    folder: Path, passes: Callable[..., float | None], **levels: Sequence[Any]
) -> Path:
    """A bisection of SOUGHT over slopes and patterns, each repeat of a case as `passes` of slope,
    pattern, height and repeat has it; None where its run has failed.
    """
    rows: list[dict[str, Any]] = []
    for cell in grid(**levels):
        answers: dict[float, list[float | None]] = {}
        while asked := boundary(SOUGHT, answers).asked:
            for height in asked:
                held = answers.setdefault(height, [])
                for repeat in range(len(held), len(held) + SOUGHT.missing(held)):
                    held.append(passes(**cell, height=height, repeat=repeat))
                    status = "failed" if held[-1] is None else "done"
                    rows.append({**cell, "height": height, "status": status, "passed": held[-1]})
    axes = [axis for axis in (SLOPE, PATTERN) if axis.name in levels]
    results = iter([row["passed"] for row in rows if row["passed"] is not None])
    write_made_up(
        folder, [*axes, HEIGHT], rows, lambda **_: next(results), measures=[PASSED],
        repeats=SOUGHT.repeats,
    )  # fmt: skip
    write_study(folder, replace(read_study(folder), bisection=SOUGHT))
    return folder


def grid(**levels: Sequence[Any]) -> list[dict[str, Any]]:
    """A row each combination, the last factor fastest."""
    return [dict(zip(levels, values, strict=True)) for values in product(*levels.values())]


def sampled(count: int) -> list[dict[str, Any]]:
    """Rates and frictions at random; every ninth case failed, every seventh was pruned."""
    random = np.random.default_rng(2)
    rows: list[dict[str, Any]] = []
    for number in range(count):
        row = {
            "rate": float(np.exp(random.uniform(np.log(0.5), np.log(10.0)))),
            "friction": float(random.uniform(0.2, 1.0)),
            "pipe": str(random.choice(["30 mm", "36 mm", "40 mm"])),
        }
        status = "failed" if number % 9 == 4 else "pruned" if number % 7 == 3 else "done"
        rows.append(row | {"status": status})
    return rows
