"""The page of a run as its reader sees it: it opens without a network, plays, sorts and links."""

import shutil
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from browsers import Browser
from layout_runs import write_layout_run
from matplotlib.image import imread
from selenium.webdriver import ActionChains, Keys
from selenium.webdriver.remote.webelement import WebElement

from softsim.output.folder import SCENE, RunFolder
from softsim.report.page.run import write_run_page
from softsim.robots.block import block

TITLE = """<script>alert(1)</script> & "x" '"""


@pytest.fixture(scope="module")
def pages(strip_run: Path, box_run: Path, tmp_path_factory: pytest.TempPathFactory) -> dict:
    """Pages of a plane run with a nasty title, of one in space, and of one in a layout."""
    folder = tmp_path_factory.mktemp("pages")
    plane = shutil.copytree(strip_run, folder / "plane")
    summary = {"title": TITLE, "status": "aborted", "failure": TITLE, "failed_element": 12}
    RunFolder(plane).write_json_atomic("summary.json", summary)
    (plane / SCENE).write_text("time:\n  end: 4 s  # scene.yaml:7\n", "utf-8")
    space = shutil.copytree(box_run, folder / "space")
    failed = shutil.copytree(box_run, folder / "failed")
    summary = {"status": "aborted", "failure": "crushed", "failed_element": 3}
    RunFolder(failed).write_json_atomic("summary.json", summary)
    (folder / "layout").mkdir()
    write_layout_run(folder / "layout", block(30e-3, 8e-3, 8e-3), 0.151, wedged=True)
    return {run.name: write_run_page(run) for run in (plane, space, failed, folder / "layout")}


def robot(browser: Browser) -> WebElement:
    return browser.driver.find_element("css selector", "#player .plot")


def picture(browser: Browser) -> np.ndarray:
    """What the robot's chart shows once it is painted (rows, columns, 3), 0 to 1."""
    painted = "const done = arguments[0]; paint({}).then(() => setTimeout(done, 300))"
    browser.driver.execute_async_script(painted)
    return imread(BytesIO(robot(browser).screenshot_as_png))[..., :3]


def middle(browser: Browser) -> float:
    """Of the horizontal axis [mm]."""
    low, high = browser.run("return robot._fullLayout.xaxis.range")
    return 0.5 * (low + high)


def eye(browser: Browser) -> np.ndarray:
    """Where the camera in space stands."""
    where = browser.run("return robot._fullLayout.scene._scene.getCamera().eye")
    return np.array([where[name] for name in "xyz"])


def slide(browser: Browser, frame: int) -> None:
    """What a hand on the slider does."""
    browser.run(
        "const slider = document.getElementById('frame'); slider.value = arguments[0];"
        "slider.dispatchEvent(new Event('input'))", frame,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "width"),
    [("plane", 400), ("layout", 400), ("space", 1600)],
)
@pytest.mark.physics
def test_a_page_opens_whole_and_alone(browser: Browser, pages: dict, name: str, width: int):
    browser.open(pages[name], width)
    assert browser.complaints() == [] and browser.requests() == []
    assert browser.run("return document.documentElement.scrollWidth <= innerWidth")
    charts = "document.querySelectorAll('figure.chart')"
    assert browser.run(f"return {charts}.length") >= 3
    assert browser.run(f"return [...{charts}].every((c) => c.querySelector('path.js-line'))")


def test_text_of_a_user_is_shown_as_it_is(browser: Browser, pages: dict):
    browser.open(pages["plane"])
    assert browser.run("return document.querySelector('h1').textContent") == TITLE
    assert f"aborted: {TITLE}" in browser.run("return document.querySelector('.state').innerText")
    settings = browser.run("return document.querySelector('pre').textContent")
    assert settings == "time:\n  end: 4 s  # scene.yaml:7\n"


@pytest.mark.parametrize("name", ["plane", "failed"])
@pytest.mark.physics
def test_a_run_that_failed_opens_where_it_did(browser: Browser, pages: dict, name: str):
    browser.open(pages[name])
    assert browser.run("return current === end && end > 0")
    away = "return robot.data.at(-1).x[0] - others.at(-1)[1][current].x[0]"
    assert browser.run(away) == 0.0
    picture(browser)
    assert browser.complaints() == []
    slide(browser, 0)
    assert browser.run(away) == 0.0


@pytest.mark.parametrize("name", ["plane", "space"])
def test_the_slider_moves_the_body_and_the_marks_in_the_charts(
    browser: Browser, pages: dict, name: str
):
    browser.open(pages[name])
    slide(browser, 0)
    mark = "return document.querySelector('.moment').getBoundingClientRect().left"
    before, place = picture(browser), browser.run(mark)
    assert before.std() > 0.02, "nothing is painted"
    slide(browser, 9)
    assert (picture(browser) != before).mean() > 1e-3
    assert browser.run(mark) > place + 20.0
    said = browser.run("return document.getElementById('reading').textContent")
    assert said.startswith("0.9 s, ")


