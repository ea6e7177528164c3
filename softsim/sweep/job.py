"""A job: a case to run, and where; its outcome, which is kept in case.json of its folder."""

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from softsim.errors import OutputError
from softsim.output.folder import RunFolder, explained, read_summary
from softsim.output.stop_conditions import MakesStopCondition
from softsim.output.study_folder import CASES
from softsim.study.cases import Case, key_of

CASE = "case.json"
FAILURE = "failure.txt"
STARTS = "starts"

THIN, EVERYTHING = "thin", "everything"
"""What is kept of a case: a thinned history and no fields, or all that a run leaves."""


PRUNING = "pruning"
"""What the summary of a trial that was stopped early says has ended its run."""


@dataclass(frozen=True)
class Job:
    """A case to run in `folder`.

    key: digest of all that decides its result; jobs of the same key are one run. device: auto, cpu,
    cuda. keep: THIN or EVERYTHING. stop_conditions: what may end the run before its
    time.
    """

    case: Case
    key: str
    folder: Path
    device: str = "auto"
    keep: str = THIN
    stop_conditions: tuple[MakesStopCondition, ...] = ()


def jobs_of(cases: Sequence[Case], folder: Path, device: str, keep: str) -> list[Job]:
    """The job of each case of a study in `folder`, in their order."""
    place = folder.resolve() / CASES
    keyed = [(case, key_of(case)) for case in cases]
    return [Job(case, key, place / key, device, keep) for case, key in keyed]


@dataclass(frozen=True)
class Outcome:
    """What came of a job.

    status: as `softsim.study.cases` names them. reason: why it failed, or what a finished
    run missed of what its scene expects. wall_time: of its last attempt [s]. summary: of its run.
    """

    key: str
    status: str
    reason: str = ""
    wall_time: float = 0.0
    summary: Mapping[str, Any] = field(default_factory=dict)


def write_outcome(job: Job, outcome: Outcome) -> None:
    """Write case.json, which says that the case has ended. Raises OutputError."""
    content = {
        "key": outcome.key,
        "status": outcome.status,
        "reason": outcome.reason,
        "wall_time": outcome.wall_time,
        "scene": job.case.source.scene,
        "robot": job.case.source.robot,
        "values": job.case.values,
        "overrides": job.case.overrides,
    }
    RunFolder(job.folder).write_json_atomic(CASE, content)


def stored_outcome(folder: Path) -> Outcome | None:
    """What came of the case that `folder` holds; None where none has ended there.

    Raises OutputError where its case.json is none of ours.
    """
    file = folder / CASE
    if not file.is_file():
        return None
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        return Outcome(
            found["key"], found["status"], found["reason"], found["wall_time"], read_summary(folder)
        )
    except (ValueError, KeyError) as error:
        raise OutputError(
            f"{file} is not what softsim wrote: {error!r}",
            hint=f"remove the folder {folder}: its case runs anew",
        ) from error


def known_outcome(job: Job, again: Collection[str]) -> Outcome | None:
    """The stored outcome of a job that need not run; `again` are statuses that must all the same.

    Raises OutputError as stored_outcome does.
    """
    outcome = stored_outcome(job.folder)
    return None if outcome is None or outcome.status in again else outcome


def note_start(job: Job) -> None:
    """Note that a worker begins with a job: what brings its process down leaves the note."""
    with (job.folder / STARTS).open("a", encoding="utf-8") as stream:
        stream.write(".")


def starts(job: Job) -> int:
    """How often a worker has begun with a job since it was given out, without coming to an end."""
    file = job.folder / STARTS
    return file.stat().st_size if file.is_file() else 0


def forget_starts(job: Job) -> None:
    """Nothing has begun yet, or it has come to an end. Raises OutputError."""
    with explained(job.folder / STARTS):
        (job.folder / STARTS).unlink(missing_ok=True)
