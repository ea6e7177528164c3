"""The other end of worker.py."""

import json
import subprocess
import sys
from pathlib import Path
from types import TracebackType
from typing import Any

from benchmarks.scenes import ROOT


class SolverProcess:
    """A worker that has built and warmed its solver, and waits.

    element_count: of one scenario. peak_memory: resident [bytes], None where unknown.
    """

    def __init__(
        self, scene: Path, device: str = "cpu", threads: int = 1, scenarios: int = 1
    ) -> None:
        self.scenarios = scenarios
        arguments = [str(scene), device, str(threads), str(scenarios)]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.worker", *arguments],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT,
        )  # fmt: skip
        ready = self._answer()
        self.element_count: int = ready["element_count"]
        self.peak_memory: int | None = ready["peak_memory"]

    def _answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"a worker ended with exit code {self.process.wait()}")
        return json.loads(line)

    def start(self, increments: int, times: int = 1) -> None:
        """Let it do so many increments, so many times; `rate` waits for them."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{increments} {times}\n")
        self.process.stdin.flush()
        self.started = increments

    def rate(self) -> float:
        """Element updates per second, over all scenarios, in the best of the times started."""
        updates = self.started * self.element_count * self.scenarios
        return updates / min(self._answer()["seconds"])

    def increments_for(self, seconds: float) -> int:
        """About so many increments take so long."""
        trial = 4
        while True:
            self.start(trial)
            (took,) = self._answer()["seconds"]
            if took > 0.1 * seconds:
                return max(1, int(trial * seconds / took))
            trial *= 4

    def __enter__(self) -> "SolverProcess":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()
