"""Page of a study: factors, best case, every plot and every case in one file."""

from base64 import b64encode
from pathlib import Path
from typing import Any

import polars

from softsim.output.folder import TABLE_TEXT, WARNINGS
from softsim.report.figures import duration
from softsim.report.page.run import PAGE, write_page
from softsim.report.study.boundary import boundaries_in_words
from softsim.report.study.findings import Findings, best_in_words, title_of, written
from softsim.report.study.plots import pass_rate_in_words, study_charts
from softsim.study.cases import DONE, FAILED, LOST, PRUNED, WAITING

MOST_LEVELS = 12
"""Largest number of levels of a factor that are listed individually."""

MOST_NAMED = 8
"""Largest number of cases that are listed for each reason of failure."""


def write_study_page(folder: Path) -> Path:
    """Write report.html into the folder of a study, from the results so far; return its path.

    Raises OutputError if the folder holds no study, a plot names no axis of it, or the file
    cannot be written.
    """
    findings, path = Findings.read(folder), folder / PAGE
    write_page("study.html", page_context(findings, folder), path)
    return path


def page_context(findings: Findings, folder: Path) -> dict[str, Any]:
    """Return the variables of the template."""
    kind, words = state_of(findings)
    table = (folder / TABLE_TEXT).read_bytes()
    return {
        "title": findings.record.title,
        "kind": kind,
        "words": words,
        "best": best_in_words(findings),
        "pass_rate": pass_rate_in_words(findings),
        "boundaries": boundaries_in_words(findings),
        "charts": study_charts(findings),
        "factors": [(title_of(f), level_words(findings, f.name)) for f in findings.factors],
        "settings": settings_of(findings),
        "reasons": reasons_of(findings),
        "cases": {
            "headings": findings.table.columns,
            "columns": [column.to_list() for column in findings.table],
            "factors": [axis.column for axis in findings.factors],
            "measures": [axis.column for axis in findings.measures],
        },
        "download": f"data:text/csv;base64,{b64encode(table).decode()}",
        "download_name": TABLE_TEXT,
    }


def state_of(findings: Findings) -> tuple[str, str]:
    """Return the state of the study: good, open or bad, and in words."""
    counts = dict(findings.table["status"].value_counts().iter_rows())
    total = findings.table.height
    said = [f"{counts.get(DONE, 0)} of {total} cases done"]
    said += [f"{counts[s]} {s}" for s in (FAILED, LOST, PRUNED, WAITING) if counts.get(s)]
    doubtful = warned_count(findings)
    if doubtful:
        said.append(f"{doubtful} with warnings, listed in summary.json of each case")
    words = f"{findings.record.status}: {', '.join(said)}"
    if findings.record.status != "done" or counts.get(WAITING):
        return "open", words
    if not counts.get(DONE):
        return "bad", words
    is_doubtful = counts.get(FAILED) or counts.get(LOST) or doubtful
    return ("open" if is_doubtful else "good"), words


def warned_count(findings: Findings) -> int:
    """Return the number of cases whose runs gave a warning."""
    table = findings.table
    return table[WARNINGS].count() if WARNINGS in table.columns else 0


def level_words(findings: Findings, name: str) -> str:
    """Return the levels of a factor as a list, or their number and range."""
    axis = findings.axis(name)
    levels = findings.table[axis.column].drop_nulls().unique(maintain_order=True)
    if len(levels) <= MOST_LEVELS:
        return ", ".join(written(axis, level) for level in levels)
    if axis.is_label:
        return f"{len(levels)} levels"
    return f"{len(levels)} values, {written(axis, levels.min())} to {written(axis, levels.max())}"


def settings_of(findings: Findings) -> list[tuple[str, str]]:
    """Return the settings, wall time and version of the study as (name, text)."""
    record = findings.record
    return [
        ("study", record.source),
        *(record.settings or {}).items(),
        ("wall time", duration(record.wall_time)),
        ("softsim", record.version),
    ]


def reasons_of(findings: Findings) -> list[tuple[str, int, str]]:
    """Return the reasons of failed cases, the most frequent first: reason, number, first cases."""
    failed = findings.table.filter(polars.col("status").is_in([FAILED, LOST]))
    groups = failed.group_by("reason", maintain_order=True).agg("case")
    found = []
    for reason, cases in groups.iter_rows():
        named = ", ".join(map(str, cases[:MOST_NAMED]))
        more = " ..." if len(cases) > MOST_NAMED else ""
        found.append((reason or "no reason recorded", len(cases), named + more))
    return sorted(found, key=lambda group: -group[1])
