"""Pages of verdicts: on the console, as validation.json, and one HTML page per evidence."""

import base64
import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from html import escape
from itertools import groupby
from pathlib import Path
from string import Template
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.markup import escape as plain
from rich.table import Table

from softsim.report.table import Table as TextTable
from validation.script import PUBLISHED, THESIS, Evidence, Listing, Script
from validation.statements import STATEMENTS, Statement
from validation.verdicts import (
    AGREES,
    DISAGREES,
    IN_PART,
    MODELS,
    RULE,
    TRIAL,
    UNEXAMINED,
    UNKNOWN,
    VERDICTS_OF_STATEMENTS,
    Row,
    counts,
    verdict_of,
)

TEMPLATE = Template(Path(__file__).with_name("page.html").read_text(encoding="utf-8"))
PLURAL = {AGREES: "agree", IN_PART: "agree in part", DISAGREES: "disagree"}
COLOURS = {AGREES: "green", IN_PART: "yellow", DISAGREES: "red"}
SUB_CLAIMS = {
    "sub-claim": "claim",
    "thesis": "reference",
    "computed": "computed",
    "model": "model",
    "script": "script",
}
"""Columns of the table of sub-claims: heading -> field of `Row`."""
FITTED = "fitted: stiffness of the sleeve"
QUICK = "This is the quick subset: most runs, and some scripts, are left out."
TITLE = "Statements of the thesis: sub-claims that agree, of those decided; ? undecided"
LISTED = 3  # results of a model that are shown beside their count


@dataclass(frozen=True)
class Section:
    """Results of a script.

    compared: True if digitised points of the figure were compared; wall_time: of its cases and of
    its evaluation [s].
    """

    script: Script
    rows: tuple[Row, ...]
    remarks: tuple[str, ...]
    compared: bool
    figure: Path
    listings: tuple[Listing, ...] = ()
    wall_time: float = 0.0

    @property
    def basis(self) -> str:
        """Sentence on the data that were compared."""
        if self.script.evidence is PUBLISHED:
            return f"Compared with: {self.name}."
        if self.compared:
            return f"Held against the thesis's statements and digitised points of {self.name}."
        return f"Held against the thesis's statements only: no digitised points of {self.name}."

    @property
    def name(self) -> str:
        """Figure of the thesis, or source of the data."""
        return self.script.figure


def all_rows(sections: Iterable[Section]) -> list[Row]:
    """Return the rows of all sections."""
    return [row for section in sections for row in section.rows]


def by_statement(sections: Iterable[Section]) -> dict[Statement, list[Row]]:
    """Return the sub-claims of every statement of the thesis, in the order of the page."""
    found: dict[Statement, list[Row]] = {statement: [] for statement in STATEMENTS}
    for row in all_rows(sections):
        if row.statement is not None:
            found[row.statement].append(row)
    return found


def statement_counts(found: Mapping[Statement, Iterable[Row]]) -> dict[str, int]:
    """Return the number of statements of each verdict."""
    verdicts = Counter(verdict_of(rows) for rows in found.values())
    return {verdict: verdicts[verdict] for verdict in VERDICTS_OF_STATEMENTS}


def counted(number: int, what: str, verdicts: Mapping[str, int]) -> str:
    """Return the counts as a sentence."""
    parts = [f"{count} {PLURAL.get(verdict, verdict)}" for verdict, count in verdicts.items()]
    return f"{number} {what}: {', '.join(parts)}."


def summary(sections: Sequence[Section]) -> list[str]:
    """Return sentences with the counts of statements, of sub-claims, and of published claims."""
    rows = all_rows(sections)
    of_thesis = [row for row in rows if row.statement is not None]
    others = [row for row in rows if row.statement is None]
    sentences = []
    if of_thesis:
        found = by_statement(sections)
        sentences.append(counted(len(found), "statements", statement_counts(found)))
        counting = _counting(of_thesis)
        sentences.append(counted(len(counting), "sub-claims", counts(counting)))
        if len(counting) < len(of_thesis):
            sentences.append(f"{len(of_thesis) - len(counting)} more with other constants.")
    if others:
        sentences.append(counted(len(others), "predictions", counts(others)))
    return sentences


