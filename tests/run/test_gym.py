"""The gymnasium environment, and the examples of docs/python.md."""

import re
from pathlib import Path

import numpy as np
import pytest
from batches import PRESSED_BLOCK

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


@pytest.mark.slow
def test_the_examples_of_the_page(monkeypatch, kernels_of_users):
    """A controller presses with 2 N; the policy that is found passes the elbow before 4.5 s, which
    event_cycles take.
    """
    pytest.importorskip("gymnasium")
    monkeypatch.chdir(ROOT)
    page = (ROOT / "docs" / "python.md").read_text()
    pressed, elbow = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    names: dict = {}
    exec(pressed, names)
    assert names["simulation"].row["wall_force_normal"] == pytest.approx(2.0, rel=0.1)
    exec(elbow, names)
    assert names["fastest"] < 4.0
