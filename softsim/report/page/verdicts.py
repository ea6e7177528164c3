"""Sentences on how a run ended."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from softsim.report.readable import counted, duration

GOOD, BAD, OPEN = "good", "bad", "open"

ENDS = {"passed": GOOD, "stuck": BAD, "unfinished": OPEN}
"""Kind of a verdict by the verdict on a layout."""


@dataclass(frozen=True)
class Verdict:
    """Sentence on the result of a run; kind: good, bad or open."""

    kind: str
    words: str


def verdicts(summary: Mapping[str, Any], scene: Mapping[str, Any]) -> Iterator[Verdict]:
    """Yield how the run ended, the verdict on a layout, and whether the run is as expected.

    A run with warnings has no verdict "good"; it is "open" instead.

    Parameters
    ----------
    summary : mapping
        Content of summary.json.
    scene : mapping
        The resolved scene.

    Returns
    -------
    iterator of Verdict
    """
    status, failure = summary.get("status"), summary.get("failure")
    warned = len(summary.get("warnings", []))
    good = OPEN if warned else GOOD
    if status == "done":
        took = f"{summary['simulated_time']:.4g} s in {duration(summary['wall_time'])}"
        doubt = f", with {counted(warned, 'warning')}" if warned else ""
        yield Verdict(good, f"done{doubt}: simulated {took}")
    elif status == "aborted":
        yield Verdict(BAD, f"aborted: {failure or 'by an error that is in run.log'}")
    elif status == "interrupted":
        yield Verdict(OPEN, "interrupted: results up to the interruption; continue with --resume")
    else:
        yield Verdict(OPEN, "not finished: the run is still active, or was killed")
    if "layout" in summary:
        kind = ENDS[summary["layout"]["verdict"]]
        yield Verdict(good if kind == GOOD else kind, summary["layout"]["sentence"])
    expected = list(expectations(scene.get("expect") or {}))
    if status == "done" and failure is not None:
        yield Verdict(BAD, failure)
    elif status == "done" and expected:
        yield Verdict(good, f"expectations of the scene met: {'; '.join(expected)}")


def expectations(expect: Mapping[str, Any]) -> Iterator[str]:
    """Yield the requirements of a scene's `expect` block, item by item."""
    for name, wanted in expect.items():
        if isinstance(wanted, Mapping):
            limits = [f"{word} {value}" for word, value in wanted.items() if value is not None]
            yield f"{name.replace('_', ' ')} {', '.join(limits)}"
        elif name == "exit" and wanted is not None:
            yield f"the robot leaves through the exit '{wanted}'"
        elif wanted is not None:
            yield "the robot passes" if wanted else "the robot gets stuck"