def show(console: Console, sections: Sequence[Section], details: bool) -> None:
    """Print a table of the statements, the tables of published data, and the counts.

    details: print the sub-claims, remarks and listings of each script too.
    """
    found = {statement: rows for statement, rows in by_statement(sections).items() if rows}
    if found:
        table = Table(title=TITLE, title_justify="left", box=SIMPLE)
        table.add_column("statement", ratio=5, overflow="fold")
        table.add_column("thesis", ratio=3, overflow="fold")
        for heading in (*MODELS, "verdict"):
            table.add_column(heading, min_width=len(UNKNOWN))
        for group, statements in groupby(found, key=lambda statement: statement.group):
            table.add_row(f"[bold]{group}[/]")
            for statement in statements:
                cells = [_short(_of(found[statement], model)) for model in MODELS]
                verdict = _coloured(verdict_of(found[statement]))
                table.add_row(plain(statement.text), plain(statement.value), *cells, verdict)
        console.print(table)
    for section in sections:
        if details or section.script.evidence is PUBLISHED:
            show_section(console, section)
    for sentence in summary(sections):
        console.print(sentence, highlight=False)


def show_section(console: Console, section: Section) -> None:
    """Print the rows, remarks and listings of a script."""
    table = Table(title=f"{section.script.name}, {section.name}", title_justify="left")
    columns = section.script.evidence.columns
    for heading in (*columns, "verdict"):
        table.add_column(heading, overflow="fold")
    for row in section.rows:
        table.add_row(*map(plain, _texts(row, columns)), _coloured(row.verdict))
    console.print(table)
    for text in (section.basis, *section.remarks):
        console.print(text, highlight=False, markup=False)
    for listing in section.listings:
        console.print(TextTable(listing.rows, listing.headings, title=listing.title))


def _short(rows: Sequence[Row]) -> str:
    """Return `agreement` for a narrow column: "2 of 3, 1 ?"."""
    return agreement(rows).replace(" agree", "").replace(" undecided", " ?")


def agreement(rows: Sequence[Row]) -> str:
    """Return how many rows agree, of those that could be decided, and how many could not."""
    found = counts(rows)
    decided = len(rows) - found[UNKNOWN]
    parts = [f"{found[AGREES]} of {decided} agree"] if decided else []
    if found[UNKNOWN]:
        parts.append(f"{found[UNKNOWN]} undecided")
    return ", ".join(parts)


def content(
    sections: Sequence[Section],
    about: dict[str, Any],
    constants: Sequence[dict[str, Any]],
    skipped: Sequence[str] = (),
) -> dict[str, Any]:
    """Return statements, rows and facts of the run, for programs.

    about: total time, device, version and similar facts; skipped: sentences on scripts not run.
    """
    rows, found = all_rows(sections), by_statement(sections)
    return {
        "statements": [
            {**asdict(statement), "verdict": verdict_of(of), "sub_claims": counts(_counting(of))}
            for statement, of in found.items()
        ],
        "statement_counts": statement_counts(found),
        "rows": [
            {**asdict(row), "statement": row.statement.text if row.statement else ""}
            for row in rows
        ],
        "counts": counts(rows),
        **about,
        "constants": list(constants),
        "skipped": list(skipped),
        "scripts": {
            section.script.name: {
                "evidence": section.script.evidence.name,
                "figure": section.name,
                "command": section.script.command,
                "wall_time_s": round(section.wall_time, 1),
                "digitised": section.compared,
                "remarks": list(section.remarks),
                "listings": [asdict(listing) for listing in section.listings],
            }
            for section in sections
        },
    }


