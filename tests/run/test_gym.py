"""The gymnasium environment, and the examples of docs/how_to/python.md."""

import re
from pathlib import Path

import numpy as np
import pytest
from batches import PRESSED_BLOCK

from softsim.errors import SimulationError

ROOT = Path(__file__).parents[2]


def test_an_episode_and_gymnasium_s_own_check(write_scene, kernel_cache, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    checker = pytest.importorskip("gymnasium.utils.env_checker")
    from softsim import Simulation
    from softsim.gym import PressureEnv

    simulation = Simulation(write_scene(PRESSED_BLOCK), (), "cpu", 1)
    env = PressureEnv(
        simulation, "air", 0.0, 2e3, 3e-3, ("pressure", "body_y"), "body_y", time_price=1e-3
    )
    checker.check_env(env, skip_render_check=True)
    first, info = env.reset(seed=3)
    assert info["time"] == 0.0 and first[0] == 0.0
    seen, rewards = [first], []
    truncated = False
    while not truncated:
        observation, reward, terminated, truncated, info = env.step(np.array([0.5]))
        assert not terminated
        seen.append(observation)
        rewards.append(reward)
    assert len(seen) == 8 and info["time"] == pytest.approx(20e-3, rel=1e-9)
    assert seen[-1][0] == pytest.approx(1.5e3, rel=1e-9)
    gained = seen[-1][1] - first[1]
    assert sum(rewards) == pytest.approx(gained - 1e-3 * 20e-3, rel=1e-9)


class StubSimulation:
    """Chamber `air` and a row of two columns; records the pressures that are commanded."""

    time, end_time, finished = 0.0, 1.0, False
    chambers = ("air",)

    def __init__(self):
        self.row = {"time": 0.0, "body_x": 0.0}
        self.commanded = []

    def set_load(self, name, value, within):
        self.commanded.append(value)

    def step(self, duration):
        self.time += duration


def pressure_env(simulation=None, **changed):
    pytest.importorskip("gymnasium")
    from softsim.gym import PressureEnv

    said = {"chamber": "air", "lowest": 5e3, "highest": 23e3, "interval": 0.1,
            "observed": ("time",), "progress": "body_x"}  # fmt: skip
    return PressureEnv(simulation or StubSimulation(), **said | changed)


def test_actions_beyond_the_box_are_clipped():
    simulation = StubSimulation()
    env = pressure_env(simulation)
    for action in (5.0, 1.0, 0.0, -1.0, -7.0):
        env.step(np.array([action], dtype=np.float32))
    assert simulation.commanded == [23e3, 23e3, 14e3, 5e3, 5e3]
    for action in (np.array([np.nan]), np.array([1.0, 2.0]), "x", None):
        with pytest.raises(SimulationError, match="one finite number from -1 to 1"):
            env.step(action)
    assert len(simulation.commanded) == 5


@pytest.mark.parametrize(
    ("changed", "refused"),
    [
        ({"chamber": "ari"}, "no chamber 'ari'\n  did you mean 'air'?"),
        ({"observed": ("time", "bodyx")}, "no column 'bodyx'\n  did you mean 'body_x'?"),
        ({"progress": "x"}, "no column 'x'\n  allowed here: time, body_x"),
        ({"lowest": None}, "must be finite numbers"),
        ({"highest": 5e3}, "highest must be above lowest"),
        ({"interval": 0.0}, "interval above zero"),
    ],
)
def test_an_environment_that_cannot_run_is_refused_when_it_is_made(changed, refused):
    with pytest.raises(SimulationError) as caught:
        pressure_env(**changed)
    assert refused in str(caught.value)


@pytest.mark.slow
def test_the_examples_of_the_page(monkeypatch, kernels_of_users):
    """A controller presses with 2 N; the policy that is found passes the elbow before 4.5 s, which
    event_cycles take.
    """
    pytest.importorskip("gymnasium")
    monkeypatch.chdir(ROOT)
    page = (ROOT / "docs" / "how_to" / "python.md").read_text()
    examples = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    [pressed] = [text for text in examples if 'row["wall_force_normal"]' in text]
    [elbow] = [text for text in examples if "fastest" in text]
    names: dict = {}
    exec(pressed, names)
    assert names["simulation"].row["wall_force_normal"] == pytest.approx(2.0, rel=0.1)
    exec(elbow, names)
    assert names["fastest"] < 4.0
