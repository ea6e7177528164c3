"""What a validation script is."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

from validation.cases import Case, Outcomes
from validation.digitised import Points
from validation.verdicts import Row


@dataclass(frozen=True)
class Listing:
    """A table of results beside the verdicts: a heading a column, a text a cell."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def no_listings(outcomes: Outcomes) -> Iterable[Listing]:
    """Nothing to list beside the rows."""
    return ()


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
    columns: of the digitised points, the measured quantity last; none where the thesis's figure has
    no points to read off.
    remarks: sentences below the rows: reasons for a disagreement, what a number means.
    listings: tables below the remarks: what was found, case by case.
    """

    name: str
    figure: str
    about: str
    cases: Callable[[bool], list[Case]]
    rows: Callable[[Outcomes, Points | None], Iterable[Row]]
    draw: Callable[[Outcomes, Points | None, Path], None]
    columns: tuple[str, ...]
    remarks: Callable[[Outcomes], Iterable[str]] = no_remarks
    listings: Callable[[Outcomes], Iterable[Listing]] = no_listings
