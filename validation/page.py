"""Pages of verdicts: on the console, as validation.json, and one HTML page per evidence."""

import base64
import json
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from rich.console import Console
from rich.markup import escape as plain
from rich.table import Table

from validation.script import PUBLISHED, THESIS, Evidence, Listing, Script
from validation.verdicts import AGREES, DISAGREES, UNKNOWN, VERDICTS, Row

TEMPLATE = Template(Path(__file__).with_name("page.html").read_text(encoding="utf-8"))
PLURAL = {AGREES: "agree", DISAGREES: "disagree", UNKNOWN: UNKNOWN}
CLASSES = {AGREES: "agrees", DISAGREES: "disagrees", UNKNOWN: "unknown"}
COLOURS = {AGREES: "green", DISAGREES: "red", UNKNOWN: "dim"}


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
    """Every row of the page."""
    return [row for section in sections for row in section.rows]


def counts(rows: Sequence[Row]) -> dict[str, int]:
    """Verdict -> number of rows."""
    found = Counter(row.verdict for row in rows)
    return {verdict: found[verdict] for verdict in VERDICTS}


def show(console: Console, sections: Sequence[Section]) -> None:
    """A table for each script, and the counts."""
    for section in sections:
        table = Table(title=f"{section.script.name}, {section.name}", title_justify="left")
        for heading in (*section.script.evidence.columns, "verdict"):
            table.add_column(heading, overflow="fold")
        for row in section.rows:
            colour = COLOURS[row.verdict]
            texts = map(plain, _texts(row, section.script.evidence))
            table.add_row(*texts, f"[{colour}]{row.verdict}[/]")
        console.print(table)
        for text in (section.basis, *section.remarks):
            console.print(text, highlight=False, markup=False)
        for listing in section.listings:
            console.print(listed(listing))
    console.print(counted(all_rows(sections)), highlight=False)


def listed(listing: Listing) -> Table:
    """A listing for the console."""
    table = Table(title=plain(listing.title), title_justify="left")
    for heading in listing.headings:
        table.add_column(plain(heading), overflow="fold")
    for row in listing.rows:
        table.add_row(*map(plain, row))
    return table


def counted(rows: Sequence[Row]) -> str:
    """The counts as a sentence."""
    parts = [f"{number} {PLURAL[verdict]}" for verdict, number in counts(rows).items()]
    return f"{len(rows)} claims: {', '.join(parts)}."


def content(
    sections: Sequence[Section],
    about: dict[str, Any],
    constants: Sequence[dict[str, Any]],
    skipped: Sequence[str] = (),
) -> dict[str, Any]:
    """Return everything, for programs.

    about: total time, device, version and similar facts; skipped: sentences on scripts not run.
    """
    rows = all_rows(sections)
    return {
        "rows": [asdict(row) for row in rows],
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
    """The content as a file."""
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
    page = TEMPLATE.substitute(
        title=escape(evidence.title),
        counts=escape(counted(all_rows(sections))),
        about=escape("; ".join(facts)),
        summary=_summary(sections),
        sections="\n".join(_section(section) for section in sections),
        constants=_constants(everything["constants"]) if evidence is THESIS else "",
    )
    path.write_text(page, encoding="utf-8")


def _summary(sections: Sequence[Section]) -> str:
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
    headings = ("script", "source", *PLURAL.values(), "wall time", "repeat with")
    return _table(headings, map(_cells, lines))


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


def _texts(row: Row, evidence: Evidence) -> list[str]:
    """Return the texts of a row before its verdict."""
    return [getattr(row, field) for field in evidence.columns.values()]


def _fact(key: str, value: Any) -> str:
    """ "total_time_s", 12.5 as "total time 12.5 s"."""
    name, unit = (key[:-2], " s") if key.endswith("_s") else (key, "")
    return f"{name.replace('_', ' ')} {value}{unit}"


def _section(section: Section) -> str:
    evidence = section.script.evidence
    rows = (
        _cells(_texts(row, evidence))
        + f'<td class="verdict {CLASSES[row.verdict]}">{escape(row.verdict)}</td>'
        for row in section.rows
    )
    parts = [
        f"<h2>{escape(section.script.name)}: {escape(section.name)}</h2>",
        *(f"<p>{escape(paragraph)}</p>" for paragraph in section.script.about.split("\n\n")),
        _table((*evidence.columns, "verdict"), rows),
        f'<p class="quiet">{escape(section.basis)}</p>',
        *(f"<p>{escape(remark)}</p>" for remark in section.remarks),
        *map(_listing, section.listings),
    ]
    if section.figure.is_file():
        picture = base64.b64encode(section.figure.read_bytes()).decode("ascii")
        name = escape(section.name, quote=True)
        parts.append(f'<img alt="{name}" src="data:image/png;base64,{picture}">')
    return "\n".join(parts)


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