def write_json(path: Path, everything: dict[str, Any]) -> None:
    """Write the content to a file."""
    path.write_text(json.dumps(everything, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def write_pages(
    folder: Path, sections: Sequence[Section], everything: dict[str, Any]
) -> list[Path]:
    """Write a page for each evidence that has sections; return their paths."""
    paths = []
    for evidence in (THESIS, PUBLISHED):
        chosen = [section for section in sections if section.script.evidence is evidence]
        if chosen:
            paths.append(folder / evidence.file)
            write_html(paths[-1], evidence, chosen, everything)
    return paths


def write_html(
    path: Path, evidence: Evidence, sections: Sequence[Section], everything: dict[str, Any]
) -> None:
    """Write a page that needs no other file: figures are inside."""
    facts = [
        _fact(key, value)
        for key, value in everything.items()
        if isinstance(value, str | int | float)
    ]
    of_thesis = evidence is THESIS
    page = TEMPLATE.substitute(
        title=escape(evidence.title),
        counts="\n".join(f"<p><b>{escape(text)}</b></p>" for text in summary(sections)),
        subset=QUICK if everything["subset"] == "quick" else "",
        statements=_statements(sections) if of_thesis else "",
        scripts=_scripts(sections),
        skipped=_skipped(everything["skipped"]),
        sections="\n".join(_section(section, folded=of_thesis) for section in sections),
        constants=_constants(everything["constants"]) if of_thesis else "",
        about=escape("; ".join(facts)),
    )
    path.write_text(page, encoding="utf-8")


def _statements(sections: Sequence[Section]) -> str:
    """Return the table of statements; each unfolds to its sub-claims."""
    found = by_statement(sections)
    headings = ("statement", "thesis (tolerance)", *MODELS, "verdict")
    parts = [
        f"<p>{escape(RULE)} Click on a statement to see its sub-claims.</p>",
        f'<div class="statement head">{"".join(f"<div>{text}</div>" for text in headings)}</div>',
    ]
    examined = [statement for statement in found if found[statement]]
    for group, statements in groupby(examined, key=lambda statement: statement.group):
        parts.append(f"<h3>{escape(group)}</h3>")
        parts += [_statement(statement, found[statement]) for statement in statements]
    missing = [statement for statement in found if not found[statement]]
    if missing:
        lines = (_cells((one.text, one.value, one.where)) for one in missing)
        parts.append(f"<h3>{UNEXAMINED.capitalize()} by the scripts of this run</h3>")
        parts.append(_table(("statement", "value", "thesis"), lines))
    return "\n".join(parts)


def _statement(statement: Statement, rows: Sequence[Row]) -> str:
    verdict = verdict_of(rows)
    cells = (
        escape(statement.text),
        f"{escape(statement.value)}{_quiet(statement.where)}"
        f"{_quiet(FITTED if statement.fitted else '')}",
        *(_results(_of(rows, model)) for model in MODELS),
        f"<b>{escape(verdict)}</b>{_quiet(agreement(_counting(rows)))}",
    )
    marks = ("", "", "", "", "", _class(verdict))
    divs = (f'<div class="{mark}">{cell}</div>' for mark, cell in zip(marks, cells, strict=True))
    trials = _of(rows, TRIAL)
    parts = [_claims(sorted(_counting(rows), key=_is_undecided), SUB_CLAIMS)]
    if trials:
        parts.append(f"<p>With other constants: {agreement(trials)}.</p>")
        parts.append(_claims(sorted(trials, key=_is_undecided), SUB_CLAIMS))
    head = f'<summary class="statement">{"".join(divs)}</summary>'
    return f"<details>{head}\n{''.join(parts)}</details>"


def _results(rows: Sequence[Row]) -> str:
    """Return how many rows of a model agree; and what was computed, where it is little."""
    results = [row.computed for row in rows if row.verdict != UNKNOWN]
    if len(results) > LISTED:
        results = []
    return escape(agreement(rows)) + _quiet("; ".join(results))


def _of(rows: Iterable[Row], model: str) -> list[Row]:
    return [row for row in rows if row.model == model]


def _counting(rows: Iterable[Row]) -> list[Row]:
    """Return the rows that a verdict on their statement rests on."""
    return [row for row in rows if row.model != TRIAL]


def _is_undecided(row: Row) -> bool:
    return row.verdict == UNKNOWN


def _scripts(sections: Sequence[Section]) -> str:
    """Return a table with a line per script."""
    lines = [
        (
            section.script.name,
            section.name,
            *(str(number) for number in counts(section.rows).values()),
            f"{section.wall_time:.1f} s",
            section.script.command,
        )
        for section in sections
    ]
    headings = ("script", "source", "agree", "disagree", UNKNOWN, "wall time", "repeat with")
    return _table(headings, map(_cells, lines))


def _skipped(sentences: Sequence[str]) -> str:
    """Return the reasons for which scripts of either page were not run, folded."""
    if not sentences:
        return ""
    lines = "".join(f"<li>{escape(text)}</li>" for text in sentences)
    return (
        f'<details><summary class="script">{len(sentences)} scripts of the validation were not '
        f"run</summary>\n<ul>{lines}</ul></details>"
    )


def _constants(constants: Sequence[dict[str, Any]]) -> str:
    """Return the section on the constants of the scenes."""
    keys = ("name", "value", "where", "rests_on")
    lines = [[entry[key] for key in keys] for entry in constants]
    return "\n".join(
        (
            "<h2>Constants</h2>",
            "<p>Constants of the scenes that no source gives. One set for all figures.</p>",
            _table(("constant", "value", "written in", "rests on"), map(_cells, lines)),
        )
    )


def _section(section: Section, folded: bool) -> str:
    """Return the text, remarks, listings and figure of a script; its rows if not folded."""
    heading = f"{escape(section.script.name)}: {escape(section.name)}"
    parts = [f"<p>{escape(text)}</p>" for text in section.script.about.split("\n\n")]
    if not folded:
        parts.append(_claims(section.rows, section.script.evidence.columns))
    parts += [
        f'<p class="quiet">{escape(section.basis)}</p>',
        *(f"<p>{escape(remark)}</p>" for remark in section.remarks),
        *map(_listing, section.listings),
    ]
    if section.figure.is_file():
        picture = base64.b64encode(section.figure.read_bytes()).decode("ascii")
        name = escape(section.name, quote=True)
        parts.append(f'<img alt="{name}" src="data:image/png;base64,{picture}">')
    body = "\n".join(parts)
    if folded:
        return f'<details><summary class="script">{heading}</summary>\n{body}\n</details>'
    return f"<h2>{heading}</h2>\n{body}"


def _claims(rows: Iterable[Row], columns: Mapping[str, str]) -> str:
    lines = (
        _cells(_texts(row, columns))
        + f'<td class="verdict {_class(row.verdict)}">{escape(row.verdict)}</td>'
        for row in rows
    )
    return _table((*columns, "verdict"), lines)


def _listing(listing: Listing) -> str:
    return (
        f"<h3>{escape(listing.title)}</h3>\n{_table(listing.headings, map(_cells, listing.rows))}"
    )


def _table(headings: Iterable[str], rows: Iterable[str]) -> str:
    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    body = "\n".join(f"<tr>{row}</tr>" for row in rows)
    return f"<table>\n<tr>{head}</tr>\n{body}\n</table>"


def _cells(texts: Iterable[str]) -> str:
    return "".join(f"<td>{escape(text)}</td>" for text in texts)


def _texts(row: Row, columns: Mapping[str, str]) -> list[str]:
    """Return the texts of a row before its verdict."""
    return [getattr(row, field) for field in columns.values()]


def _quiet(text: str) -> str:
    return f'<div class="quiet">{escape(text)}</div>' if text else ""


def _class(verdict: str) -> str:
    return verdict.replace(" ", "-")


def _coloured(verdict: str) -> str:
    colour = COLOURS.get(verdict, "dim")
    return f"[{colour}]{verdict}[/]"


def _fact(key: str, value: Any) -> str:
    """Return "total_time_s", 12.5 as "total time 12.5 s"."""
    name, unit = (key[:-2], " s") if key.endswith("_s") else (key, "")
    return f"{name.replace('_', ' ')} {value}{unit}"
