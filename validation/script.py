"""Interface of a validation script, and the pages that scripts are written to."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from validation.cases import Case, Outcomes
from validation.digitised import Points
from validation.verdicts import IN_SECTION, Row


@dataclass(frozen=True)
class Evidence:
    """Page of validation.

    name: in texts and in the JSON file; title: of the page; file: its name in the output folder;
    package: of its scripts; columns: heading -> field of `Row`, before the verdict.
    """

    name: str
    title: str
    file: str
    package: str
    columns: Mapping[str, str]


THESIS = Evidence(
    "thesis",
    "softsim against the thesis",
    "index.html",
    "validation",
    {"claim": "claim", "reference": "reference", "computed": "computed"},
)
PUBLISHED = Evidence(
    "published data",
    "softsim against published measurements",
    "published.html",
    "validation.published",
    {
        "case": "claim",
        "measured": "reference",
        "predicted": "computed",
        "error": "error",
        "band": "band",
    },
)


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


@dataclass(frozen=True, kw_only=True)
class Script:
    """Figure of the thesis or published data set, with its cases, claims and drawing.

    name: that of the module. figure: of the thesis, or the source of the data. about: what is
    shown; paragraphs are separated by blank lines. For published data: the protocol.
    cases: all; none by default. quick: names of the cases of the quick subset; () for a script that
    needs no run, None for one that the subset leaves out.
    rows: verdicts, from the outcomes of all cases by name. Those that were not run or failed have
    a `failure` and no numbers: claims that rest on them are undecided.
    draw: one figure into a PNG file, of whatever is there.
    columns: of the digitised points, the measured quantity last; none by default, for a figure of
    the thesis without points to read off and for published data.
    remarks: sentences below the rows: reasons for a disagreement, what a number means.
    listings: tables below the remarks: what was found, case by case.
    evidence: page that the script belongs to.
    model: of its rows, where they have none of their own.
    data: folder of the measurements; the script is skipped where it is absent.
    """

    name: str
    figure: str
    about: str
    cases: Callable[[], list[Case]] = list
    rows: Callable[[Outcomes, Points | None], Iterable[Row]]
    draw: Callable[[Outcomes, Points | None, Path], None]
    columns: tuple[str, ...] = ()
    remarks: Callable[[Outcomes], Iterable[str]] = no_remarks
    listings: Callable[[Outcomes], Iterable[Listing]] = no_listings
    evidence: Evidence = THESIS
    model: str = IN_SECTION
    data: Path | None = None
    quick: tuple[str, ...] | None = None

    def chosen(self, quick: bool) -> list[Case]:
        """Return all cases, or those of the quick subset."""
        return [c for c in self.cases() if not quick or c.name in (self.quick or ())]

    def reason_to_skip(self, quick: bool) -> str:
        """Return why the script is left out, as a sentence; empty if it is not."""
        if self.data is not None and not self.data.is_dir():
            return f"{self.name}: skipped, because the folder of its data is absent: {self.data}"
        if quick and self.quick is None:
            return f"{self.name}: left out of the quick subset; run it by {self.command}"
        return ""

    @property
    def command(self) -> str:
        """Command that repeats this script."""
        return f"python -m {self.evidence.package}.{self.name}"
