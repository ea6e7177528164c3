"""A study from its file to its table: what is run, what is stored, what survives being stopped."""

import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from contextlib import nullcontext
from pathlib import Path

import polars
import psutil
import pytest
import stand_ins
from polars.testing import assert_frame_equal
from rich.console import Console

from softsim.cli.study_tables import print_plan, print_results
from softsim.errors import ClusterError, Interrupted, OutputError
from softsim.output.folder import claimed, read_study, read_table
from softsim.report.study.findings import Findings, boundaries_in_words
from softsim.report.study.plots import draw_study
from softsim.study.cases import DONE, FAILED, WAITING
from softsim.study.loading import load_study
from softsim.sweep.engine import pool_for, remote_pool
from softsim.sweep.job import StudyTable
from softsim.sweep.study import refusals, sweep

WALL_TIME = "wall_time [s]"
HERE = Path(__file__).parent


def rewrite(file, old, new):
    file.write_text(file.read_text().replace(old, new))


def swept(file, folder, pool, simulate, overrides=(), **settings):
    """The table of a study that is run with a stand-in, and what was said."""
    console = Console(file=io.StringIO(), width=200)
    study = load_study(file, overrides)
    table = sweep(study, folder, nullcontext(pool), simulate=simulate, console=console, **settings)
    return table, console.file.getvalue()


@pytest.mark.starts(2)
def test_table_and_record(study_file, tmp_path, pool):
    table, said = swept(study_file, tmp_path / "out", pool, stand_ins.fine)
    assert table["time [ms]"].to_list() == pytest.approx([2, 4, 6, 8, 10, 12])
    assert table["case"].to_list() == list(range(1, 7)) and set(table["status"]) == {DONE}
    assert table["warnings"].to_list() == [None, 2, None, None, None, None]
    assert "6 cases, 0 of them stored" in said
    assert_frame_equal(table, read_table(tmp_path / "out"))
    assert len((tmp_path / "out" / "table.csv").read_text().splitlines()) == 7
    record = read_study(tmp_path / "out")
    assert (record.status, record.case_count, record.title) == ("done", 6, "A block falls")


def test_cases_that_cannot_run_are_named_before_any_runs(study_file):
    rewrite(
        study_file, "time: {key: time.end, range: [2 ms, 12 ms], count: 6}",
        "size: {variants: {as it is: {}, "
        "coarse: {bodies.block.mesh.length: 1e-9 mm, bodies.block.mesh.element_size: 1 m}}}",
    )  # fmt: skip
    study = load_study(study_file)
    waiting, _ = next(StudyTable.of(study).open_rounds(study, study_file.parent / "out", "cpu", ()))
    one, both = refusals(waiting, "cpu")
    assert one.startswith("case 2 cannot run (size coarse): ")
    assert both == "1 of the 2 cases checked cannot run"
    assert list(refusals(waiting[:1], "cpu")) == []
    assert list(refusals(waiting, "cpu", 0.0)) == [
        "0 of the 1 cases checked cannot run; 1 were not checked, to save time"
    ]


def test_only_what_is_missing_or_changed_runs(study_file, tmp_path, pool):
    first, _ = swept(study_file, tmp_path / "out", pool, stand_ins.fine)
    same, said = swept(study_file, tmp_path / "out", pool, stand_ins.on_a_full_disk)
    assert "6 cases, 6 of them stored" in said
    assert_frame_equal(first, same)
    rewrite(study_file, "count: 6", "count: 11")
    _, said = swept(study_file, tmp_path / "out", pool, stand_ins.fine)
    assert "11 cases, 6 of them stored" in said
    _, said = swept(
        study_file, tmp_path / "out", pool, stand_ins.fine, ["bodies.block.thickness=9 mm"]
    )
    assert "11 cases, 0 of them stored" in said
    rewrite(study_file.with_name("block.yaml"), "thickness: 10 mm", "thickness: 11 mm")
    _, said = swept(study_file, tmp_path / "out", pool, stand_ins.fine)
    assert "11 cases, 0 of them stored" in said


def test_a_new_measure_needs_no_run(study_file, tmp_path, pool):
    swept(study_file, tmp_path / "out", pool, stand_ins.fine)
    study_file.write_text(study_file.read_text() + "  steps: {of: increments}\n")
    table, said = swept(study_file, tmp_path / "out", pool, stand_ins.on_a_full_disk)
    assert "6 cases, 6 of them stored" in said
    assert table["steps"].to_list() == [100.0 * n for n in range(1, 7)]


