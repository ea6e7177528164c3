"""What a sweep costs beside its runs: a study of many cases that are not computed at all."""

import io
import json
import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from benchmarks.effort import Effort
from benchmarks.table import Row, limit_row
from softsim.compute.machine import processor_count
from softsim.sweep.job import Job

LIMIT = 20.0  # ms a case: hundredths of the shortest run

SCENE = """
bodies:
  block:
    mesh: {generator: block, length: 4 mm, height: 4 mm, element_size: 2 mm}
    formulation: plane_strain
    thickness: 10 mm
    material: dragon_skin_30
time: {end: 1 s}
"""

STUDY = """
scene: block.yaml
factors: {time: {key: time.end, range: [1 s, 2 s], count: %d}}
measures: {error: {of: energy_error}}
"""


def overhead_rows(folder: Path, program: Path | None, effort: Effort) -> list[Row]:
    """A study's cost a case from its file to its table, and of one that is stored already."""
    from softsim.study.loading import load_study
    from softsim.sweep.engine import local_pool
    from softsim.sweep.study import sweep

    (folder / "block.yaml").write_text(SCENE)
    file = folder / "study.yaml"
    file.write_text(STUDY % effort.cases)
    rows = []
    for name in ("a sweep's own cost a case", "a case that is stored"):
        began = time.perf_counter()
        sweep(
            load_study(file), folder / "overhead", local_pool(processor_count()), "cpu",
            console=Console(file=io.StringIO()), simulate=left_out,
        )  # fmt: skip
        cost = (time.perf_counter() - began) / effort.cases * 1e3
        rows.append(limit_row(name, cost, "ms", LIMIT, f"{effort.cases:,} cases, all included"))
    return rows


def left_out(jobs: Sequence[Job]) -> list[Exception | None]:
    """The files of a run without the run."""
    for job in jobs:
        (job.folder / "summary.json").write_text(json.dumps({"status": "done"}))
        (job.folder / "history.csv").write_text("time\ns\n0.0\n")
    return [None for _ in jobs]
