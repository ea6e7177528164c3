"""Pictures of the live view: what viser is given for plane, axisymmetric and solid bodies."""

import re
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browsers import PATIENCE, Browser
from matplotlib.colors import to_hex
from selenium.webdriver import Keys
from selenium.webdriver.common.by import By
from selenium.webdriver.support.wait import WebDriverWait

from softsim.live import SIZE, LivePicture, legend, opened_server, view
from softsim.output.fields import Frames, SeriesInMemory, read_frames
from softsim.output.folder import RESULTS
from softsim.report.body import places_at
from softsim.report.diagram import MILLI, shades
from softsim.report.page.robot import SHADES

PRESSED = {
    "bodies": {
        "b": {
            "mesh": {"generator": "block", "length": "4 mm", "height": "2 mm",
                     "element_size": "1 mm"},
            "formulation": "plane_strain", "thickness": "5 mm", "material": "dragon_skin_10",
            "fixed": ["bottom"],
        }
    },
    "loads": {
        "air": {"kind": "follower_pressure", "facets": ["b.top"],
                "profile": {"kind": "constant", "value": "2 kPa", "ramp": "5 ms"}}
    },
    "time": {"end": "20 ms"},
    "output": {"history_interval": "1 ms"},
}  # fmt: skip


@pytest.fixture
def server():
    """A running server of viser."""
    opened = opened_server(8080)
    yield opened
    opened.stop()


def only(frames: Frames, index: int) -> Frames:
    """One frame of a run, as the live view has it."""
    parts = [
        {name: SeriesInMemory([series[index]]) for name, series in part.items()}
        for part in (frames.point_data, frames.cell_data, frames.extra)
    ]
    return Frames(
        frames.points, frames.cells, frames.times[[index]], *parts, frames.described,
        frames.titles, frames.sets,
    )  # fmt: skip


def drawn(server, folder: Path, index: int) -> tuple[LivePicture, Frames]:
    """The picture of a frame of a run, drawn after that of the first one."""
    frames = read_frames(folder / RESULTS)
    stage = LivePicture(server, only(frames, 0))
    stage.draw(only(frames, 0), "stretch", False)
    last = only(frames, index)
    stage.draw(last, "stretch", False)
    return stage, last


def corners(stage: LivePicture, kind: str) -> dict[str, np.ndarray]:
    """The triangles (k, 3, 3) [mm] of the visible meshes of a kind."""
    found = {
        name: mesh.vertices[mesh.faces] * stage.size / SIZE
        for name, mesh in stage._meshes.items()
        if name.startswith(kind) and mesh.visible
    }
    assert found
    return found


def test_cells_of_a_section_have_their_place_and_the_colour_of_their_value(server, strip_run):
    stage, frames = drawn(server, strip_run, 10)  # inflated
    places, stretch = places_at(frames, 0), frames.cell_data["stretch"][0]
    low, high = stage._range
    assert low == pytest.approx(1.0) and high == pytest.approx(stretch.max(), rel=1e-3)
    seen = 0
    for name, found in corners(stage, "body").items():
        k = int(name.split("/")[1])
        expected = places[frames.cells[(stretch >= low + (high - low) * k / SHADES)
                                       & (stretch < low + (high - low) * (k + 1) / SHADES)
                                       | ((k == SHADES - 1) & (stretch >= high))]]  # fmt: skip
        assert len(found) == 2 * len(expected)  # quadrilaterals
        seen += len(found)
        np.testing.assert_allclose(
            np.sort(found[: len(expected), 0, :2], axis=0), np.sort(expected[:, 0], axis=0),
            atol=1e-4,
        )  # fmt: skip
        assert np.abs(found[..., 2]).max() == 0.0
        assert to_hex(np.array(stage._meshes[name].color) / 255.0) == shades(SHADES)[k]
    assert seen == 2 * len(frames.cells)
    [walls] = corners(stage, "walls").values()  # beyond 15 mm, behind the body
    assert np.abs(walls[..., 1]).min() == pytest.approx(15.0, abs=1e-4)
    assert walls[..., 2].max() < 0.0
    [outline] = [stage._lines["outlines"].points * stage.size / SIZE]
    assert np.ptp(outline[..., 0]) == pytest.approx(33.0, abs=1e-4)


def test_the_scale_covers_all_pictures_and_starts_anew_with_another_field(server, strip_run):
    stage, _ = drawn(server, strip_run, 10)
    highest = stage._range[1]
    start = only(read_frames(strip_run / RESULTS), 0)
    assert stage.draw(start, "stretch", False)[1] == highest > 1.0
    assert stage.draw(start, "displacement", False) == (0.0, 0.0)
    shown = legend("displacement", 0.0, 1.5)
    assert "displacement [mm]" in shown and ">1.5<" in shown


def test_a_half_section_has_its_mirror_image(server, ring_run):
    stage, frames = drawn(server, ring_run, -1)
    body = np.concatenate(list(corners(stage, "body").values()))
    image = np.concatenate(list(corners(stage, "mirror").values()))
    assert len(body) == len(image) >= len(frames.cells)
    assert body[..., 0].min() > 0.0
    assert image[..., 0].min() == pytest.approx(-body[..., 0].max())
    [walls] = corners(stage, "walls").values()
    assert np.abs(walls[..., 0]).min() == pytest.approx(12.0, abs=1e-4)