def test_failed_cases_have_their_row(study_file, tmp_path, pool):
    table, _ = swept(study_file, tmp_path / "out", pool, stand_ins.faulty)
    assert table["status"].to_list() == [FAILED, FAILED, *[DONE] * 4]
    assert table["reason"][0] == "element 7 is inverted" and table["reason"][2] is None


def test_what_failed_is_told_word_by_word(study_file, tmp_path, pool):
    table, _ = swept(study_file, tmp_path / "out", pool, stand_ins.faulty)
    table = table.with_columns(reason=polars.lit("no such key: '[/rate]' " + 20 * "long "))
    console = Console(file=io.StringIO(), width=80)
    print_results(load_study(study_file), table, tmp_path / "out", console)
    said = console.file.getvalue()
    assert "case 1 failed: no such key: '[/rate]' long " + 19 * "long " in said
    assert "4 of 6 cases done" in said


@pytest.mark.starts(2)
def test_a_real_run_is_thinned_and_keeps_its_measures(study_file, tmp_path, pool):
    scene = study_file.with_name("block.yaml")
    scene.write_text(scene.read_text().replace("0.1 ms", "0.005 ms"))
    study_file.write_text(
        study_file.read_text().replace("range: [2 ms, 12 ms], count: 6", "values: [12 ms]")
    )
    study = load_study(study_file)
    table = sweep(study, tmp_path / "out", nullcontext(pool), "cpu")
    assert table["status"].to_list() == [DONE] and table["energy"][0] < 1e-3
    folder = tmp_path / "out" / "cases" / table["key"][0]
    assert json.loads((folder / "summary.json").read_text())["simulated_time"] == 0.012
    times = [
        float(row.split(",")[0]) for row in (folder / "history.csv").read_text().splitlines()[2:]
    ]
    assert times[0] == 0.0 and times[-1] == pytest.approx(0.012)
    assert len(times) <= 1000 and not (folder / "results.vtkhdf").exists()


def test_cases_run_side_by_side_as_they_do_alone(study_file, tmp_path, pool):
    rewrite(study_file, "range: [2 ms, 12 ms], count: 6", "values: [2 ms, 3 ms]")
    study = load_study(study_file)
    alone = sweep(study, tmp_path / "alone", nullcontext(pool), "cpu")
    together = sweep(study, tmp_path / "together", nullcontext(pool), "cpu", batch=2)
    assert_frame_equal(alone.drop(WALL_TIME), together.drop(WALL_TIME))


def started(study_file, folder, simulate="waiting"):
    """A sweep in a process, once two of its cases have ended and the third runs; its workers."""
    process = subprocess.Popen(
        [sys.executable, str(HERE / "study_process.py"), str(study_file), str(folder), simulate],
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    deadline = time.monotonic() + 60.0
    while len(list(folder.glob("cases/*"))) < 3:
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.02)
    return process, psutil.Process(process.pid).children(recursive=True)


def goes_on(study_file, folder, pool):
    """The sweep again: two cases stay as they are, and the table is as if nothing had happened."""
    stored = {file: file.stat().st_mtime_ns for file in folder.glob("cases/*/case.json")}
    assert len(stored) == 2
    table, said = swept(study_file, folder, pool, stand_ins.fine)
    assert "6 cases, 2 of them stored" in said
    assert all(file.stat().st_mtime_ns == time for file, time in stored.items())
    other, _ = swept(study_file, folder.with_name("undisturbed"), pool, stand_ins.fine)
    assert_frame_equal(table.drop(WALL_TIME), other.drop(WALL_TIME))


def test_after_a_kill_the_same_command_goes_on(study_file, tmp_path, pool):
    process, workers = started(study_file, tmp_path / "out")
    process.kill()
    process.communicate()
    assert not psutil.wait_procs(workers, timeout=10.0)[1]
    goes_on(study_file, tmp_path / "out", pool)


@pytest.fixture
def bisection_file(study_file):
    """The file of a study that seeks the time from which on a block slips no more."""
    rewrite(study_file, ", count: 6}", "}")
    rewrite(study_file, "measures:", f"{BISECTION}\nmeasures:\n  slips: {{of: slip_share}}")
    return study_file


