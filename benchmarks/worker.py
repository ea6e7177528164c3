"""A solver in a process of its own: `python -m benchmarks.worker SCENE DEVICE THREADS SCENARIOS`.

Prints a line of JSON when it is ready. For each line "INCREMENTS TIMES" on its standard input it
does so many increments, so many times, and prints how long each time took. Taichi is global to a
process, so is the peak memory.
"""

import json
import sys
import time
from pathlib import Path
from typing import Any

from softsim.builder import build_model
from softsim.compute import backend
from softsim.scene.loading import load_scene
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.stable_step import stable_step

WARM_UP = 16  # increments: kernels are compiled, every pass has run


def main(scene: str, device: str, threads: str, scenarios: str) -> None:
    """Answer until standard input ends."""
    model = build_model(load_scene(Path(scene)))
    backend.start(device, threads=int(threads), most_lanes=model.most_lanes)
    solver = ExplicitSolver([model] * int(scenarios))
    solver.begin(model.safety_factor * stable_step(model, model.points).value)
    solver.advance(WARM_UP)
    backend.ti.sync()
    answer(element_count=model.element_count, peak_memory=peak_memory())
    for line in sys.stdin:
        increments, times = map(int, line.split())
        answer(seconds=[seconds(solver, increments) for _ in range(times)])


def seconds(solver: ExplicitSolver, increments: int) -> float:
    """How long so many increments take."""
    start = time.perf_counter()
    solver.advance(increments)
    backend.ti.sync()
    return time.perf_counter() - start


def answer(**values: Any) -> None:
    """One line of JSON to whoever started this process."""
    print(json.dumps(values), flush=True)


def peak_memory() -> int | None:
    """Largest resident memory so far [bytes], or None where Linux does not tell."""
    status = Path("/proc/self/status")
    if not status.is_file():
        return None
    lines = dict(line.split(":", 1) for line in status.read_text().splitlines() if ":" in line)
    return 1024 * int(lines["VmHWM"].split()[0])


if __name__ == "__main__":
    main(*sys.argv[1:])
