"""Runs that were stopped, killed or damaged, and what `--resume` makes of their folders."""

import io
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from batches import FALLING_STRIP, same_files, status
from rich.console import Console

from softsim.errors import OutputError
from softsim.output.claim import claimed
from softsim.output.history import read_history

# Checkpoints as often as rows: a run that takes long enough to be stopped in its middle.
SLOWED_STRIP = FALLING_STRIP.replace("checkpoint_interval: 5 ms", "checkpoint_interval: 1 ms")


def test_stopped_and_resumed_gives_the_same_files(write_scene, tmp_path, run):
    """SIGTERM in the middle, then --resume: history and fields as if nothing had happened."""
    scene = write_scene(SLOWED_STRIP)
    run(scene, out=tmp_path / "whole")
    code = (
        "import sys; from softsim.cli import main; "
        f"sys.argv = ['softsim', 'run', {str(scene)!r}, '--out', {str(tmp_path / 'parts')!r}, "
        "'--device', 'cpu']; main()"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.DEVNULL)
    wait_for_rows(tmp_path / "parts" / "history.csv", 8, process)
    process.send_signal(signal.SIGTERM)
    assert process.wait(timeout=60) == 4
    assert status(tmp_path / "parts") == "interrupted"
    run(scene, out=tmp_path / "parts", resume=True)
    same_files(tmp_path / "whole", tmp_path / "parts")


def test_killed_and_resumed_gives_the_same_files(write_scene, tmp_path, run):
    """kill -9: the history is readable up to its last row, the last checkpoint resumes."""
    scene = write_scene(SLOWED_STRIP)
    run(scene, out=tmp_path / "whole")
    code = (
        "from softsim.run import run; from pathlib import Path; "
        f"run({str(scene)!r}, out=Path({str(tmp_path / 'parts')!r}), device='cpu')"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.DEVNULL)
    wait_for_rows(tmp_path / "parts" / "history.csv", 12, process)
    process.kill()
    process.wait(timeout=60)
    assert len(read_history(tmp_path / "parts" / "history.csv")["time"]) >= 10
    assert status(tmp_path / "parts") == "running"
    run(scene, out=tmp_path / "parts", resume=True)
    same_files(tmp_path / "whole", tmp_path / "parts")


def wait_for_rows(path, rows, process):
    deadline = time.monotonic() + 120.0
    while time.monotonic() < deadline:
        if path.exists() and path.read_text().count("\n") >= rows + 2:
            return
        assert process.poll() is None, "ended before it could be stopped"
        time.sleep(0.001)
    raise AssertionError("no rows")


def test_resuming_a_finished_run_changes_nothing(write_scene, tmp_path, run):
    scene = write_scene(FALLING_STRIP)
    run(scene, "time.end=5 ms", out=tmp_path / "out")
    before = (tmp_path / "out" / "history.csv").read_bytes()
    run(scene, "time.end=5 ms", out=tmp_path / "out", resume=True)
    assert (tmp_path / "out" / "history.csv").read_bytes() == before
    assert status(tmp_path / "out") == "done"


def test_resume_on_another_device_is_refused(write_scene, tmp_path, run):
    import h5py

    scene = write_scene(FALLING_STRIP)
    run(scene, "time.end=5 ms", out=tmp_path / "out")
    with h5py.File(tmp_path / "out" / "checkpoint.h5", "r+") as file:
        del file["device"]
        file["device"] = np.frombuffer(b"cuda", np.uint8)
    with pytest.raises(OutputError, match="computed on cuda"):
        run(scene, "time.end=5 ms", out=tmp_path / "out", resume=True)


def test_resume_of_another_scene_is_refused(write_scene, tmp_path, run):
    scene = write_scene(FALLING_STRIP)
    run(scene, "time.end=5 ms", out=tmp_path / "out")
    with pytest.raises(OutputError, match="another scene"):
        run(scene, "time.end=6 ms", out=tmp_path / "out", resume=True)


