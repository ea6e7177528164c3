"""An optimisation without simulations: a pool that works here and now, and runs that are formulas.

python trial_stand_ins.py STUDY FOLDER: an optimisation whose process is killed in its fourth trial.
"""

import io
import json
import os
import signal
import sys
from concurrent.futures import Future
from contextlib import nullcontext
from pathlib import Path

from rich.console import Console

from softsim.errors import StabilityError
from softsim.study.loading import load_study
from softsim.sweep.study import optimize

BEST = {"gravity": 7.0, "slope": 30.0}
"""Where the formula is smallest: m/s^2, deg."""


class PoolHere:
    """One worker: this thread."""

    size = 1

    def submit(self, function, *arguments):
        """The result is there at once."""
        future = Future()
        future.set_result(function(*arguments))
        return future

    def ask_to_stop(self):
        """Nothing ever flies."""


def distance(values):
    """Squared distance to the best values, each in tenths of its range."""
    return (values["gravity"] - BEST["gravity"]) ** 2 / 4.0 + (values["slope"] - 30.0) ** 2 / 64.0


def formula(jobs):
    """The distance as the displacement of a run."""
    for job in jobs:
        found = {"status": "done", "body_displacement": 1e-3 * distance(job.case.values)}
        (job.folder / "history.csv").write_text("time\ns\n0.0\n1.0\n")
        (job.folder / "summary.json").write_text(json.dumps(found))
    return [None for _ in jobs]


def faulty(jobs):
    """Case 2 is stopped by a guard, case 3 finds nothing."""
    formula(jobs)
    if jobs[0].case.number == 3:
        (jobs[0].folder / "summary.json").write_text('{"status": "done"}')
    return [StabilityError("too fast") if job.case.number == 2 else None for job in jobs]


def deadly(jobs):
    """Case 4 takes the whole process with it."""
    if jobs[0].case.number == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    return formula(jobs)


def optimized(file, folder, simulate=formula, **settings):
    """The table of an optimisation with a stand-in, and what was said."""
    console = Console(file=io.StringIO(), width=200)
    table = optimize(
        load_study(file), folder, nullcontext(PoolHere()), simulate=simulate, console=console,
        **settings,
    )  # fmt: skip
    return table, console.file.getvalue()


if __name__ == "__main__":
    optimized(sys.argv[1], Path(sys.argv[2]), deadly)
