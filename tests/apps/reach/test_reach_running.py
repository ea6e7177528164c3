"""Trials of a robot of known pull: sought on workers, stored, gone on with; scenes of trials."""

import io
from pathlib import Path

import numpy as np
import pullers
import pytest
from rich.console import Console

from softsim.apps.reach.report import draw_reach, in_words, pull_rows, read_reach
from softsim.apps.reach.running import Plan, Search, plan_for, searches, seek, write_answer
from softsim.apps.reach.trials import BEST, Heading, Puller, TrialPipe, drag_override, progress
from softsim.errors import SceneError, StabilityError
from softsim.scene.loading import REACH, load_layout, load_scene
from softsim.sweep.engine import local_pool
from validation.thesis import EFFECTIVE_RATE, LOWEST

LAYOUT = Path(__file__).parents[3] / "scenes/reach/riser_36mm.yaml"
LEVEL, UPRIGHT = (TrialPipe(36e-3, heading) for heading in (Heading.level, Heading.upright))


def planned(layout: Path, robot: str, overrides: list[str]) -> Plan:
    return plan_for(load_layout(layout, robot, overrides, REACH), robot, overrides)


@pytest.fixture(scope="module")
def plan() -> Plan:
    return planned(LAYOUT, "pfr", ["contact.friction_coefficient=0.6"])


@pytest.fixture(scope="module")
def pool():
    with local_pool(1) as pool:
        yield _Kept(pool)


class _Kept:
    """A pool that several calls take unlimiteding it."""

    def __init__(self, pool):
        self.pool = pool

    def __enter__(self):
        return self.pool

    def __exit__(self, *_):
        return None


def sought(plan: Plan, folder: Path, pool, simulate) -> tuple[list[Search], str]:
    asked, told = searches(plan.scenes, plan.puller, folder, folder, 1.2, "cpu"), io.StringIO()
    seek(asked, folder, pool, "cpu", Console(file=told, width=200), simulate)
    return asked, told.getvalue()


def test_trials_leave_a_bracket_and_run_once(plan, pool, tmp_path):
    with pytest.raises(StabilityError, match=r"with 37.* mN has failed: element 7"):
        sought(plan, tmp_path, pool, pullers.breaking)
    asked, told = sought(plan, tmp_path, pool, pullers.pulling)
    assert [search.pipe for search in asked] == [LEVEL, UPRIGHT]
    assert "36mm_level, 141 mN" not in told  # is stored
    for search in asked:
        assert search.bracket.low < pullers.PULL < search.bracket.high
        assert search.bracket.high / search.bracket.low <= 1.2
    assert sought(plan, tmp_path, pool, pullers.breaking)[1] == ""
    _says_how_far(plan, asked, tmp_path)


def _says_how_far(plan: Plan, asked: list[Search], folder: Path) -> None:
    [found] = write_answer(plan, "pfr", asked, folder)
    # After 2 m level the tension is 0.03 to 0.044 N, after the bend upwards 0.065 to 0.144 N, of
    # 0.09 to 0.11 N: it ends in the bend, or at the second one, a metre higher.
    assert 2.0 < found.least < 2.1
    assert 3.05 < found.most < 3.2
    content = read_reach(folder)
    assert content["exits"][0]["least"] == found.least
    assert len(pull_rows(content)) == 2
    assert draw_reach(folder).is_file()


def test_scenes_of_trials(plan):
    level, upright = plan.scenes[LEVEL].scene, plan.scenes[UPRIGHT].scene
    for scene in (level, upright):
        assert scene.contact.friction_coefficient == 0.6
        assert scene.layout is None
        assert scene.trailed is None
        profile = scene.loads["air"].profile
        assert (profile.deflation_rate, profile.lowest) == pytest.approx((1300.0, 11000.0))
        assert scene.environment.walls["pipe"].diameter == pytest.approx(36e-3)
    assert level.environment.inclination == 0.0
    assert upright.environment.inclination == pytest.approx(0.5 * np.pi)
    assert upright.loads["tether"].drag == 0.0


@pytest.mark.parametrize(("robot", "share"), [("pfr", 0.5), ("pfr_solid", 1.0)])
def test_a_section_gets_its_share_of_the_drag(robot, share, tmp_path):
    plan = planned(LAYOUT, robot, [])
    assert plan.puller.share == share
    for pipe, loaded in plan.scenes.items():
        file = tmp_path / f"{pipe.name}.yaml"
        file.write_text(loaded.resolved())
        scene = load_scene(file, [drag_override(plan.puller, pipe, 0.2)]).scene
        force = scene.loads["tether"].drag
        if pipe.heading is Heading.upright:
            force = -scene.loads["trailed"].force[0]
        assert force == pytest.approx(0.2 * share)


def test_the_best_cycles_are_those_of_the_thesis():
    for diameter, rate, lowest in BEST:
        pipe = round(1e3 * diameter)
        assert (1e-3 * rate, 1e-3 * lowest) == pytest.approx((EFFECTIVE_RATE[pipe], LOWEST[pipe]))


def test_progress_is_that_of_a_whole_cycle():
    """From one begin of a fall to the next: what came before and after does not count."""
    pressure = np.array([0.0, 1.0, 1.0, 0.5, 1.0, 1.0, 0.4])
    x = np.array([0.0, 3.0, 3.0, 4.0, 3.5, 3.2, 9.0])
    history = {"pressure": pressure, "frame_x": x, "time": 2.0 * np.arange(7)}
    assert progress(history) == pytest.approx((0.2, 6.0))
    rippled = pressure + 0.01 * (-1.0) ** np.arange(7)
    of_air_line = history | {"pressure": rippled, "wanted_pressure": pressure}
    assert progress(of_air_line) == pytest.approx((0.2, 6.0))
    with pytest.raises(StabilityError, match="does not fall twice"):
        progress({name: column[:5] for name, column in history.items()})


def test_a_robot_that_trails_nothing_is_refused():
    loaded = load_scene(LAYOUT.parents[1] / "pfr_vertical_hold.yaml")
    with pytest.raises(Exception, match="'frame' has no tether"):
        Puller.of(loaded)


@pytest.mark.parametrize(
    ("override", "said"),
    [
        ("environment.walls.pipe={kind: pipe, diameter: 36 mm}", "needs a wall of kind pipe_path"),
        ("environment.walls.pipe.diameter=60 mm", "no optimal pressure cycle is known for a pipe"),
        ("environment.gravity=0 m/s^2", "without gravity"),
    ],
)
def test_layouts_that_say_too_little_are_refused(override, said):
    with pytest.raises(SceneError, match=said):
        planned(LAYOUT, "pfr", [override])


def test_bands_in_words():
    assert in_words([0.1, 0.12], 1e3, "mN") == "100 to 120 mN"
    assert in_words([0.1, None], 1e3, "mN") == "at least 100 mN"
    assert in_words([None, None], 1.0, "m") == "unlimited"
