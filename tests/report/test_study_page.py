"""The page of a study: what it says, and that it answers in a browser."""

import re
import time
from base64 import b64decode
from pathlib import Path

import numpy as np
import polars
import pytest
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from study_folders import FRICTION, PIPE, RATE, RATES, SPEED, grid, sampled, speed, write_made_up
from typer.testing import CliRunner

from softsim.cli import app
from softsim.output.folder import (
    TABLE_TEXT,
    WARNINGS,
    StudyRecord,
    read_table,
    write_table,
)
from softsim.report.figures import Line
from softsim.report.study.findings import Findings
from softsim.report.study.plots import (
    level_words,
    page_context,
    pass_rate_in_words,
    state_of,
    study_charts,
    write_study_page,
)
from softsim.study.schema import Goal, Plot

FASTEST = Goal("speed", "maximize")
OVER_RATE = [Plot("curve", "rate", "speed")]


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    """Of a grid of two pipes and eight rates, of which case 11 failed."""
    rows = grid(pipe=["30 mm", "36 mm"], rate=RATES)
    rows[10]["status"] = "failed"
    folder = tmp_path_factory.mktemp("study")
    write_made_up(
        folder, [PIPE, RATE], rows, measures=[SPEED], goal=FASTEST,
        title="<script>alert(1)</script> & more",
        plots=[Plot("scatter", "rate", "speed"), Plot("heat_map", "rate", "pipe", colour="speed")],
    )  # fmt: skip
    return write_study_page(folder)


def test_the_pass_rate_of_drawn_cases_has_its_interval():
    """8 of 10: Wilson's interval is 49 to 94 %. A grid is no sample, and has no rate."""
    table = polars.DataFrame(
        {
            "friction": np.linspace(0.6, 0.8, 11),
            "verdict": ["passed"] * 8 + ["stuck", "stuck", None],
            "status": ["done"] * 10 + ["failed"],
        }
    )
    record = StudyRecord("pass rate", "layout.yaml", (FRICTION,), (), sampled=True)
    assert pass_rate_in_words(Findings(record, table)) == (
        "passed: 8 of 10 cases, 80 % (95 % interval, Wilson: 49 to 94 %), 2 stuck; "
        "1 more without a verdict (not counted)"
    )
    assert pass_rate_in_words(Findings(record, table[10:])) == "no case has a verdict"
    of_grid = StudyRecord("pass rate", "layout.yaml", (FRICTION,), ())
    assert pass_rate_in_words(Findings(of_grid, table)) == ""


@pytest.mark.parametrize(
    ("statuses", "kind", "words"),
    [
        (["done", "done"], "good", "done: 2 of 2 cases done"),
        (["done", "failed"], "open", "done: 1 of 2 cases done, 1 failed"),
        (["failed", "lost"], "bad", "done: 0 of 2 cases done, 1 failed, 1 lost"),
        (["done", "pruned", "waiting"], "open", "done: 1 of 3 cases done, 1 pruned, 1 waiting"),
    ],
)
def test_the_state_counts_cases(tmp_path, statuses, kind, words):
    rows = [{"rate": float(k), "status": status} for k, status in enumerate(statuses, start=1)]
    assert state_of(Findings.read(write_made_up(tmp_path, [RATE], rows))) == (kind, words)


def test_a_study_with_warnings_is_not_good(tmp_path):
    folder = write_made_up(tmp_path, [RATE], [{"rate": 1.0}, {"rate": 2.0}])
    table = read_table(folder).with_columns(polars.Series(WARNINGS, [None, 3]))
    write_table(folder, table)
    kind, words = state_of(Findings.read(folder))
    assert kind == "open" and "2 of 2 cases done, 1 with warnings" in words


def test_what_the_page_tells(tmp_path):
    rows = sampled(60)
    write_made_up(tmp_path, [RATE, FRICTION, PIPE], rows, goal=FASTEST)
    context = page_context(Findings.read(tmp_path), tmp_path)
    failed = [number for number, row in enumerate(rows, start=1) if row["status"] == "failed"]
    ((reason, count, named),) = context["reasons"].cells
    assert (reason.text, count.value) == ("an element is inverted", len(failed))
    assert named.text.startswith(f"{failed[0]}, {failed[1]}, ")
    best = max(
        (number for number, row in enumerate(rows, start=1) if row["status"] == "done"),
        key=lambda number: speed(**{k: rows[number - 1][k] for k in ("rate", "friction", "pipe")}),
    )
    assert context["best"].startswith(f"best case {best}: speed ")
    columns = dict(zip(context["cases"]["headings"], context["cases"]["columns"], strict=True))
    assert columns["friction"] == [row["friction"] for row in rows]
    encoded = context["download"].removeprefix("data:text/csv;base64,")
    assert b64decode(encoded) == (tmp_path / TABLE_TEXT).read_bytes()
    assert Line("scene", "pfr_36mm.yaml") in context["settings"]
    assert [chart.title.split(" over ")[0] for chart in context["charts"]] == [
        *["mean speed [mm/s]"] * 4,
        "all factors, one line per case, coloured by speed; drag along an axis to select",
    ]  # fmt: skip


def test_many_levels_are_said_from_where_to_where(tmp_path):
    rows = [{"rate": rate} for rate in np.linspace(1.0, 3.0, 40).tolist()]
    found = Findings.read(write_made_up(tmp_path / "many", [RATE], rows))
    assert level_words(found, "rate") == "40 values, 1 kPa/s to 3 kPa/s"
    found = Findings.read(write_made_up(tmp_path / "few", [RATE], rows[::39]))
    assert level_words(found, "rate") == "1 kPa/s, 3 kPa/s"


