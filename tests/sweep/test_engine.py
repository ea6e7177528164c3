"""The engine with stand-ins for simulations: order, window, what is stored, what dies."""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
import stand_ins

from softsim.errors import OutputError
from softsim.study.cases import DONE, FAILED, LOST, Case, Source
from softsim.sweep.engine import MOST_GROWTH, WorkerPool, completed, local_pool
from softsim.sweep.job import EVERYTHING, Job


@pytest.fixture
def jobs(tmp_path):
    """Jobs of so many cases; `keys` says which are the same run."""
    cases = tmp_path / "cases"
    cases.mkdir()

    def make(count, keys=None, **settings):
        source = Source(Path("none.yaml"))
        return [
            Job(Case(i + 1, source, values={"rate": i}), key, cases / key, **settings)
            for i, key in enumerate(keys or [f"key{i}" for i in range(count)])
        ]

    return make


def outcomes(found):
    return {job.case.number: outcome for job, outcome in found}


def test_all_cases_end_with_their_summary_and_are_thinned(pool, jobs):
    found = outcomes(completed(jobs(5), pool, simulate=stand_ins.fine))
    assert {number: o.summary["increments"] for number, o in found.items()} == {
        n: 100 * n for n in range(1, 6)
    }
    assert {o.status for o in found.values()} == {DONE}


def test_thin_and_everything(pool, jobs):
    (thin,) = jobs(1)
    list(completed([thin], pool, simulate=stand_ins.fine))
    assert sorted(p.name for p in thin.folder.iterdir()) == [
        "case.json", "history.csv", "summary.json",
    ]  # fmt: skip
    (whole,) = jobs(1, ["whole"], keep=EVERYTHING)
    list(completed([whole], pool, simulate=stand_ins.fine))
    assert (whole.folder / "results.vtkhdf").exists() and (whole.folder / "checkpoint.h5").exists()


def test_jobs_are_pulled_as_workers_become_free(pool, jobs):
    pulled, ended = [], []

    def source():
        for job in jobs(8):
            pulled.append(len(ended))
            yield job

    for job, _ in completed(source(), pool, simulate=stand_ins.slow):
        ended.append(job.case.number)
    in_flight = [index - before for index, before in enumerate(pulled)]
    assert max(in_flight) < pool.size and sorted(ended) == list(range(1, 9))


def test_stored_cases_are_not_run_again(pool, jobs):
    first = outcomes(completed(jobs(3), pool, simulate=stand_ins.fine))
    again = outcomes(completed(jobs(3), pool, simulate=stand_ins.on_a_full_disk))
    assert again == first


def test_failed_ones_run_again_when_asked(pool, jobs):
    first = outcomes(completed(jobs(3), pool, simulate=stand_ins.faulty))
    assert [first[n].status for n in (1, 2, 3)] == [FAILED, FAILED, DONE]
    assert first[1].reason == "element 7 is inverted" and "no such" in first[2].reason
    told = [(job.folder / "failure.txt").read_text() for job in jobs(2)]
    assert "smaller steps" in told[0] and "Traceback" not in told[0]
    assert (jobs(1)[0].folder / "results.vtkhdf").exists()  # shows why
    assert outcomes(completed(jobs(3), pool, simulate=stand_ins.fine)) == first
    again = completed(jobs(3), pool, again=(FAILED, LOST), simulate=stand_ins.fine)
    assert {o.status for o in outcomes(again).values()} == {DONE}
    assert not (jobs(1)[0].folder / "failure.txt").exists()


def test_the_same_key_is_one_run(pool, jobs):
    same = jobs(4, ["a", "a", "b", "a"])
    found = outcomes(completed(same, pool, simulate=stand_ins.slow))
    assert len({found[n].summary["increments"] for n in (1, 2, 4)}) == 1
    assert len(found) == 4 and len({o.key for o in found.values()}) == 2


@pytest.mark.parametrize("keys", [list("abcde"), list("aaaab")])
def test_units_of_several_jobs(pool, jobs, keys):
    found = outcomes(completed(jobs(5, keys), pool, batch=3, simulate=stand_ins.fine))
    assert [found[n].key for n in range(1, 6)] == keys


def test_a_case_that_kills_its_process_is_lost_and_the_others_go_on(pool, jobs):
    found = outcomes(completed(jobs(4), pool, simulate=stand_ins.deadly))
    assert [found[n].status for n in (1, 2, 3, 4)] == [LOST, DONE, DONE, DONE]
    assert "ended unexpectedly 2 times" in found[1].reason
    case = json.loads((jobs(1)[0].folder / "case.json").read_text())
    assert case["status"] == LOST and case["values"] == {"rate": 0}


def test_a_process_that_has_grown_is_replaced(pool, jobs):
    """Each keeps 200 MB: a process is replaced after its third, but may have begun its fourth."""
    found = outcomes(completed(jobs(12), pool, simulate=stand_ins.hungry))
    assert {o.status for o in found.values()} == {DONE}
    summaries = [outcome.summary for outcome in found.values()]
    each = Counter(summary["process"] for summary in summaries)
    assert len(each) > 2 and max(each.values()) <= 4
    memory = [summary["memory"] for summary in summaries]
    assert max(memory) < min(memory) + MOST_GROWTH + 2 * 200e6 + 50e6


class Overbooked(WorkerPool):
    """It says that it has a worker more, whose unit waits behind the other's."""

    @property
    def size(self):
        return super().size + 1


@pytest.fixture
def overbooked():
    """A pool of one worker that gets two units."""
    with local_pool(1) as pool:
        yield Overbooked(pool.client)


@pytest.mark.parametrize("batch", [1, 2])
@pytest.mark.physics
def test_a_case_that_only_waited_where_one_died_is_not_lost(overbooked, jobs, batch):
    """Nor one that ran beside it."""
    found = outcomes(completed(jobs(4), overbooked, batch=batch, simulate=stand_ins.deadly_first))
    assert [found[n].status for n in (1, 2, 3, 4)] == [LOST, DONE, DONE, DONE]


def test_a_full_disk_ends_the_study(pool, jobs):
    with pytest.raises(OutputError, match="no space left"):
        list(completed(jobs(4), pool, simulate=stand_ins.on_a_full_disk))
    assert not (jobs(1)[0].folder / "case.json").exists()


def test_nothing_to_do(pool):
    assert list(completed([], pool)) == []


@pytest.mark.physics
def test_workers_that_cannot_start_are_reported(tmp_path):
    """They import the main script, which fails there."""
    script = tmp_path / "script.py"
    script.write_text(
        "from softsim.sweep.engine import local_pool\n"
        "if __name__ != '__main__':\n    raise SystemExit('no licence')\n"
        "with local_pool(1):\n    print('started')\n"
    )
    ended = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60.0)
    assert ended.returncode == 1 and ended.stdout == ""
    assert ended.stderr.startswith("no licence\n")
    assert "ClusterError: worker processes ended while they started" in ended.stderr
