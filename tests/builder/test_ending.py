"""When a run ends: with so many pressure cycles, or at its time."""

import pytest

from softsim.errors import SceneError

SCENE = """\
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10, fixed: [bottom]}
rigid_bodies: {frame: {mass: 8 g, inertia: 1 kg*mm^2}}
time: {end: 9 s, cycles: 2}
loads:
  air:
    kind: follower_pressure
    facets: [b.top]
"""
CYCLES = """\
    profile: {kind: cycles, highest: 3 kPa, lowest: 1 kPa, inflation_rate: 2 kPa/s, hold: 0.5 s,
              deflation_rate: 4 kPa/s, rest: 0.1 s, count: 5}
"""
EVENTS = """\
    profile: {kind: event_cycles, highest: 3 kPa, lowest: 1 kPa, inflation_rate: 2 kPa/s,
              deflation_rate: 4 kPa/s, contact_force: 1 N, contact_rows: 0, least_rows: 0}
"""
TABLE = "    profile: {kind: table, points: [[0 s, 0 Pa], [1 s, 2 kPa], [2 s, 1 kPa]]}\n"
CONSTANT = "    profile: {kind: constant, value: 3 kPa}\n"


@pytest.mark.parametrize(
    ("profile", "cycles", "end"),
    [
        (CYCLES, 1, 1.5 + 0.5 + 0.5 + 0.1),
        (CYCLES, 2, 2.6 + 1.0 + 0.5 + 0.5 + 0.1),
        (CYCLES, 5, 9.0),  # the time is up before
        (TABLE, 1, 2.0),
        (EVENTS, 2, 9.0),
    ],
)
def test_the_end_is_the_end_of_the_cycle(build, profile, cycles, end):
    model = build(SCENE + profile, f"time.cycles={cycles}")
    assert model.cycles == cycles
    assert model.end_time == pytest.approx(end, rel=1e-14)
    assert model.pressures[0].source.cycle_count >= cycles


def test_without_cycles_the_run_takes_its_time(build):
    model = build(SCENE.replace(", cycles: 2", "") + CYCLES)
    assert (model.cycles, model.end_time) == (None, 9.0)


@pytest.mark.parametrize(
    ("profile", "override", "place", "message"),
    [
        (CYCLES, "time.cycles=6", "--set time.cycles=6", "after 6 pressure cycles, but 'air'"),
        (TABLE, "time.end=8 s", "scene.yaml:5:26", "'air' has only 1"),
        (EVENTS, "loads.air.profile.count=1", "scene.yaml:5:26", "'air' has only 1"),
        (
            CONSTANT,
            "time.end=8 s",
            "scene.yaml:5:26",
            "'air', the chamber of the robot, has no cycles",
        ),
        (CYCLES, "loads={}", "scene.yaml:5:26", "no pressure has cycles to count"),
        (CYCLES, "time.cycles=0", "--set time.cycles=0", "must be at least 1"),
    ],
)
def test_cycles_that_never_come_are_refused(build, profile, override, place, message):
    with pytest.raises(SceneError) as caught:
        build(SCENE + profile, override)
    assert message in str(caught.value)
    assert str(caught.value.location).endswith(place)
    assert caught.value.hint