def test_charts_show_every_case_and_lead_to_it(tmp_path):
    rows = sampled(40)
    found = Findings.read(write_made_up(tmp_path, [RATE, FRICTION], rows, plots=OVER_RATE))
    for trace, status in zip(
        study_charts(found)[0].figure["data"], ("done", "failed", "pruned"), strict=True
    ):
        expected = [case for case, row in enumerate(rows, start=1) if row["status"] == status]
        assert trace["customdata"] == expected


def test_the_page_is_small(page):
    assert page.stat().st_size < 1e6


def test_names_of_a_study_are_no_markup(page):
    text = page.read_text(encoding="utf-8")
    assert "<h1>&lt;script&gt;alert(1)&lt;/script&gt; &amp; more</h1>" in text
    assert "<script>alert(1)" not in text


def test_report_draws_a_study(tmp_path):
    write_made_up(tmp_path, [RATE], [{"rate": 1.0}, {"rate": 2.0}], plots=OVER_RATE)
    result = CliRunner().invoke(app, ["report", str(tmp_path)])
    assert result.exit_code == 0
    said = re.sub(r"\s", "", result.output)
    for name in ("curve_speed_over_rate.png", "report.html"):
        assert (tmp_path / name).is_file()
        assert name in said


def cases_shown(browser) -> list[int]:
    rows = browser.driver.find_elements(By.CSS_SELECTOR, ".cases tbody tr")
    return [int(row.get_attribute("data-case")) for row in rows]


def drawn(browser, number: int):
    """The plot of a chart, scrolled to and drawn."""
    plot = browser.driver.find_elements(By.CSS_SELECTOR, ".plot")[number]
    browser.run("arguments[0].scrollIntoView({block: 'center'})", plot)
    deadline = time.monotonic() + 30.0
    while not browser.run("return Boolean(arguments[0]._fullLayout)", plot):
        assert time.monotonic() < deadline, "the chart is not drawn"
        time.sleep(0.05)
    return plot


def click_at(browser, plot, x: float, y: float) -> None:
    """Click on a place of a chart, in its own units."""
    across, up = browser.run(
        """const { xaxis, yaxis } = arguments[0]._fullLayout;
        const box = arguments[0].getBoundingClientRect();
        return [xaxis._offset + xaxis.d2p(arguments[1]) - box.width / 2,
                yaxis._offset + yaxis.d2p(arguments[2]) - box.height / 2]""",
        plot, x, y,
    )  # fmt: skip
    ActionChains(browser.driver).move_to_element_with_offset(
        plot, round(across), round(up)
    ).perform()
    time.sleep(0.2)  # plotly.js looks for what is under the cursor only so often
    ActionChains(browser.driver).click().perform()


def chosen(browser) -> list[str]:
    rows = browser.driver.find_elements(By.CSS_SELECTOR, ".cases tr.chosen")
    return [row.get_attribute("data-case") for row in rows]


@pytest.mark.physics
def test_the_page_opens_in_silence(browser, page):
    browser.open(page)
    drawn(browser, 0)
    assert browser.complaints() == []
    assert browser.requests() == []
    assert cases_shown(browser) == list(range(1, 17))


@pytest.mark.physics
def test_a_click_on_a_heading_sorts(browser, page):
    browser.open(page)
    heading = browser.driver.find_element(By.XPATH, "//th/button[text()='speed [mm/s]']")
    expected = sorted(
        (number for number in range(1, 17) if number != 11),
        key=lambda n: speed(RATES[(n - 1) % 8], pipe="30 mm" if n <= 8 else "36 mm"),
    )
    heading.click()
    assert cases_shown(browser) == [*expected, 11]
    heading.click()
    assert cases_shown(browser) == [*expected[::-1], 11]


@pytest.mark.physics
def test_the_table_finds_words(browser, page):
    browser.open(page)
    field = browser.driver.find_element(By.CSS_SELECTOR, ".cases input")
    field.send_keys("36 INVERTED")
    assert cases_shown(browser) == [11]
    field.clear()
    field.send_keys("36 mm")
    assert cases_shown(browser) == list(range(9, 17))


@pytest.mark.parametrize("chart", [0, 1], ids=["scatter", "heat map"])
@pytest.mark.physics
def test_a_click_on_a_point_leads_to_its_case(browser, page, chart):
    browser.open(page)
    browser.driver.find_element(By.CSS_SELECTOR, ".cases input").send_keys("30 mm")
    plot = drawn(browser, chart)
    at = speed(RATES[6], pipe="36 mm") if chart == 0 else 1
    click_at(browser, plot, RATES[6], at)
    assert chosen(browser) == ["15"]
    assert len(cases_shown(browser)) == 16


@pytest.mark.physics
def test_large_tables_are_turned_page_by_page(browser, tmp_path):
    rows = [{"rate": float(rate)} for rate in range(1, 251)]
    browser.open(write_study_page(write_made_up(tmp_path, [RATE], rows)))
    assert cases_shown(browser) == list(range(1, 101))
    following = browser.driver.find_element(By.CSS_SELECTOR, ".cases .next")
    following.click()
    following.click()
    assert cases_shown(browser) == list(range(201, 251))
    assert not following.is_enabled()


@pytest.mark.physics
def test_a_narrow_window_scrolls_tables_not_the_page(browser, page):
    browser.open(page, width=420)
    drawn(browser, 1)
    assert browser.run("return document.documentElement.scrollWidth <= innerWidth")
