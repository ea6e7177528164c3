"""How a run ended, in sentences."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from softsim.report.readable import duration

GOOD, BAD, OPEN = "good", "bad", "open"

ENDS = {"passed": GOOD, "stuck": BAD, "unfinished": OPEN}
"""Verdict of a layout -> how it is to be taken."""


@dataclass(frozen=True)
class Verdict:
    """A sentence; kind: good, bad or open."""

    kind: str
    words: str


def verdicts(summary: Mapping[str, Any], scene: Mapping[str, Any]) -> Iterator[Verdict]:
    """How the run ended, what it says of a layout, and whether the scene's expectations are met.

    scene: the resolved one.
    """
    status, failure = summary.get("status"), summary.get("failure")
    if status == "done":
        took = f"{summary['simulated_time']:.4g} s in {duration(summary['wall_time'])}"
        yield Verdict(GOOD, f"done: simulated {took}")
    elif status == "aborted":
        yield Verdict(BAD, f"aborted: {failure or 'by an error that is in run.log'}")
    elif status == "interrupted":
        yield Verdict(OPEN, "interrupted: what follows is what there is; --resume goes on with it")
    else:
        yield Verdict(OPEN, "not finished: the run still goes on, or was killed")
    if "layout" in summary:
        yield Verdict(ENDS[summary["layout"]["verdict"]], summary["layout"]["sentence"])
    expected = list(expectations(scene.get("expect") or {}))
    if status == "done" and failure is not None:
        yield Verdict(BAD, failure)
    elif status == "done" and expected:
        yield Verdict(GOOD, f"as the scene expects: {'; '.join(expected)}")


def expectations(expect: Mapping[str, Any]) -> Iterator[str]:
    """What a scene's `expect` block demands, item by item."""
    for name, wanted in expect.items():
        if isinstance(wanted, Mapping):
            limits = [f"{word} {value}" for word, value in wanted.items() if value is not None]
            yield f"{name.replace('_', ' ')} {', '.join(limits)}"
        elif name == "exit" and wanted is not None:
            yield f"the robot leaves by the exit '{wanted}'"
        elif wanted is not None:
            yield "the robot passes" if wanted else "the robot gets stuck"
