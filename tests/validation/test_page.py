"""The page: every statement and row is there, text is text, figures are inside."""

import io
import json
from html import escape

import pytest
from rich.console import Console

from validation import page
from validation.page import Section
from validation.script import THESIS, Listing, Script
from validation.statements import CLIMBS, STATEMENTS
from validation.verdicts import (
    AGREES,
    DISAGREES,
    IN_PART,
    IN_SECTION,
    TRIAL,
    UNEXAMINED,
    UNKNOWN,
    VERDICTS,
    Row,
)

NASTY = "<b>p & q</b> [red]x[/]"


@pytest.fixture
def sections(tmp_path):
    """One script with a row of each verdict and a figure."""
    script = Script(
        name="s",
        figure="Fig 1",
        about=NASTY,
        rows=lambda o, p: [],
        draw=lambda o, p, f: None,
    )
    figure = tmp_path / "s.png"
    figure.write_bytes(b"picture")
    rows = tuple(
        Row(CLIMBS, f"claim {v}", NASTY, NASTY, v, model=IN_SECTION, script="s") for v in VERDICTS
    )
    trial = Row(CLIMBS, "trial", NASTY, NASTY, AGREES, model=TRIAL, script="s")
    listing = Listing(NASTY, ("what", NASTY), (("first", NASTY), ("second", "")))
    return [Section(script, (*rows, trial), (NASTY,), False, figure, (listing,))]


def everything(sections):
    about = {"subset": "quick", "total_time_s": 1.5, "device": "cpu", "version": "0"}
    constant = {"name": NASTY, "value": "1", "where": "a.yaml:3", "rests_on": "onset"}
    return page.content(sections, about, [constant], ["t: left out"])


def test_json_has_every_row_and_count(sections, tmp_path):
    path = tmp_path / "out.json"
    page.write_json(path, everything(sections))
    read = json.loads(path.read_text())
    assert [row["verdict"] for row in read["rows"]] == [*VERDICTS, AGREES]
    assert set(read["rows"][0]) == {
        "script",
        "statement",
        "model",
        "claim",
        "reference",
        "computed",
        "verdict",
        "error",
        "band",
    }
    assert all(isinstance(value, str) for row in read["rows"] for value in row.values())
    assert read["counts"] == {AGREES: 2, DISAGREES: 1, UNKNOWN: 1}
    assert {row["statement"] for row in read["rows"]} == {CLIMBS.text}
    climbs = next(one for one in read["statements"] if one["text"] == CLIMBS.text)
    assert climbs["verdict"] == IN_PART
    assert climbs["sub_claims"] == {AGREES: 1, DISAGREES: 1, UNKNOWN: 1}  # without the trial
    assert read["statement_counts"][IN_PART] == 1
    assert read["statement_counts"][UNEXAMINED] == len(STATEMENTS) - 1
    assert read["scripts"]["s"]["digitised"] is False
    assert read["scripts"]["s"]["listings"][0]["rows"] == [["first", NASTY], ["second", ""]]
    assert read["constants"][0]["rests_on"] == "onset" and read["total_time_s"] == 1.5


def test_html_holds_text_as_text_and_the_figure(sections, tmp_path):
    path = tmp_path / "index.html"
    page.write_html(path, THESIS, sections, everything(sections))
    text = path.read_text()
    assert NASTY not in text and "&lt;b&gt;p &amp; q" in text
    assert all(f">{verdict}</td>" in text for verdict in VERDICTS)
    assert "<h3>&lt;b&gt;p" in text and "<td>second</td><td></td>" in text
    assert 'src="data:image/png;base64,cGljdHVyZQ=="' in text
    assert "statements only" in text and "total time 1.5 s" in text
    assert page.QUICK in text and "<li>t: left out</li>" in text
    assert "1 agree in part" in text and "3 sub-claims: 1 agree, 1 disagree" in text
    assert all(escape(statement.text) in text for statement in STATEMENTS)
    assert "1 of 2 agree, 1 undecided" in text and "With other constants: 1 of 1 agree." in text


@pytest.mark.parametrize("details", [True, False])
def test_console_shows_text_as_text(sections, details):
    console = Console(file=io.StringIO(), width=200)
    page.show(console, sections, details)
    shown = console.file.getvalue()
    assert CLIMBS.text in shown and IN_PART in shown and STATEMENTS[0].text not in shown
    # Two columns of each row, the remark, and the listing's title, heading and cell.
    assert shown.count("[red]x[/]") == (2 * 4 + 1 + 3 if details else 0)
    assert "3 sub-claims: 1 agree, 1 disagree, 1 undecided." in shown
    assert "1 more with other constants." in shown
