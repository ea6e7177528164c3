"""The gymnasium environment, and the examples of docs/how_to/python.md."""

import re
from pathlib import Path

import numpy as np
import pytest
from batches import PRESSED_BLOCK, SLIDING_BLOCK

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


TASK = {"chamber": "air", "lowest": 0.0, "highest": 4e3, "interval": 2e-3,
        "observed": ("pressure", "body_y", "frame_y"), "progress": "body_y",
        "time_price": 1e-3}  # fmt: skip
ENDINGS = (
    "time.end=12 ms",
    "time.reach={column: pressure, above: 2.9 kPa}",
    "solver.energy_error_limit=1e-3",
)
"""Overrides of PRESSED_BLOCK: 4 kPa within an action give an energy error, 3 kPa end the run."""


@pytest.fixture
def vector_env(write_scene, kernel_cache, monkeypatch):
    """Three environments of one scene, and the function that makes a simulation of it alone."""
    pytest.importorskip("gymnasium")
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim import Simulation
    from softsim.gym import make_vec

    scene = write_scene(PRESSED_BLOCK)
    envs = make_vec(scene, 3, **TASK, overrides=ENDINGS, device="cpu", threads=1)
    return envs, lambda: Simulation(scene, ENDINGS, "cpu", 1)


def actions_of_three():
    """Actions (steps, 3, 1): a run that a check stops, one to the end, one that ends by 3 kPa."""
    count = 9
    ending = np.array([0.0, -0.5, 0.5, 0.0, -1.0, -0.2, 0.1, 0.5, 0.0])
    return np.stack([np.full(count, 1.0), np.full(count, -1.0), ending], axis=1)[..., None]


def same_steps(one, other):
    """The same observations, rewards, flags and infos, to the bit."""
    for mine, theirs in zip(one, other, strict=True):
        if isinstance(mine, dict):
            assert mine.keys() == theirs.keys()
            same_steps(mine.values(), theirs.values())
        else:
            np.testing.assert_array_equal(mine, theirs)


def test_a_vector_env_is_gymnasium_s_of_its_simulations_and_each_is_as_alone(vector_env):
    """Runs end at different times, by a check, by the scene's condition and at its end; each starts
    again while the others continue.
    """
    from gymnasium.vector import AutoresetMode, SyncVectorEnv

    from softsim.gym import PressureEnv

    envs, alone = vector_env
    members = [PressureEnv(simulation, **TASK) for simulation in envs.batch.simulations]
    sync = SyncVectorEnv([lambda member=member: member for member in members])
    for name in ("single_action_space", "action_space", "single_observation_space",
                 "observation_space", "num_envs"):  # fmt: skip
        assert getattr(envs, name) == getattr(sync, name)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP

    actions, seeds = actions_of_three(), [3, 5, None]
    expected = [sync.reset(seed=seeds), *map(sync.step, actions)]
    found = [envs.reset(seed=seeds), *map(envs.step, actions)]
    for one, other in zip(found, expected, strict=True):
        same_steps(one, other)
    for observations, *_ in found:
        assert observations in envs.observation_space
    _, _, terminated, truncated, infos = map(list, zip(*found[1:], strict=True))
    ends = np.array(terminated) | np.array(truncated)
    assert np.flatnonzero(ends[:, 0]).tolist() == [0, 2, 4, 6, 8]  # 4 kPa, and again
    assert "energy" in infos[0]["failure"][0] and infos[0]["_failure"].tolist() == [1, 0, 0]
    assert np.flatnonzero(ends[:, 1]).tolist() == [5] and truncated[5][1] and not terminated[5][1]
    assert np.flatnonzero(ends[:, 2]).tolist() == [2, 7] and terminated[2][2]
    assert infos[3]["time"][2] == 0.0 < infos[3]["time"][1]

    first_seed, again = envs.reset(seed=7), envs.reset(seed=[7, 8, 9])
    same_steps(first_seed, again)
    envs.step(actions[1])
    mask = np.array([False, False, True])
    observations, infos = envs.reset(options={"reset_mask": mask})
    assert infos["_time"].tolist() == mask.tolist() and infos["time"][2] == 0.0
    assert observations[2, 0] == 0.0 < observations[0, 0]
    for refused, ask in (
        ("2 seeds for 3", lambda: envs.reset(seed=[1, 2])),
        ("must be a boolean array", lambda: envs.reset(options={"reset_mask": np.ones(3)})),
        (r"an array \(3, 1\), not of shape \(3,\)", lambda: envs.step(np.zeros(3))),
        ("one finite number", lambda: envs.step(np.full((3, 1), np.nan))),
    ):
        with pytest.raises(SimulationError, match=refused):
            ask()

    lone = PressureEnv(alone(), **TASK)  # which ends the batch
    for number, seed in enumerate(seeds):
        observation, _ = lone.reset(seed=seed)
        over = False
        for k, action in enumerate(actions[:, number]):
            if over:
                observation, _ = lone.reset()
                step = (observation, 0.0, False, False)
            else:
                step = lone.step(action)[:4]
            over = step[2] or step[3]
            same_steps(step, [values[number] for values in found[1 + k][:4]])


def test_an_episode_after_a_full_neighbour_list(
    write_scene, kernel_cache, monkeypatch, short_lists
):
    """Check that the episode after the failure equals the one before it."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    pytest.importorskip("gymnasium")
    from softsim import Simulation
    from softsim.gym import PressureEnv

    simulation = Simulation(write_scene(SLIDING_BLOCK), (), "cpu", 1)
    env = PressureEnv(
        simulation, "air", 0.0, 2e3, 2e-3, ("slider_x", "slider_y", "friction_dissipation"),
        "slider_x",
    )  # fmt: skip

    def episode(actions):
        return [env.reset(), *(env.step(np.array([action])) for action in actions)]

    gentle = [-0.9, -0.8, -0.9]
    before, failing, after = episode(gentle), episode([1.0, 1.0, 1.0]), episode(gentle)
    assert [step[2] for step in failing[1:]] == [False, False, True]
    assert "too many facets" in failing[-1][4]["failure"]
    for one, other in zip(before, after, strict=True):
        same_steps(one, other)
    slid, _, rubbed = before[-1][0]
    assert slid > 0.3e-3 and rubbed > before[-2][0][2] > 0.0


def test_a_vector_env_refuses_static_scenes_and_counts():
    pytest.importorskip("gymnasium")
    from softsim.gym import make_vec

    scene = ROOT / "scenes" / "pneunet.yaml"
    with pytest.raises(SimulationError, match="a static scene cannot be simulated in a batch"):
        make_vec(scene, 2, **TASK, device="cpu")
    for count in (0, 2.0, "two"):
        with pytest.raises(SimulationError, match="a whole number of simulations"):
            make_vec(scene, count, **TASK, device="cpu")


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
