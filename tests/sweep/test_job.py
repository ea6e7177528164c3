"""Jobs that a worker runs side by side."""

from types import SimpleNamespace

import pytest

import softsim.run
import softsim.run.scenes
from softsim.errors import Interrupted, OutputError
from softsim.study.cases import Case, Source
from softsim.sweep import job


@pytest.fixture
def jobs(tmp_path, monkeypatch):
    """Two jobs whose scenes need no file; each run alone notes its folder."""
    monkeypatch.setattr(job, "scene_of", lambda job: SimpleNamespace(key=job.key))
    source = Source(tmp_path / "scene.yaml")
    return [job.Job(Case(k, source), f"key{k}", tmp_path / str(k)) for k in (1, 2)]


def brought_down_by(error):
    def run_batch(*_):
        raise error

    return run_batch


def test_a_batch_that_one_brings_down_is_run_one_by_one(jobs, monkeypatch):
    fault = ValueError("of the first alone")

    def run_alone(scene, *_, **__):
        if scene.key == "key1":
            raise fault

    monkeypatch.setattr(softsim.run, "run_batch", brought_down_by(RuntimeError("of all")))
    monkeypatch.setattr(softsim.run.scenes, "run_case", run_alone)
    assert job.simulate(jobs) == [fault, None]


@pytest.mark.parametrize("error", [Interrupted("stopped"), OutputError("the disk is full")])
def test_a_stop_and_a_full_disk_concern_all(jobs, monkeypatch, error):
    monkeypatch.setattr(softsim.run, "run_batch", brought_down_by(error))
    assert job.simulate(jobs) == [error, error]


@pytest.mark.parametrize(
    "content",
    ["[]", "null", "1", "{", '"done"', "{}", '{"key": 1, "status": "done"}',
     '{"key": "k", "status": "done", "reason": "", "wall_time": "long"}',
     '{"key": "k", "status": ["done"], "reason": "", "wall_time": 1.0}'],
)  # fmt: skip
def test_a_damaged_outcome_is_refused_by_name(tmp_path, content):
    (tmp_path / job.CASE).write_text(content)
    with pytest.raises(
        OutputError, match=r"case\.json is not a file written by softsim: ."
    ) as refused:
        job.stored_outcome(tmp_path)
    assert "to run its case again" in refused.value.hint


def test_an_outcome_comes_back_as_it_was_written(jobs):
    jobs[0].folder.mkdir()
    outcome = job.Outcome("key1", "failed", "a guard stopped it", 2.0)
    job.write_outcome(jobs[0], outcome)
    assert job.stored_outcome(jobs[0].folder) == outcome