def test_a_body_in_space_is_drawn_by_its_surface_between_its_walls(server, box_run):
    stage, frames = drawn(server, box_run, -1)
    places = places_at(frames, 0)
    body = np.concatenate(list(corners(stage, "body").values()))
    np.testing.assert_allclose(body.min(axis=(0, 1)), places.min(axis=0), atol=1e-4)
    np.testing.assert_allclose(body.max(axis=(0, 1)), places.max(axis=0), atol=1e-4)
    outward = np.cross(body[:, 1] - body[:, 0], body[:, 2] - body[:, 0])
    volume = (body[:, 0] * outward).sum() / 6.0
    assert volume == pytest.approx(12.0 * 4.0 * 4.0, rel=1e-3)  # sheared: as at rest
    [walls] = corners(stage, "walls").values()
    assert walls[..., 1].min() == pytest.approx(-9.0, abs=0.1)  # pipe
    assert (np.abs(walls[..., 1] + 1.0).max(axis=1) < 1e-4).sum() == 2  # floor


def test_a_rigid_body_beside_the_body_in_space_is_in_the_picture(server, box_run):
    frames = only(read_frames(box_run / RESULTS), 0)
    alone = LivePicture(server, frames)
    alone.draw(frames, "stretch", False)
    near = np.linalg.norm(server.initial_camera.position)
    far = 40.0 * np.array([0.0, 0.0, 1.0])  # mm
    described = frames.described | {
        "rigid_faces": np.array([[0, 1, 2]]), "rigid_vertex_bodies": np.zeros(3),
        "rigid_vertices": 1e-3 * np.eye(3),
    }  # fmt: skip
    pose = SeriesInMemory([np.array([[*(far / MILLI), 1.0, 0.0, 0.0, 0.0]])])
    beside = replace(frames, described=described, extra={**frames.extra, "frame_pose": pose})
    stage = LivePicture(server, beside)
    stage.draw(beside, "stretch", False)
    [drawn_there] = corners(stage, "rigid").values()
    np.testing.assert_allclose(np.sort(drawn_there[0], axis=0), far + np.sort(np.eye(3), axis=0))
    assert stage.centre[2] - alone.centre[2] == pytest.approx(0.5 * (41.0 - 4.0))
    assert np.linalg.norm(server.initial_camera.position) > 2.0 * near
    assert max(found[..., 2].max() for found in corners(stage, "walls").values()) > 41.0


def test_the_picture_can_follow_the_body(server, strip_run):
    stage, frames = drawn(server, strip_run, -1)  # has travelled by 8 mm
    still = np.array(stage.root.position)
    stage.draw(frames, "stretch", True)
    moved = (np.array(stage.root.position) - still) * stage.size / SIZE
    shift = places_at(frames, 0).mean(axis=0) - frames.points.mean(axis=0) * MILLI
    assert moved[0] == pytest.approx(-shift[0], abs=1e-3) and shift[0] == pytest.approx(8.0)


@pytest.mark.physics
def test_in_a_browser_it_shows_pauses_steps_and_obeys(browser: Browser, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim import Simulation

    simulation = Simulation(PRESSED, (), "cpu", 1)
    shown = view(simulation)
    try:
        browser.driver.set_window_size(1200, 800)
        browser.driver.get(shown.address)
        waiting = WebDriverWait(browser.driver, PATIENCE)
        waiting.until(lambda driver: driver.find_elements(By.TAG_NAME, "canvas"))
        waiting.until(lambda driver: "of 0.02 s" in driver.page_source)
        assert shown._server.get_clients()
        assert {"Pause", "Step"} <= set(button_names(browser))
        press(browser, "Pause")
        waiting.until(lambda _: shown.controls.paused)
        air = shown.shown.sliders["air"]
        thumb = browser.driver.find_element(By.CSS_SELECTOR, "[role=slider]")
        for _ in range(5):
            thumb.send_keys(Keys.ARROW_RIGHT)
        waiting.until(lambda _: air.is_moved and air.handle.value > 0.0)
        time.sleep(1.0)  # the last of the keys
        press(browser, "Continue")
        waiting.until(lambda _: not shown.controls.paused)
        simulation.step(5e-3)
        assert simulation.row["pressure"] == pytest.approx(1e3 * air.handle.value) != 0.0
        assert any("by hand" in text for text in simulation.record.warnings.values())
        waiting.until(lambda driver: re.search(r"t = 0\.00\d+ of 0\.02 s", driver.page_source))
    finally:
        browser.driver.get("about:blank")
        shown.close()
        browser.complaints()  # of the page that was left, which are not those of the next test
        browser.requests()


def button_names(browser: Browser) -> list[str]:
    return [b.text for b in browser.driver.find_elements(By.TAG_NAME, "button") if b.text]


def press(browser: Browser, name: str) -> None:
    [button] = [b for b in browser.driver.find_elements(By.TAG_NAME, "button") if b.text == name]
    button.click()
    time.sleep(0.1)
