"""Steps that a run takes from another run's folder in place of computing them anew."""

import shutil
from collections.abc import Mapping
from pathlib import Path

from softsim.errors import OutputError
from softsim.machine import Choice
from softsim.output.checkpoint import read_checkpoint
from softsim.output.folder import (
    CHECKPOINT,
    HISTORY,
    LOG,
    RESULTS,
    SCENE,
    SUMMARY,
    RunFolder,
    read_summary,
    replacing,
)
from softsim.scene.steps import Step

FILES = (SCENE, HISTORY, RESULTS, CHECKPOINT, LOG)
"""Files of a step, apart from its summary, which is written last."""


def refuse_source(source: Path, folder: Path, resume: bool) -> None:
    """Raise OutputError where a run in `folder` cannot take steps from `source`."""
    if resume:
        raise OutputError(
            "--from and --resume cannot be combined",
            "a run started with --from has the reused steps in its folder: continue it with "
            "--resume alone",
        )
    if source.resolve() == folder.resolve():
        raise OutputError(
            f"{source} is the folder of this run",
            "continue it with --resume, or choose another folder with --out",
        )


def fitting_steps(
    source: Path, named: Mapping[str, Step], choice: Choice
) -> tuple[list[Path], str]:
    """Return the folders of the first steps in `source` that can be reused, and why not the next.

    A step can be reused if it is complete there and identical to the requested one. The reason is
    "" if there is no further step. named: folder name -> requested step.

    Raises OutputError if not even the first step can be reused.
    """
    told = read_summary(source).get("steps")
    if told is None:
        raise OutputError(
            f"{source} is not the run folder of a scene with steps",
            "name the run folder of a scene with steps",
        )
    found: list[Path] = []
    for name, step in named.items():
        if name in [one["folder"] for one in told]:
            reason = why_not(source / name, step, choice)
        else:
            reason = f"it has no folder {name}, only {', '.join(one['folder'] for one in told)}"
        if reason and not found:
            raise OutputError(
                f"no step of {source} can be reused: {reason}",
                "name a run whose first step is identical, or leave out --from",
            )
        if reason:
            return found, reason
        found.append(source / name)
    return found, ""


def why_not(path: Path, step: Step, choice: Choice) -> str:
    """Return why a step's folder does not hold the requested step, complete; "" if it does."""
    status = read_summary(path).get("status", "not begun")
    if status != "done":
        return f"{path.name} is not complete there, but {status}"
    if not (path / CHECKPOINT).is_file():
        return f"{path.name} has no {CHECKPOINT}"
    checkpoint = read_checkpoint(path / CHECKPOINT)
    mismatch = checkpoint.mismatch(step.loaded)
    if mismatch:
        return f"{path.name} {mismatch}"
    if not choice.allows(checkpoint.device):
        return f"{path.name} was computed on {checkpoint.device}, this is {choice.device}"
    return ""


def take_step(source: Path, target: RunFolder) -> None:
    """Copy the files of a completed step; its summary records their source.

    Raises OutputError if it cannot be read, or the disk refuses.
    """
    summary = read_summary(source) | {"taken_from": str(source)}
    for name in FILES:
        if (source / name).is_file():
            with replacing(target.path / name) as partial:
                shutil.copyfile(source / name, partial)
    target.write_json_atomic(SUMMARY, summary)
