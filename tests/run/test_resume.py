"""Runs that were stopped, killed or damaged, and what `--resume` makes of their folders."""

import io
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from batches import FALLING_STRIP, same_files, status
from batches import finished as finish
from rich.console import Console

from softsim.errors import OutputError
from softsim.output.folder import claimed, read_summary
from softsim.output.history import read_history

# Checkpoints as often as rows: a run that takes long enough to be stopped in its middle.
SLOWED_STRIP = FALLING_STRIP.replace("output: {", "output: {checkpoint_interval: 1 ms, ")


@pytest.mark.slow
def test_stopped_and_resumed_gives_the_same_files(write_scene, tmp_path, run, kernels_of_users):
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


@pytest.mark.starts(3)
def test_an_interrupted_run_goes_on_from_its_checkpoint(batch_of, tmp_path):
    finish(batch_of(FALLING_STRIP, "whole", "time.end=8 ms"))
    first = batch_of(FALLING_STRIP, "parts", "time.end=8 ms")
    first.act()
    while first.solver.time < 4e-3:
        first.do_blocks()
    first.checkpoint()
    first.close()
    finish(batch_of(FALLING_STRIP, "parts", "time.end=8 ms", resume=True))
    same_files(tmp_path / "whole", tmp_path / "parts")


def test_killed_and_resumed_gives_the_same_files(write_scene, tmp_path, run, kernels_of_users):
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


@pytest.fixture(scope="module")
def finished(tmp_path_factory, kernel_cache):
    """The strip's scene, and the folder of its run to 5 ms: done, with a warning of its depth."""
    from softsim.run import run as run_scene

    base = tmp_path_factory.mktemp("finished")
    scene, out = base / "scene.yaml", base / "out"
    scene.write_text(FALLING_STRIP.replace("5 mm, m", "6 m, m"), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOFTSIM_CACHE", kernel_cache)
        run_scene(scene, ("time.end=5 ms",), out, "cpu", console=Console(file=io.StringIO()))
    return scene, out


@pytest.fixture
def ended(finished, tmp_path):
    """The same, the folder as this test's own."""
    scene, folder = finished
    return scene, Path(shutil.copytree(folder, tmp_path / "out"))


def wait_for_rows(path, rows, process):
    deadline = time.monotonic() + 120.0
    while time.monotonic() < deadline:
        if path.exists() and path.read_text().count("\n") >= rows + 2:
            return
        assert process.poll() is None, "ended before it could be stopped"
        time.sleep(0.001)
    raise AssertionError("no rows")


def test_resuming_a_finished_run_changes_nothing(ended, run):
    scene, out = ended
    before = (out / "history.csv").read_bytes()
    run(scene, "time.end=5 ms", out=out, resume=True)
    assert (out / "history.csv").read_bytes() == before
    summary = read_summary(out)
    assert summary["status"] == "done"
    [warning] = summary["warnings"]  # given at the start, and kept by the checkpoint
    assert warning.startswith("the section of body 'strip' is 6000 mm thick")


def test_resume_on_another_device_is_refused(ended, run):
    import h5py

    scene, out = ended
    with h5py.File(out / "checkpoint.h5", "r+") as file:
        del file["device"]
        file["device"] = np.frombuffer(b"cuda", np.uint8)
    with pytest.raises(OutputError, match="computed on cuda"):
        run(scene, "time.end=5 ms", out=out, resume=True)


def test_resume_of_another_scene_is_refused(ended, run):
    scene, out = ended
    with pytest.raises(OutputError, match=r"another time\.end"):
        run(scene, "time.end=6 ms", out=out, resume=True)


def test_resume_of_nothing_starts_anew_and_says_so(finished, tmp_path, run):
    """A cluster's command is the same whether the job was there before or not."""
    (scene, plain), console = finished, Console(file=io.StringIO(), width=500)
    run(scene, "time.end=5 ms", out=tmp_path / "out", resume=True, console=console)
    said = console.file.getvalue()
    assert f"nothing to resume in {tmp_path / 'out'}: the run starts from the beginning" in said
    same_files(plain, tmp_path / "out")


def contents(folder):
    return {file.name: file.read_bytes() for file in folder.iterdir() if not file.is_dir()}


def test_a_folder_in_which_a_run_is_at_work_is_left_alone(ended, run):
    scene, out = ended
    for resume in (False, True):
        with claimed(out):
            before = contents(out)
            with pytest.raises(OutputError, match=f"process {os.getpid()} on .* is using"):
                run(scene, "time.end=5 ms", out=out, resume=resume)
            assert contents(out) == before
    run(scene, "time.end=5 ms", out=out, resume=True)


def without_rows(out, start, stop):
    """Take rows start to stop out of the history, as a disk that lost them would."""
    lines = (out / "history.csv").read_text().splitlines(keepends=True)
    (out / "history.csv").write_text("".join(lines[: 2 + start] + lines[2 + stop :]))


@pytest.mark.parametrize("start, stop", [(3, 6), (2, 4), (0, 6)], ids=["end", "middle", "all"])
def test_a_history_with_a_hole_is_not_resumed(ended, run, start, stop):
    scene, out = ended
    without_rows(out, start, stop)
    before = contents(out)
    said = rf"history\.csv has {6 - stop + start} of 6 entries .*at t = 0\.005 s.*gap"
    with pytest.raises(OutputError, match=said) as told:
        run(scene, "time.end=5 ms", out=out, resume=True)
    assert "remove checkpoint.h5" in told.value.hint
    assert contents(out) == before


def test_frames_with_a_hole_are_not_resumed(ended, run):
    scene, out = ended
    shorter = (out / "results.vtkhdf").read_bytes()
    run(scene, "time.end=20 ms", out=out)
    (out / "results.vtkhdf").write_bytes(shorter)
    with pytest.raises(OutputError, match=r"results\.vtkhdf has 2 of 3 entries"):
        run(scene, "time.end=20 ms", out=out, resume=True)


@pytest.mark.parametrize("name", ["checkpoint.h5", "results.vtkhdf"])
def test_a_truncated_file_is_not_resumed(ended, run, name):
    scene, out = ended
    whole = (out / name).read_bytes()
    (out / name).write_bytes(whole[: len(whole) // 2])
    before = contents(out)
    with pytest.raises(OutputError, match=name) as told:
        run(scene, "time.end=5 ms", out=out, resume=True)
    assert "from the beginning" in told.value.hint or "run again" in told.value.hint
    assert contents(out) == before


def test_a_resumed_run_repairs_what_it_writes_anyway(ended, run):
    scene, out = ended
    whole = (out / "scene.resolved.yaml").read_text()
    for name in ("summary.json", "scene.resolved.yaml"):
        (out / name).write_text(whole[:100] + ": {")
    run(scene, "time.end=5 ms", out=out, resume=True)
    assert status(out) == "done"
    assert (out / "scene.resolved.yaml").read_text() == whole
