"""How long an increment takes: the solver itself, with no output between."""

import time

import numpy as np
import taichi as ti

from softsim.solver.explicit import ExplicitSolver

BLOCK_TIME = 0.02  # seconds of one measurement, so that the call itself does not count


def increment_time(solver: ExplicitSolver, seconds: float) -> float:
    """Median time of an increment [s], of real ones done for about `seconds`.

    The step stays what it is. The first increment, which compiles, is not among them.
    """
    _time_of(solver, 1)
    count, elapsed = 1, _time_of(solver, 1)
    while elapsed < 0.5 * BLOCK_TIME:
        count = int(count * min(10.0, 1.0 + BLOCK_TIME / elapsed))
        elapsed = _time_of(solver, count)
    blocks = [elapsed]
    while sum(blocks) < seconds:
        blocks.append(_time_of(solver, count))
    return float(np.median(blocks)) / count


def _time_of(solver: ExplicitSolver, count: int) -> float:
    began = time.perf_counter()
    solver.advance(count)
    ti.sync()
    return time.perf_counter() - began
