"""The closed loop in a run: the robot's section in a 30 mm pipe, inflated until it is held."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from batches import finished
from rich.console import Console

from softsim.loads.pressure_control import Phase

QUIET = Console(quiet=True)

SCENE = """
bodies:
  skin: {mesh: {generator: pfr_section, element_size: 1 mm}, formulation: ring_section,
         sector: 90 deg, rings: skin, thickness: 7 mm, material: dragon_skin_10}
rigid_bodies: {frame: {mass: 8.5 g, inertia: 1 kg*mm^2, tied: [skin.knots], free: [x, y]}}
environment: {walls: {pipe: {kind: pipe, diameter: 30 mm}}}
robot: {rows: ['skin.j*[0-9]']}
loads:
  air:
    kind: follower_pressure
    facets: [skin.chamber_top, skin.chamber_bottom]
    reacts_on: frame
    profile: {kind: event_cycles, highest: 9 kPa, inflation_rate: 120 kPa/s, hold: 10 ms,
              contact_force: 0.5 N, contact_rows: 2, contact_window: 10 ms,
              deflation_rate: 120 kPa/s, lowest: 3 kPa, motion_window: 20 ms, motion_speed: 1 m/s,
              slip_speed: 1 m/s}
contact: {friction_coefficient: 0.5}
time: {end: 0.14 s}
"""


@pytest.fixture
def batch(batch_of):
    """A batch of one, the scene in a folder of that name."""
    return partial(batch_of, SCENE)


def test_a_run_follows_the_wall_and_a_resumed_one_too(batch, tmp_path):
    from softsim.run.control import Feedback

    results = finished(batch("whole"))
    inflation_stops_at_contact(results.history)
    the_summary_says_where(results)
    log = (tmp_path / "whole" / "run.log").read_text()
    assert "cycle 1: contact is made at" in log
    assert "cycle 1: the pressure is the lowest at 3 kPa, now +120 kPa/s" in log

    # Stopped where the fall is commanded, but has not begun.
    stop = results.history["time"][results.history["phase"] == Phase.HOLD][2]
    stopped = batch("parts")
    stopped.act()
    while stopped.solver.time < stop:
        stopped.do_blocks()
    control = stopped.runs[0].callback(Feedback).control
    assert control.phase_at(stopped.solver.time) is Phase.HOLD
    stopped.checkpoint()
    stopped.close()
    finished(batch("parts", resume=True))
    whole, parts = (tmp_path / folder / "history.csv" for folder in ("whole", "parts"))
    assert whole.read_bytes() == parts.read_bytes()


@pytest.mark.slow
def test_a_command_ends_the_control(write_scene, kernel_cache, monkeypatch):
    """Of a simulation; reset, it follows the wall again."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim import Simulation

    simulation = Simulation(write_scene(SCENE), (), "cpu", 1)
    simulation.step(0.1)
    controlled = simulation.history
    simulation.reset()
    simulation.set_load("air", 3e3, within=0.02)
    simulation.step(0.01)
    commanded = simulation.save()
    assert simulation.row["pressure"] == pytest.approx(1.5e3, rel=1e-2)
    simulation.step(0.05)
    assert simulation.row["pressure"] == 3e3 and simulation.row["cycles_done"] == 0.0
    simulation.set_load("air", 1e3)
    simulation.step(0.03)
    assert simulation.row["pressure"] == 1e3
    simulation.restore(commanded)
    simulation.step(0.05)
    assert simulation.row["pressure"] == 3e3
    simulation.reset()
    simulation.step(0.1)
    for name, column in simulation.history.items():
        np.testing.assert_array_equal(column, controlled[name], err_msg=name)


AIR_LINE = SCENE.replace(
    "kind: follower_pressure",
    """kind: pneumatic
    pump: {flow: 100 ml/s, stall: 50 kPa}
    valve: {flow: 300 ml/s, pressure: 5 kPa}
    tube: {length: 0.5 m, bore: 2 mm}
    line_volume: 3 ml
    volume_ratio: 2
    excluded_volume: 5.3 ml""",
)


@pytest.mark.slow
def test_the_control_sees_the_sensor_of_an_air_line(batch_of, tmp_path):
    """Not the skin, which has not come to 9 kPa yet; what is wanted goes on from what the sensor
    showed. A resumed run goes on to the same bits.
    """
    results = finished(batch_of(AIR_LINE, "line"))
    history = results.history
    phase, sensor, skin = (history[c] for c in ("phase", "pressure", "section_pressure"))
    log = (tmp_path / "line" / "run.log").read_text()
    assert "cycle 1: the pressure is the highest at 9" in log
    turn = int(np.argmax(phase == Phase.HOLD)) - 1
    assert sensor[turn] >= 9e3 > skin[turn] + 100.0
    assert set(history["wanted_pressure"][phase == Phase.HOLD]) == {sensor[turn]}
    assert history["air_flow"][turn] > 0.0
    stopped = batch_of(AIR_LINE, "again")
    stopped.act()
    while stopped.solver.time < history["time"][turn + 2]:
        stopped.do_blocks()
    stopped.checkpoint()
    stopped.close()
    finished(batch_of(AIR_LINE, "again", resume=True))
    whole, parts = (tmp_path / folder / "history.csv" for folder in ("line", "again"))
    assert whole.read_bytes() == parts.read_bytes()


