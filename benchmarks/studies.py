"""What a study saves: its cases by `softsim sweep`, against as many single runs."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.effort import Effort
from benchmarks.scenes import ROOT
from benchmarks.table import Row

STUDY = ROOT / "scenes" / "studies" / "deflation_rate.yaml"
TARGET = 1.9  # of two cores


def study_rows(folder: Path, program: Path | None, effort: Effort) -> list[Row]:
    """The first cases of a shipped study, each cut off after some simulated time: one command for
    all of them, then one command each, with the same kernels, compiled before.

    A single run draws its figures, and the study draws its own, with its page: as users wait.
    """
    from softsim.study.loading import load_study

    cases = load_study(STUDY).cases()
    end = f"time.end={effort.study_time} s"
    cache = folder / "kernels"
    _command(cache, "run", str(cases[0].source.scene), "--set", end, "--out", str(folder / "warm"))
    began = time.monotonic()
    _command(cache, "sweep", str(STUDY), "--set", end, "--out", str(folder / "study"))
    study = time.monotonic() - began
    began = time.monotonic()
    for case in cases:
        settings = [word for override in (*case.overrides, end) for word in ("--set", override)]
        out = str(folder / "single" / str(case.number))
        _command(cache, "run", str(case.source.scene), *settings, "--out", out)
    single = time.monotonic() - began
    computing = sum(_wall_time(folder / "single" / str(case.number)) for case in cases)
    remark = (
        f"{len(cases)} cases of {effort.study_time:g} s of motion: as a study {study:.3g} s, one "
        f"run after the other {single:.3g} s, of which {computing:.3g} s from the start of the "
        "model to the end of the loop"
    )
    ratio = single / study
    return [
        Row("a study against single runs", study, "s", single, ratio, f">= {TARGET:g}",
            ratio >= TARGET, remark)
    ]  # fmt: skip


def _wall_time(folder: Path) -> float:
    return float(json.loads((folder / "summary.json").read_text())["wall_time"])


def _command(cache: Path, *words: str) -> None:
    """A softsim command on the CPU in a process of its own. Raises CalledProcessError."""
    subprocess.run(
        [sys.executable, "-c", "from softsim.cli import main; main()", *words, "--device", "cpu"],
        env=os.environ | {"SOFTSIM_CACHE": str(cache)},
        cwd=ROOT, check=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
