"""What a validation script is."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from validation.cases import Case, Outcomes
from validation.digitised import Points
from validation.verdicts import Row


def no_remarks(outcomes: Outcomes) -> Iterable[str]:
    """Nothing to say beside the rows."""
    return ()


@dataclass(frozen=True)
class Script:
    """A figure of the thesis, what is run for it, what is claimed of it, and how it is drawn.

    name: that of the module. figure: of the thesis. about: what is shown, in one paragraph.
    cases: all (False), or those of the quick subset (True).
    rows: verdicts, from the outcomes of all cases by name. Those that were not run or failed have
    a `failure` and no numbers: claims that rest on them cannot be told.
    draw: one figure into a PNG file, of whatever is there.
    columns: of the digitised points, the measured quantity last.
    remarks: sentences below the rows: reasons for a disagreement, what a number means.
    """

    name: str
    figure: str
    about: str
    cases: Callable[[bool], list[Case]]
    rows: Callable[[Outcomes, Points | None], Iterable[Row]]
    draw: Callable[[Outcomes, Points | None, Path], None]
    columns: tuple[str, ...]
    remarks: Callable[[Outcomes], Iterable[str]] = no_remarks
