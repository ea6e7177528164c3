"""Estimated cost of the cases of a study, from stored cases, a short trial run, or one case."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import mean
from tempfile import TemporaryDirectory

import polars

from softsim.machine import choose, chosen_device, processor_count
from softsim.report.readable import duration
from softsim.study.cases import DONE, ChainSource, Source, resolved
from softsim.study.description import count_text
from softsim.sweep.job import Job
from softsim.sweep.ledger import WALL_TIME


@dataclass(frozen=True)
class Cost:
    """Estimated cost of a case.

    seconds: time on one core or one graphics card. basis: what the estimate rests on. is_bound:
    True for an upper bound.
    """

    seconds: float
    basis: str
    is_bound: bool


def cost_line(each: Cost, runs: int, device: str, workers: int | None) -> str:
    """Return a line with the total cost of the runs."""
    alone = chosen_device(device) == "cuda"
    count = workers or (1 if alone else processor_count())
    most, place = "at most " * each.is_bound, "GPU hours" if alone else "core hours"
    hours = runs * each.seconds / 3600.0
    return (
        f"cost {most or 'about '}{hours:.3g} {place}, {hours / count:.3g} h with "
        f"{count_text(count, 'worker')}: {count_text(runs, 'run')} of {most}"
        f"{duration(each.seconds)}, {each.basis}"
    )


def stored_cost(frame: polars.DataFrame) -> Cost | None:
    """Return the mean cost of the stored cases; None where there are none."""
    times = frame.filter(polars.col("status") == DONE)[WALL_TIME].drop_nulls().to_list()
    if not times:
        return None
    span = f"{duration(min(times))} to {duration(max(times))}"
    basis = (
        f"the mean of {count_text(len(times), 'case')} stored, {span}; other cases may take longer"
    )
    return Cost(mean(times), basis, False)


def cost_in_pilot(job: Job, device: str) -> Cost:
    """Return the cost of a finite element case, estimated by a short trial run.

    Raises SoftsimError where the scene is invalid or a guard stops the trial.
    """
    from softsim.run.pilot import predicted_duration  # Taichi is imported from here on
    from softsim.run.scenes import ready_model

    choice, loaded = choose(chosen_device(device), "1"), resolved(job.case)
    began = time.perf_counter()
    model = ready_model(loaded, choice)
    built_in = time.perf_counter() - began
    found = predicted_duration(loaded, model, choice)
    basis = (
        f"{found.increment_count:.3g} increments each, estimated from a short trial run of case "
        f"{job.case.number} over {100.0 * found.covered:.0f} % of its load history, alone on "
        "this machine and with its steps; less if a verdict ends a run early"
    )
    return Cost(built_in + found.prepared + found.loop, basis, True)


def cost_of_chain(job: Job, device: str) -> Cost:
    """Return the cost of a case of a chain, which is run; SoftsimError where it cannot run."""
    from softsim.chain.running import run_chain

    with TemporaryDirectory() as folder:
        began = time.perf_counter()
        run_chain(resolved(job.case), Path(folder))
        seconds = time.perf_counter() - began
    return Cost(seconds, f"measured by running case {job.case.number}", False)


COSTS: dict[type[Source], Callable[[Job, str], Cost]] = {
    Source: cost_in_pilot, ChainSource: cost_of_chain,
}  # fmt: skip
"""Class of the source of a case -> function that estimates its cost."""


def estimated_cost(job: Job, device: str) -> Cost:
    """Return the estimated cost of a case; SoftsimError where it cannot run."""
    return COSTS[type(job.case.source)](job, device)
