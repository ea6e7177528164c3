"""Files of chains: what is refused, where, and what would be right."""

from pathlib import Path

import numpy as np
import pytest

from softsim.apps.chain.running import build_chain
from softsim.apps.chain.scene import CHAINS, chain_names, load_chain
from softsim.cli.about import examples_folder
from softsim.errors import SceneError

LEAFBOT = (CHAINS / "leafbot5.yaml").read_text(encoding="utf-8")


def refused(path, *overrides, **options):
    with pytest.raises(SceneError) as caught:
        build_chain(load_chain(path, overrides, options))
    return str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "place", "message", "hint"),
    [
        ("pitch: 14 mm", "pitch: 17 mm", "9:25", "rows take 68 mm, but the backbone is 64 mm long",
         "a pitch of at most 16 mm"),
        ("under_head: 2", "under_head: 5", "9:54", "5 of 5 rows leave no row behind the head",
         "at most 4"),
        ("head: 2.6 g", "head: 0.5 g", "10:9",
         "the nodes have 2 g in total, less than the backbone, 2.0736 g", "the motor, its housing"),
        ("drag: 0.01", "slope: 91 deg\ndrag: 0.01", "14:8",
         "slope: 91 deg is beyond a wall", "from -90 to 90 deg"),
        ("drag: 0.01", "time: {increment: 0.5 ms}\ndrag: 0.01", "14:19",
         "500 us is too long for a process", "at most"),
        ("142 Hz", "2 kHz", "2:1", "less than 10 steps per turn of the motor", "at most 50 us"),
        ("drag: 0.01", "time: {end: 0.1 ms}\ndrag: 0.01", "14:13", "0.5 steps of 200 us",
         "from 2 to 1,000,000"),
        ("eccentric_mass: 0.082 g", "eccentric_mass: 3 g", "13:25",
         "3 g is more than the mass of the head, 2.6 g", ""),
        ("damping: 1.3 N*s/m", "damping: 1.3 N/m", "11:38",
         "is a stiffness, a damping coefficient is needed", "1.3 N*s/m"),
        ("damping: 1.3 N*s/m", "damping: 1.3 N*s/m, damped: never", "11:57",
         "'never' is not one of: always, contact", ""),
        ("friction:", "frictoin:", "12:1", "unknown key 'frictoin'", "did you mean 'friction'?"),
        ("count: 5", "count: 1", "9:15", "1 must be at least 2", ""),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_its_place(tmp_path, old, new, place, message, hint):
    assert old in LEAFBOT
    file = tmp_path / "bot.yaml"
    file.write_text(LEAFBOT.replace(old, new))
    told = refused(file)
    assert f"{file}:{place}: " in told and message in told and hint in told


def test_options_of_the_command_are_places_too():
    told = refused("leafbot5", **{"--slope": (("slope",), "100 deg")})
    assert told.startswith("--slope 100 deg: slope: 100 deg is beyond a wall")
    assert "'motor.frequenzy'" in refused("leafbot5", "motor.frequenzy=3 Hz")


def test_an_unknown_chain():
    assert "did you mean 'leafbot5'?" in refused("leafbot55")


@pytest.mark.parametrize(
    ("name", "first_link", "limbs"), [("leafbot3", 28, 2), ("leafbot5", 21, 4), ("leafbot9", 14, 6)]
)
def test_the_head_stands_in_the_middle_of_its_rows(name, first_link, limbs):
    chain = build_chain(load_chain(name))
    assert chain.node_count == {"leafbot3": 3, "leafbot5": 4, "leafbot9": 7}[name]
    assert chain.links.lattice.lengths[0] == pytest.approx(first_link * 1e-3)
    assert chain.stores["limbs"].stiffnesses[0] == pytest.approx(limbs * 250.0)
    assert name in chain_names()


@pytest.mark.parametrize("file", sorted(Path(examples_folder(), "chains").glob("*.yaml")))
def test_shipped_chains_are_built(file):
    robot, _ = file.stem.rsplit("_", 1)
    assert build_chain(load_chain(file)).node_count == {"leafbot5": 4, "leafbot_x5": 10}[robot]


@pytest.mark.parametrize(
    ("place", "head", "first", "last"),
    [("front", 0, 21, 14), ("rear", 3, 14, 21)],
)
def test_the_head_stands_where_it_is_told(place, head, first, last):
    chain = build_chain(load_chain("leafbot5", [f"motor.place={place}"]))
    assert chain.heads.tolist() == [head]
    assert chain.masses[head] == pytest.approx(2.6e-3) and chain.motors.forces[head] > 0.0
    gaps = 1e3 * chain.links.lattice.lengths
    assert (gaps[0], gaps[-1]) == pytest.approx((first, last))


def test_sides_have_their_own():
    overrides = ["sides.running=right", "sides.right={motor_share: 0.9, frequency: 100 Hz}",
                 "sides.left={limb_share: 1.1, friction_share: 0.5}"]  # fmt: skip
    chain = build_chain(load_chain("leafbot_x5", overrides))
    assert chain.heads.tolist() == [2, 7]
    force = 0.9 * 0.082e-3 * 3.4e-3 * (2.0 * np.pi * 100.0) ** 2
    assert chain.motors.forces == pytest.approx(force * np.eye(10)[7])
    assert chain.stores["limbs"].stiffnesses == pytest.approx(5 * [550.0] + 5 * [500.0])
    assert chain.others["friction"].coefficients == pytest.approx(5 * [0.35] + 5 * [0.7])


@pytest.mark.parametrize(
    ("overrides", "message", "hint"),
    [
        (["rows.under_head=2"], "with 3 nodes beside the head, it has no place in the middle",
         "rows.under_head to 3"),
        (["motor.further={fast: 150 Hz}", "sides.left.frequency=95 Hz"],
         "each side has its own motor frequency", "leave out motor.further"),
        (["sides.right.frequency=900 Hz"], "less than 10 steps per turn of the motor",
         "at most 111.1"),
        (["sides.distance=0 mm"], "must be greater than 0 mm", ""),
        (["sides.running=none"], "'none' is not one of: both, left, right", ""),
    ],
)  # fmt: skip
def test_what_is_wrong_with_sides(overrides, message, hint):
    told = refused("leafbot_x5", *overrides)
    assert message in told and hint in told


def test_what_was_resolved_loads_again(tmp_path):
    loaded = load_chain("leafbot9", ["time.end=1 s"], {"--slope": (("slope",), "3 deg")})
    again = tmp_path / "again.yaml"
    again.write_text(loaded.resolved())
    assert load_chain(again).scene == loaded.scene
    assert "slope: 3 deg  # --slope" in loaded.resolved()