def test_a_control_goes_on_in_the_next_step_or_begins_with_the_pressure_there(
    write_scene, tmp_path, kernel_cache, monkeypatch
):
    """The first step ends while the pressure is held; the third has other rates."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run_steps
    from softsim.scene.steps import load_steps

    steps = """steps:
  first: {time: {end: 0.09 s}}
  then: {time: {end: 0.01 s}}
  faster: {time: {end: 0.01 s}, loads: {air: {profile: {inflation_rate: 240 kPa/s}}}}
"""
    scene = write_scene(SCENE.replace("time: {end: 0.14 s}\n", steps))
    found = run_steps(load_steps(scene), tmp_path / "steps", "cpu", console=QUIET, threads=1)
    first, then, faster = (results.history for results in found.values())
    rate = np.diff(then["pressure"]) / np.diff(then["time"])
    assert then["phase"][0] == first["phase"][-1] and then["pressure"][0] == first["pressure"][-1]
    assert np.abs(rate).max() < 1.01 * 120e3
    assert faster["pressure"][0] == pytest.approx(then["pressure"][-1], rel=1e-12)
    assert faster["phase"][0] == Phase.INFLATION and faster["cycle"][0] == 1
    assert faster["pressure"][1] - faster["pressure"][0] == pytest.approx(
        240e3 * np.diff(faster["time"][:2])[0], rel=1e-9
    )


def inflation_stops_at_contact(history):
    """At the first row at which the mean of 10 ms is half a newton; then the pressure is held."""
    t, pressure, phase = (history[c] for c in ("time", "pressure", "phase"))
    force, rows = history["wall_force_normal"], history["rows_in_contact"]
    first = history["cycle"] == 1
    last = np.flatnonzero(first & (phase == Phase.INFLATION))[-1]
    means = [force[k - 4 : k + 1].mean() for k in range(last - 10, last + 1)]
    assert means[-1] >= 0.5 > max(means[:-1])
    assert rows[last] >= 2
    assert 3e3 < pressure[last] < 9e3
    assert set(pressure[first & (phase == Phase.HOLD)]) == {pressure[last]}
    fall = pressure[first & (phase == Phase.DEFLATION)]
    assert (np.diff(fall) < 0.0).all()
    assert fall[-1] == 3e3
    # In a row of 2 ms 0.24 kPa, an increment more.
    assert np.abs(np.diff(pressure)).max() < 1.01 * 120e3 * np.diff(t).max()
    assert history["cycle"][-1] == 2
    np.testing.assert_array_equal(history["section_pressure"], pressure)


def the_summary_says_where(results):
    summary, history = results.summary, results.history
    assert summary["cycles_done"] == 1
    held = history["pressure"][history["phase"] == Phase.HOLD][0]
    assert summary["deflation_begin_pressure"] == [held]
    assert summary["deflation_end_pressure"] == [3e3]
    assert len(summary["displacement_per_cycle"]) == len(summary["end_pressure"]) == 1


def test_cycles_of_a_pressure_that_was_written_before(build):
    """Up for 2 ms, down for 1, up for 1, down for 1; without a pressure there are none."""
    from softsim.run.control import Feedback

    bare = """
bodies:
  b: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10, fixed: [bottom]}
time: {end: 1 s}
"""
    air = """
loads:
  air: {kind: follower_pressure, facets: [b.top],
        profile: {kind: cycles, highest: 2 kPa, inflation_rate: 1 MPa/s, deflation_rate: 1 MPa/s,
                  lowest: 1 kPa, count: 2}}
"""
    feedback = Feedback(SimpleNamespace(model=build(bare + air)))
    found = [feedback.cycles_done(time) for time in (0.0, 2.9e-3, 3e-3, 4.9e-3, 5e-3)]
    assert found == [0, 0, 1, 1, 2]
    times = np.array([2.9e-3, 3e-3, 5e-3])
    assert feedback.readings(times)["cycles_done"].tolist() == [0, 1, 2]
    assert feedback.control is None
    assert Feedback(SimpleNamespace(model=build(bare))).cycles_done(9.0) == 0


def test_a_run_ends_with_its_cycle(batch):
    """In a closed loop with the row that shows that the cycle is over; time.end is later."""
    results = finished(batch("cycle", "time.cycles=1"))
    assert (results.summary["ended_by"], results.summary["cycles_done"]) == ("cycles", 1)
    done = results.history["cycles_done"]
    assert (done[-2], done[-1]) == (0.0, 1.0)
    assert results.summary["simulated_time"] == results.history["time"][-1] < 0.14
