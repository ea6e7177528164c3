"""What a user waits for: the start of a run, and the main job from beginning to end."""

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.effort import Effort
from benchmarks.scenes import PFR, ROOT
from benchmarks.table import Row, limit_row
from softsim.scene.loading import load_scene


@dataclass(frozen=True)
class CommandRun:
    """A finished `softsim run`: seconds from its start to its first increment, and to its end;
    processor_time: of all its threads [s], which a busy machine does not stretch.
    """

    first_increment: float
    seconds: float
    processor_time: float
    summary: dict[str, Any]


def run_command(out: Path, cache: Path, *overrides: str) -> CommandRun:
    """`softsim run` of the PFR scene in a fresh process with the given folder of kernels.

    The summary says when the first increment was done and when it was itself written, both after
    the run began; the file's own time ties that to the clock that the process was started by.
    Raises CalledProcessError if it fails.
    """
    settings = [word for override in overrides for word in ("--set", override)]
    command = [sys.executable, "-c", "from softsim.cli import main; main()", "run", str(PFR)]
    start, before = time.time(), os.times()
    subprocess.run(
        [*command, "--out", str(out), "--device", "cpu", *settings],
        env=os.environ | {"SOFTSIM_CACHE": str(cache)},
        cwd=ROOT, check=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    seconds, after = time.time() - start, os.times()
    processor_time = (
        after.children_user + after.children_system - before.children_user - before.children_system
    )
    file = out / "summary.json"
    summary = json.loads(file.read_text())
    began = file.stat().st_mtime - summary["wall_time"]
    first_increment = began + summary["first_increment_after"] - start
    return CommandRun(first_increment, seconds, processor_time, summary)


def start_rows(folder: Path, program: Path | None, effort: Effort) -> list[Row]:
    """From the start of the process to the first increment, with and without compiled kernels."""
    cache = folder / "kernels"
    short = "time.end=10 ms"
    cold = run_command(folder / "cold", cache, short)
    warm = [run_command(folder / "warm", cache, short) for _ in range(effort.starts)]
    best = min(warm, key=lambda run: run.first_increment)
    return [
        limit_row("start, kernels kept", best.first_increment, "s", 3.0, _told(best)),
        limit_row("start, kernels compiled", cold.first_increment, "s", 20.0, _told(cold)),
    ]


def _told(run: CommandRun) -> str:
    simulated = run.summary["simulated_time"]
    return (
        f"of the process to its first increment; to its end, {simulated * 1e3:g} ms of motion and "
        f"the figures, {run.seconds:.3g} s, {run.processor_time:.3g} s of processor time"
    )


def whole_run_rows(folder: Path, program: Path | None, effort: Effort) -> list[Row]:
    """The main job: two pressure cycles of the PFR, kernels compiled before."""
    cache = folder / "kernels"
    if not cache.is_dir():
        run_command(folder / "compile", cache, "time.end=10 ms")
    name = "two cycles of pfr_36mm"
    if effort.simulated is None:
        seconds = run_command(folder / "whole", cache).seconds
        return [limit_row(name, seconds, "s", 180.0)]
    run = run_command(folder / "part", cache, f"time.end={effort.simulated} s")
    computing = run.summary["wall_time"] - run.summary["first_increment_after"]
    end = load_scene(PFR).scene.time.end
    seconds = run.seconds + computing * (end / effort.simulated - 1.0)
    remark = f"extrapolated from the first {effort.simulated:g} s of {end:g} s"
    return [limit_row(name, seconds, "s", 180.0, remark)]