@pytest.mark.physics
def test_keys_step_and_the_button_plays(browser: Browser, pages: dict):
    browser.open(pages["plane"])
    slide(browser, 0)
    robot(browser).send_keys(Keys.ARROW_RIGHT * 2, Keys.ARROW_LEFT)
    assert browser.run("return current") == 1
    # Stopped in the page, at once: on a busy machine a call from here may come after the end.
    stopped_while_it_plays = """
        const done = arguments[0];
        play.click();
        const look = setInterval(() => {
          if (current > 1) { clearInterval(look); play.click(); done(current); }
        }, 5);
    """
    browser.run("speed.value = '20'")
    stopped_at = browser.driver.execute_async_script(stopped_while_it_plays)
    assert stopped_at < browser.run("return end")
    assert browser.run("return [play.getAttribute('aria-label'), playing]") == ["Play", False]


@pytest.mark.physics
def test_a_body_in_space_is_turned(browser: Browser, pages: dict):
    browser.open(pages["space"])
    before, stood = picture(browser), eye(browser)
    ActionChains(browser.driver).drag_and_drop_by_offset(robot(browser), 150, 0).perform()
    assert (picture(browser) != before).mean() > 0.02
    turned = eye(browser)
    assert np.linalg.norm(turned - stood) > 0.3
    robot(browser).send_keys(Keys.SHIFT, Keys.ARROW_RIGHT * 10)
    assert np.linalg.norm(eye(browser) - turned) > 0.3
    seen = eye(browser)
    check_what_is_in_front(browser, seen)
    slide(browser, 9)
    assert (picture(browser) != before).mean() > 0.02
    np.testing.assert_allclose(eye(browser), seen, atol=1e-3)


def check_what_is_in_front(browser: Browser, eye_of_scene: np.ndarray) -> None:
    """Lines that the body must not hide are moved towards the eye, and stay within the axes."""
    low, high = np.array(
        browser.run(
            "const s = robot.layout.scene; return [s.xaxis, s.yaxis, s.zaxis].map(a => a.range)"
        )
    ).T
    sizes = np.array(
        browser.run("const { x, y, z } = robot.layout.scene.aspectratio; return [x, y, z]")
    )
    towards = 0.5 * (low + high) + eye_of_scene * (high - low) / sizes
    place = low + [0.5, 0.4, 0.6] * (high - low)
    given = {name: [c, None] for name, c in zip("xyz", place, strict=True)}
    moved = browser.run("const m = inFront(arguments[0]); return [m.x, m.y, m.z]", given)
    assert [there for _, there in moved] == [None] * 3
    found = np.array([there for there, _ in moved])
    assert (found > low).all() and (found < high).all()
    way, whole = found - place, towards - place
    share = np.linalg.norm(way) / np.linalg.norm(whole)
    np.testing.assert_allclose(way, share * whole, atol=1e-3 * np.linalg.norm(way))
    nearest_end = np.minimum(found - low, high - found) / (high - low)
    assert nearest_end.min() < 0.02


@pytest.mark.physics
def test_the_camera_stands_still_or_follows(browser: Browser, pages: dict):
    browser.open(pages["plane"])
    choose = "camera.value = arguments[0]; camera.dispatchEvent(new Event('change'))"
    slide(browser, 40)
    following = picture(browser)
    browser.run(choose, "stands")
    assert (picture(browser) != following).any()
    where = middle(browser)
    slide(browser, 0)
    assert middle(browser) == where
    browser.run(choose, "follows")
    at_start = middle(browser)
    slide(browser, 40)
    assert middle(browser) == pytest.approx(at_start + 8.0, abs=0.2)  # the robot goes to the right


@pytest.mark.physics
def test_a_click_in_a_chart_leads_there(browser: Browser, pages: dict):
    browser.open(pages["plane"])
    browser.run("document.dispatchEvent(new CustomEvent('seek', { detail: 2.96 }))")
    assert browser.run("return times[current]") == pytest.approx(3.0)
    plot = "document.querySelector('figure[data-over-time] .plot')"
    browser.run(f"{plot}.emit('plotly_click', {{ points: [{{ x: 1.02 }}] }})")
    assert browser.run("return times[current]") == pytest.approx(1.0)


def column(browser: Browser, number: int) -> list[str]:
    cells = f"document.querySelectorAll('tbody td:nth-child({number})')"
    return browser.run(f"return [...{cells}].map((cell) => cell.textContent)")


@pytest.mark.physics
def test_a_click_on_a_heading_sorts(browser: Browser, pages: dict):
    browser.open(pages["layout"])
    first = column(browser, 1)
    heading = browser.driver.find_elements("css selector", "th button")[2]
    heading.click()
    assert column(browser, 3) == sorted(column(browser, 3), key=float)
    heading.click()
    assert column(browser, 3) == sorted(column(browser, 3), key=float, reverse=True)
    assert column(browser, 1) == first[::-1]
    state = "return document.querySelectorAll('th')[2].getAttribute('aria-sort')"
    assert browser.run(state) == "descending"


@pytest.mark.parametrize("clicks", [1, 2])
@pytest.mark.physics
def test_empty_cells_stay_last(browser: Browser, pages: dict, clicks: int):
    browser.open(pages["layout"])
    heading = browser.driver.find_elements("css selector", "th button")[3]  # when it came there
    for _ in range(clicks):
        heading.click()
    entered = column(browser, 4)
    assert "" in entered and entered[0] != ""
    filled = [float(time) for time in entered if time]
    assert entered[len(filled) :] == [""] * (len(entered) - len(filled))
    assert filled == sorted(filled, reverse=clicks == 2)