BISECTION = "design: {kind: bisection, factor: time, measure: slips, tolerance: 1 ms}"


def test_a_bisection_goes_on_after_a_kill(bisection_file, tmp_path, pool):
    """Killed in the third of its runs, it asks what it would have asked."""
    process, _ = started(bisection_file, tmp_path / "out")
    process.kill()
    process.communicate()
    goes_on(bisection_file, tmp_path / "out", pool)
    table = read_table(tmp_path / "out")
    assert table["time [ms]"].to_list() == [2.0, 12.0, 7.0, 4.5, 5.75, 6.375]
    draw_study(tmp_path / "out")
    found = polars.read_csv(tmp_path / "out" / "boundaries.csv").row(0, named=True)
    assert (found["low [ms]"], found["high [ms]"], found["state"]) == (5.75, 6.375, "found")
    assert found["low [ms]"] < stand_ins.EDGE < found["high [ms]"]


def test_a_plan_tells_what_is_left_and_its_cost_by_what_is_stored(bisection_file, tmp_path, pool):
    swept(bisection_file, tmp_path / "out", pool, stand_ins.slow)
    rewrite(bisection_file, "tolerance: 1 ms", "tolerance: 0.2 ms")
    console = Console(file=io.StringIO(), width=200)
    study = load_study(bisection_file)
    print_plan(study, tmp_path / "out", "cpu", 4, (), console)
    said = console.file.getvalue()
    assert "at most 8 cases, 6 of them stored, 1 to run next, at most 2 in total" in said
    told = re.search(r"about (\S+) core hours, (\S+) h with 4 workers: 2 runs of (\S+) s", said)
    hours, with_four, each = map(float, told.groups())
    assert 0.2 <= each < 2.0  # as long as its stand-in takes
    assert hours == pytest.approx(2.0 * each / 3600.0, rel=0.3)  # of two digits
    assert with_four == pytest.approx(hours / 4.0, rel=0.01)
    assert "the mean of 6 cases stored" in said


def test_an_answered_bisection_runs_nothing(bisection_file, tmp_path, pool):
    first, said = swept(bisection_file, tmp_path / "out", pool, stand_ins.fine)
    assert "at most 6 cases, 0 of them stored" in said
    same, said = swept(bisection_file, tmp_path / "out", pool, stand_ins.on_a_full_disk)
    assert "at most 6 cases, 6 of them stored" in said
    assert_frame_equal(first, same)
    rewrite(bisection_file, "tolerance: 1 ms", "tolerance: 0.5 ms")
    _, said = swept(bisection_file, tmp_path / "out", pool, stand_ins.fine)
    assert "at most 7 cases, 6 of them stored" in said


def test_a_bisection_ends_where_all_runs_fail(bisection_file, tmp_path, pool):
    table, _ = swept(bisection_file, tmp_path / "out", pool, stand_ins.faulty)
    assert table["status"].to_list() == [FAILED, FAILED]
    (told,) = boundaries_in_words(Findings.read(tmp_path / "out"))
    assert told.startswith("not determined, because all runs at one level failed")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_to_all_leaves_checkpoints_and_no_processes(study_file, tmp_path, pool, number):
    folder = tmp_path / "out"
    process, workers = started(study_file, folder)
    os.killpg(process.pid, number)  # as Ctrl-C at a terminal, or the end of a job on a cluster
    _, said = process.communicate(timeout=60.0)
    assert process.returncode == 4
    assert f"stopped by {number.name}, 2 of 6 cases\n  repeat the command to continue" in said
    assert "Traceback" not in said
    assert not psutil.wait_procs(workers, timeout=10.0)[1]
    assert read_study(folder).status == "interrupted"
    assert read_table(folder)["status"].to_list() == [DONE, DONE, *[WAITING] * 4]
    assert len(list(folder.glob("cases/*/checkpoint.h5"))) == 1
    goes_on(study_file, folder, pool)


def test_a_signal_during_the_start_of_workers_ends_the_study(study_file, tmp_path, pool):
    """They are still importing the program, and none has registered."""
    folder = tmp_path / "out"
    process = subprocess.Popen(
        [sys.executable, str(HERE / "study_process.py"), str(study_file), str(folder), "fine"],
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    while not (folder / "study.json").is_file():
        assert process.poll() is None
        time.sleep(0.02)
    time.sleep(0.3)
    workers, asked = psutil.Process(process.pid).children(recursive=True), time.monotonic()
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=60.0)
    assert time.monotonic() - asked < 5.0
    assert process.returncode == 4
    assert said == "stopped by SIGTERM, 0 of 6 cases\n  repeat the command to continue\n"
    assert running(workers) == []
    assert read_study(folder).status == "interrupted"
    assert set(swept(study_file, folder, pool, stand_ins.fine)[0]["status"]) == {DONE}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("phase", ["key_of", "refusals"])
