"""What the cases of a study cost, told before they run: by stored ones, a pilot, or one of them."""

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
    """What a case takes of one core, or of a graphics card: `seconds`. basis: on what that stands;
    is_bound: it takes no more.
    """

    seconds: float
    basis: str
    is_bound: bool


def told_cost(each: Cost, runs: int, device: str, workers: int | None) -> str:
    """What runs cost together, in a line."""
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
    """The mean of the cases that are stored; None where there are none."""
    times = frame.filter(polars.col("status") == DONE)[WALL_TIME].drop_nulls().to_list()
    if not times:
        return None
    span = f"{duration(min(times))} to {duration(max(times))}"
    basis = (
        f"the mean of {count_text(len(times), 'case')} stored, {span}; other cases may take longer"
    )
    return Cost(mean(times), basis, False)


def cost_in_pilot(job: Job, device: str) -> Cost:
    """What a case of finite elements costs, foretold by a pilot. SoftsimError: its scene is none,
    or a guard stops its first increments.
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
    """What a case of a chain costs, which takes seconds: it is run. SoftsimError: it cannot be."""
    from softsim.chain.running import run_chain

    with TemporaryDirectory() as folder:
        began = time.perf_counter()
        run_chain(resolved(job.case), Path(folder))
        seconds = time.perf_counter() - began
    return Cost(seconds, f"measured by running case {job.case.number}", False)


COSTS: dict[type[Source], Callable[[Job, str], Cost]] = {
    Source: cost_in_pilot, ChainSource: cost_of_chain,
}  # fmt: skip
"""How the cost of a case is foretold."""


def foretold_cost(job: Job, device: str) -> Cost:
    """What a case costs, before any has run. SoftsimError: it cannot be run."""
    return COSTS[type(job.case.source)](job, device)
