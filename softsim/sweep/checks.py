"""Cases that cannot run, found before anything runs: scenes are read and models are built."""

import time
from collections.abc import Callable, Iterator, Sequence

from softsim.errors import SoftsimError
from softsim.machine import choose, chosen_device
from softsim.study.cases import ChainSource, Source, resolved
from softsim.sweep.job import Job

LONGEST = 15.0
"""Seconds of wall time after which the remaining cases are left unchecked."""

MOST_TOLD = 10
"""Cases that cannot run that are named one by one."""


def refusals(jobs: Sequence[Job], device: str, longest: float = LONGEST) -> Iterator[str]:
    """Yield a line for each case that cannot run, and one that sums them up.

    Nothing is yielded where all cases can run. The checks end after `longest` seconds; the last
    line then says how many cases were checked.

    Parameters
    ----------
    jobs : sequence of Job
        Cases that are about to run.
    device : str
        auto, cpu or cuda.
    longest : float
        Wall time [s].
    """
    began, checked, refused = time.monotonic(), 0, 0
    for job in jobs:
        if checked and time.monotonic() - began > longest:
            break
        checked += 1
        try:
            CHECKS[type(job.case.source)](job, device)
        except SoftsimError as error:
            refused += 1
            if refused <= MOST_TOLD:
                values = ", ".join(f"{name} {value}" for name, value in job.case.values.items())
                reason = " ".join(error.message.split())
                yield f"case {job.case.number} cannot run ({values}): {reason}"
    if refused or checked < len(jobs):
        yield (
            f"{refused} of the {checked} cases checked cannot run"
            + f"; {len(jobs) - checked} were not checked, to save time" * (checked < len(jobs))
        )


def _check_elements(job: Job, device: str) -> None:
    from softsim.run.scenes import ready_model  # Taichi is imported from here on

    ready_model(resolved(job.case), choose(chosen_device(device), "1"))


def _check_chain(job: Job, device: str) -> None:
    resolved(job.case)


CHECKS: dict[type[Source], Callable[[Job, str], None]] = {
    Source: _check_elements, ChainSource: _check_chain,
}  # fmt: skip
"""Function that checks a case."""