def test_a_signal_before_workers_start_ends_the_study(
    study_file, tmp_path, pool, monkeypatch, phase, number
):
    """While cases are loaded, and while models are built; what is stored stays in the table."""
    before = signal.getsignal(number)
    folder = tmp_path / "out"
    file = {"key_of": "softsim.sweep.job", "refusals": "softsim.sweep.study"}[phase]
    for stored in (0, 6):
        with (
            monkeypatch.context() as patch,
            pytest.raises(Interrupted, match=f"stopped by {number.name}, 0 of ") as stopped,
        ):
            patch.setattr(f"{file}.{phase}", lambda *_: os.kill(os.getpid(), number))
            swept(study_file, folder, None, stand_ins.fine)
        assert (stopped.value.exit_code, stopped.value.hint) == (
            4,
            "repeat the command to continue",
        )
        assert signal.getsignal(number) is before
        assert read_study(folder).status == "interrupted"
        assert read_table(folder)["status"].to_list().count(DONE) == stored
        table, said = swept(study_file, folder, pool, stand_ins.fine)
        assert f"6 cases, {stored} of them stored" in said and set(table["status"]) == {DONE}


def running(processes):
    """Return the processes that still run after a second; zombies do not."""
    left = psutil.wait_procs(processes, timeout=1.0)[1]
    return [one for one in left if one.is_running() and one.status() != psutil.STATUS_ZOMBIE]


def test_sigterm_acts_within_five_seconds_while_a_worker_compiles(study_file, tmp_path, pool):
    """The worker does not respond: it holds the interpreter."""
    folder = tmp_path / "out"
    process, workers = started(study_file, folder, "compiling")
    asked = time.monotonic()
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=60.0)
    assert time.monotonic() - asked < 5.0
    assert process.returncode == 4
    assert "stopped by SIGTERM, 2 of 6 cases\n  repeat the command to continue" in said
    assert "Traceback" not in said
    assert running(workers) == []
    assert read_study(folder).status == "interrupted"
    assert read_table(folder)["status"].to_list() == [DONE, DONE, *[WAITING] * 4]
    goes_on(study_file, folder, pool)


def test_a_folder_has_one_sweep_at_a_time(study_file, tmp_path, pool):
    (tmp_path / "out").mkdir()
    with (
        claimed(tmp_path / "out"),
        pytest.raises(OutputError, match=f"process {os.getpid()} on .* is using"),
    ):
        swept(study_file, tmp_path / "out", pool, stand_ins.fine)
    assert len(swept(study_file, tmp_path / "out", pool, stand_ins.fine)[0]) == 6


def test_a_folder_that_cannot_be_made(study_file, tmp_path, pool):
    with pytest.raises(OutputError, match=r"cannot write to the run folder .*cases"):
        swept(study_file, study_file / "out", pool, stand_ins.fine)


def test_what_an_optimisation_stopped_early_runs_to_its_end(study_file, tmp_path, pool):
    table, _ = swept(study_file, tmp_path / "out", pool, stand_ins.fine)
    pruned = tmp_path / "out" / "cases" / table["key"][1] / "case.json"
    rewrite(pruned, '"done"', '"pruned"')
    again, said = swept(study_file, tmp_path / "out", pool, stand_ins.fine)
    assert "6 cases, 5 of them stored" in said and set(again["status"]) == {DONE}


@pytest.mark.physics
def test_a_scheduler_has_its_own_workers(tmp_path):
    with pytest.raises(ClusterError, match="already has workers"):
        pool_for(tmp_path, "cpu", 2, "tcp://127.0.0.1:9")


@pytest.mark.physics
def test_a_scheduler_that_does_not_answer(tmp_path):
    nobody = remote_pool("tcp://127.0.0.1:9", tmp_path)
    with (
        pytest.raises(ClusterError, match=r"no dask scheduler responds at tcp://127.0.0.1:9"),
        nobody,
    ):
        pytest.fail("somebody answered")
