"""The axis along which a run is followed, and what summary.json says of the motion along it."""

import numpy as np
import pytest

from softsim.analysis.catalogue import RecordedRun, values
from softsim.analysis.travel import displacement, travelling_column, travels, without_radius
from softsim.errors import OutputError
from softsim.scene.measures import Part


def without_walls(t: np.ndarray) -> dict[str, np.ndarray]:
    """Columns of contact of a run that touches nothing."""
    return dict.fromkeys(("contact_area", "wall_force_normal", "slip_share"), 0.0 * t)


def test_the_frame_is_followed_and_without_one_the_body() -> None:
    nothing, moving = np.full(3, np.nan), np.arange(3.0)
    assert travelling_column({"frame_x": moving, "body_x": moving}) == "frame_x"
    assert travelling_column({"frame_x": nothing, "body_x": moving}) == "body_x"
    with pytest.raises(OutputError, match="neither frame_x nor body_x"):
        travelling_column({"frame_x": nothing})


def test_a_frame_is_followed_along_x_if_it_can_move_there() -> None:
    creeping, swinging, held = np.linspace(0, 1e-5, 9), np.linspace(0, 1e-3, 9), np.full(9, 2.0)
    assert travelling_column({"frame_x": creeping, "frame_y": swinging}) == "frame_x"
    assert travelling_column({"frame_x": held, "frame_y": swinging}) == "frame_y"
    assert travelling_column({"frame_x": held}) == "frame_x"


def test_a_body_is_followed_where_it_comes_to_or_swings_furthest() -> None:
    little, far = np.linspace(0, 1e-4, 9), np.linspace(0, -1e-3, 9)
    assert travelling_column({"body_x": little, "body_y": far, "body_z": little}) == "body_y"
    bobbing = 1e-3 * np.sin(np.linspace(0.0, 2.0 * np.pi, 9))
    assert travelling_column({"body_x": -4.0 * little, "body_y": bobbing}) == "body_x"  # a crawler
    assert travelling_column({"body_x": little, "body_y": bobbing}) == "body_y"  # a beam


@pytest.mark.parametrize(("far", "seen"), [(1e-3, True), (-1e-3, True), (1e-10, False)])
def test_round_off_is_no_travel(far: float, seen: bool) -> None:
    assert travels({"body_y": 0.01 + np.linspace(0.0, far, 9)}) is seen
    assert not travels({"pressure": np.ones(9)})


def test_displacement_starts_at_zero_with_the_first_number() -> None:
    moved = displacement({"frame_x": np.array([np.nan, 2.0, 2.5])})
    np.testing.assert_array_equal(moved, [np.nan, 0.0, 0.5])


def test_a_body_is_measured_along_the_axis_that_is_drawn() -> None:
    """In space, x stays and y goes back by 3 mm: the figure shows y, and so does the summary."""
    t = np.linspace(0.0, 1.0, 11)
    history = {"time": t, "body_x": 1e-5 * t, "body_y": 0.02 - 3e-3 * t, "body_z": 1e-3 * t}
    found = values(RecordedRun(history | without_walls(t), {Part.X, Part.Y, Part.Z}))
    assert found["body_displacement_axis"] == travelling_column(history)[-1] == "y"
    assert found["body_displacement"] == pytest.approx(displacement(history)[-1], rel=1e-12)
    components = [found[f"body_displacement_{axis}"] for axis in "xyz"]
    assert components == pytest.approx([1e-5, -3e-3, 1e-3], rel=1e-9)
    speeds = [found[f"body_speed_{axis}"] for axis in "xyz"]
    assert [found["body_speed"], *speeds] == pytest.approx([-3e-3, 1e-5, -3e-3, 1e-3], rel=1e-9)


def test_the_mean_radius_of_a_half_section_is_not_followed() -> None:
    """A body of revolution that swells by 5 mm and creeps by 1 mm along its axis."""
    t = np.linspace(0.0, 1.0, 11)
    history = {"time": t, "body_x": 5e-3 * t, "body_y": 1e-3 * t, "frame_x": 0.0 * t}
    assert list(without_radius(history)) == ["time", "body_y"]
    found = values(RecordedRun(history | without_walls(t), {Part.Y, Part.RADIAL}))
    assert (found["body_displacement_axis"], found["body_displacement"]) == ("y", 1e-3)
    assert "body_displacement_x" not in found