def test_resume_of_nothing_starts_anew_and_says_so(write_scene, tmp_path, run):
    """A cluster's command is the same whether the job was there before or not."""
    scene, console = write_scene(FALLING_STRIP), Console(file=io.StringIO(), width=500)
    run(scene, "time.end=5 ms", out=tmp_path / "plain")
    run(scene, "time.end=5 ms", out=tmp_path / "out", resume=True, console=console)
    said = console.file.getvalue()
    assert f"nothing to resume in {tmp_path / 'out'}: the run starts anew" in said
    same_files(tmp_path / "plain", tmp_path / "out")


def contents(folder):
    return {file.name: file.read_bytes() for file in folder.iterdir() if not file.is_dir()}


def test_a_folder_in_which_a_run_is_at_work_is_left_alone(write_scene, tmp_path, run):
    scene, out = write_scene(FALLING_STRIP), tmp_path / "out"
    run(scene, "time.end=5 ms", out=out)
    for resume in (False, True):
        with claimed(out):
            before = contents(out)
            with pytest.raises(OutputError, match=f"process {os.getpid()} on .* works in"):
                run(scene, "time.end=5 ms", out=out, resume=resume)
            assert contents(out) == before
    run(scene, "time.end=5 ms", out=out, resume=True)


def without_rows(out, start, stop):
    """Take rows start to stop out of the history, as a disk that lost them would."""
    lines = (out / "history.csv").read_text().splitlines(keepends=True)
    (out / "history.csv").write_text("".join(lines[: 2 + start] + lines[2 + stop :]))


@pytest.mark.parametrize("start, stop", [(4, 11), (3, 5), (0, 11)], ids=["end", "middle", "all"])
def test_a_history_with_a_hole_is_not_resumed(write_scene, tmp_path, run, start, stop):
    scene, out = write_scene(FALLING_STRIP), tmp_path / "out"
    run(scene, "time.end=10 ms", out=out)
    without_rows(out, start, stop)
    before = contents(out)
    said = rf"history\.csv has {11 - stop + start} of 11 entries .*at t = 0\.01 s.*hole"
    with pytest.raises(OutputError, match=said) as told:
        run(scene, "time.end=10 ms", out=out, resume=True)
    assert "remove checkpoint.h5" in told.value.hint
    assert contents(out) == before


def test_frames_with_a_hole_are_not_resumed(write_scene, tmp_path, run):
    scene, out = write_scene(FALLING_STRIP), tmp_path / "out"
    run(scene, "time.end=5 ms", out=out)
    shorter = (out / "results.vtkhdf").read_bytes()
    run(scene, "time.end=20 ms", out=out)
    (out / "results.vtkhdf").write_bytes(shorter)
    with pytest.raises(OutputError, match=r"results\.vtkhdf has 2 of 3 entries"):
        run(scene, "time.end=20 ms", out=out, resume=True)


@pytest.mark.parametrize("name", ["checkpoint.h5", "results.vtkhdf"])
def test_a_truncated_file_is_not_resumed(write_scene, tmp_path, run, name):
    scene, out = write_scene(FALLING_STRIP), tmp_path / "out"
    run(scene, "time.end=5 ms", out=out)
    whole = (out / name).read_bytes()
    (out / name).write_bytes(whole[: len(whole) // 2])
    before = contents(out)
    with pytest.raises(OutputError, match=name) as told:
        run(scene, "time.end=5 ms", out=out, resume=True)
    assert "anew" in told.value.hint or "run again" in told.value.hint
    assert contents(out) == before


def test_a_resumed_run_repairs_what_it_writes_anyway(write_scene, tmp_path, run):
    scene, out = write_scene(FALLING_STRIP), tmp_path / "out"
    run(scene, "time.end=5 ms", out=out)
    whole = (out / "scene.resolved.yaml").read_text()
    for name in ("summary.json", "scene.resolved.yaml"):
        (out / name).write_text(whole[:100] + ": {")
    run(scene, "time.end=5 ms", out=out, resume=True)
    assert status(out) == "done"
    assert (out / "scene.resolved.yaml").read_text() == whole
