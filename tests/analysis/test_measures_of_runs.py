"""What summary.json says of a robot: synthetic histories, and one short run."""

import io
import json

import numpy as np
import pytest
from rich.console import Console

from softsim.analysis.catalogue import OF_EVERY_RUN
from softsim.analysis.measures import measures

BODY = """
bodies:
  b: {mesh: {generator: block, length: 10 mm, height: 1 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10, fixed: [bottom]}
rigid_bodies: {frame: {mass: 8.8 g, inertia: 1 g*mm^2}}
robot: {rows: [b.top]}
"""
CYCLES = """
loads:
  air: {kind: follower_pressure, facets: [b.top],
        profile: {kind: cycles, highest: 20 kPa, inflation_rate: 20 kPa/s, hold: 1 s,
                  deflation_rate: 2 kPa/s, lowest: 10 kPa, count: 2}}
  gauge: {kind: tendon, acts_on: frame}
"""
EVENTS = """
loads:
  air: {kind: follower_pressure, facets: [b.top],
        profile: {kind: event_cycles, highest: 20 kPa, inflation_rate: 20 kPa/s, hold: 1 s,
                  deflation_rate: 2 kPa/s, lowest: 10 kPa, contact_force: 1 N, contact_rows: 0,
                  least_rows: 0}}
  gauge: {kind: tendon, acts_on: frame}
"""
END = "time: {end: 20 s}\n"
# Pressure: up until 1, held until 2, down until 7; up until 7.5, held until 8.5, down until 13.5 s.
TIMES = [0.0, 1.0, 2.0, 7.0, 7.5, 8.5, 13.5]
PRESSURES = [0.0, 20e3, 20e3, 10e3, 20e3, 20e3, 10e3]
# The inflation pushes it forward by 3 mm, then 1 mm; in each fall it is drawn back by 1 mm within
# 2 s, and then walks: 41 mm within the next 2 s in the first, not at all in the second.
PLACES = ([0, 1, 2, 4, 6, 7, 7.5, 8.5, 10.5, 13.5], [0, 3, 3, 2, 43, 43, 44, 44, 43, 43])


def history(end: float) -> dict[str, np.ndarray]:
    """Rows 2 ms apart up to `end` [s] of the robot above, pulling 0.5 N from 2 s on."""
    t = np.arange(0.0, end + 1e-3, 2e-3)
    pressure = np.interp(t, TIMES, PRESSURES)
    return {
        "time": t,
        "pressure": pressure,
        "frame_x": 1e-3 * np.interp(t, *PLACES),
        "frame_y": 0.0 * t,
        "body_x": 0.0 * t,
        "body_y": 0.0 * t,
        "contact_area": 0.0 * t,
        "row_force_b.top": np.where(t > 2.0, 4.0, 1.0),
        "rows_in_contact": np.where(pressure > 15e3, 3.0, 5.0),
        "wall_force_normal": np.where(t > 2.0, 4.0, 1.0),
        "slip_share": np.where(t > 2.0, 0.5, 0.0),
        "pull": np.where(t > 2.0, 0.5, 0.0) + np.where(np.isclose(t, 3.0), 1.0, 0.0),
    }


def test_two_cycles(build):
    """Times of rows are off by 2 ms, pressures by 4 Pa, means over 13.5 s by 2e-4 of them."""
    found = measures(build(BODY + CYCLES + END), history(13.5))
    assert found["displacement_per_cycle"] == pytest.approx([43e-3, 0.0], abs=1e-12)
    assert found["displacement_while_falling"] == pytest.approx([40e-3, -1e-3], abs=1e-12)
    assert found["mean_speed"] == pytest.approx(43e-3 / 13.5, rel=1e-12)
    # 5 and 95 % of the way from 4 to 6 s, where the pressure is 16 to 12 kPa.
    assert found["onset_pressure"] == [pytest.approx(15.8e3, abs=4.1), None]
    assert found["end_pressure"] == [pytest.approx(12.2e3, abs=4.1), None]
    assert found["rows_at_highest"] == 3.0
    assert found["rows_in_contact"] == 5.0
    assert found["slip_share"] == pytest.approx(0.5 * 4.0 * 11.5 / (2.0 + 4.0 * 11.5), rel=2e-4)
    assert found["peak_pull"] == 1.5
    assert found["mean_pull"] == pytest.approx((0.5 * 11.5 + 1.0 * 2e-3) / 13.5, rel=2e-4)
    assert found["dominant_frequency"] is None
    assert found["cycles_done"] == 2
    assert "deflation_end_pressure" not in found  # the scene says it


def test_cycles_that_follow_events(build):
    """The same course, found by a control: where it turned is news."""
    rows = history(14.0)
    part = np.searchsorted([1.0, 2.0, 7.0, 7.5, 8.5, 13.5], rows["time"] - 1e-9)
    rows["cycle"] = np.array([1, 1, 1, 2, 2, 2, 3])[part]
    rows["phase"] = np.array([1, 2, 3, 1, 2, 3, 1])[part]
    found = measures(build(BODY + EVENTS + END), rows)
    given = measures(build(BODY + CYCLES + END), history(14.0))
    assert found["cycles_done"] == 2
    assert found["deflation_begin_pressure"] == pytest.approx([20e3, 20e3], rel=1e-12)
    assert found["deflation_end_pressure"] == pytest.approx([10e3, 10e3], rel=1e-12)
    for name in ("displacement_per_cycle", "displacement_while_falling", "mean_speed"):
        assert found[name] == pytest.approx(given[name], rel=1e-9)
    assert found["onset_pressure"] == given["onset_pressure"]


def test_a_cycle_that_has_not_ended_does_not_count(build):
    found = measures(build(BODY + CYCLES + END), history(12.0))
    assert len(found["displacement_per_cycle"]) == len(found["onset_pressure"]) == 1
    assert found["mean_speed"] == pytest.approx(43e-3 / 7.0, rel=1e-12)
    assert found["frame_displacement"] == pytest.approx(43e-3, rel=1e-12)


def test_without_pressure(build):
    """Mode 1: no cycle, no pressure, the speed of the whole run; and no wall in reach."""
    rows = history(4.0)
    del rows["pressure"]
    rows["wall_force_normal"] = rows["slip_share"] = 0.0 * rows["time"]
    found = measures(build(BODY + END), rows)
    assert found["mean_speed"] == pytest.approx(2e-3 / 4.0, rel=1e-12)
    assert found["rows_at_highest"] is found["slip_share"] is None
    absent = {"displacement_per_cycle", "onset_pressure", "end_pressure", "peak_pull", "mean_pull"}
    assert not absent & set(found)


OF_REVOLUTION = """
bodies:
  b: {mesh: {generator: block, length: 10 mm, height: 1 mm, element_size: 1 mm},
      formulation: axisymmetric, material: dragon_skin_10, fixed: [bottom], position: [8 mm, 0 mm]}
rigid_bodies: {frame: {mass: 8.8 g, inertia: 1 g*mm^2, center: [0 mm, 9 mm]}}
"""


def test_an_axisymmetric_robot_moves_along_its_axis(build):
    """Its skin swells by 0.05 mm while its centre climbs by 3.5 mm, its frame by 2 mm."""
    t = np.linspace(0.0, 1.0, 11)
    rows = history(1.0) | {"time": t, "body_x": 8e-3 + 5e-5 * t, "body_y": 3.5e-3 * t}
    rows |= {"frame_x": 0.0 * t, "frame_y": 2e-3 * t, "contact_area": 0.0 * t}
    rows |= {"wall_force_normal": 0.0 * t, "slip_share": 0.0 * t}
    del rows["pressure"]
    found = measures(build(OF_REVOLUTION + END), rows)
    assert found["body_displacement"] == found["body_displacement_y"] == pytest.approx(3.5e-3)
    assert found["body_speed"] == pytest.approx(3.5e-3)
    assert found["body_displacement_radial"] == pytest.approx(5e-5)
    assert found["body_speed_radial"] == pytest.approx(5e-5)
    assert found["frame_displacement"] == pytest.approx(2e-3)
    assert found["mean_speed"] == pytest.approx(2e-3)
    assert found["frame_displacement_axis"] == found["body_displacement_axis"] == "y"


def test_nothing_of_a_run_without_rows(build):
    nothing = {name: column[:0] for name, column in history(1.0).items()}
    assert measures(build(BODY + END), nothing) == {}


RUN = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10, fixed: [bottom],
      position: [40 mm, 5 mm]}
rigid_bodies:
  frame: {mass: 10 g, inertia: 1 kg*mm^2, outline: {length: 20 mm, height: 10 mm}, free: [x, y],
          center: [2 mm, 5.1 mm], initial_velocity: [50 mm/s, 0 m/s]}
loads:
  air: {kind: follower_pressure, facets: [b.top],
        profile: {kind: table, points: [[0 s, 0 Pa], [50 ms, 1 kPa], [150 ms, 0 Pa]]}}
  motor: {kind: eccentric_mass, acts_on: frame, eccentric_mass: 0.05 g, radius: 1 mm,
          frequency: 100 Hz, spin_up: 20 ms}
  gauge: {kind: tendon, acts_on: frame, stiffness: 0.1 N/mm, slack: 2 mm}
environment: {walls: {floor: {kind: plane}}}
contact: {friction_coefficient: 0}
time: {end: 300 ms}
expect: {peak_pull: {min: 10 mN, max: 60 mN}, mean_speed: {min: -14 mm/s, max: -12 mm/s}}
"""


def test_a_short_run(write_scene, tmp_path, kernel_cache, monkeypatch):
    """A frame slides without friction into its tendon and back; its motor is too weak to lift it.

    The tendon stops it with v sqrt(k m) = 50 mN, a mean of 2 ms rows less by (omega 2 ms)^2 / 24;
    without friction every node that touches slips as soon as it moves.
    """
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    console = Console(file=io.StringIO())
    run(write_scene(RUN), (), tmp_path / "out", "cpu", console=console)
    found = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert set(OF_EVERY_RUN) <= set(found)
    assert found["peak_pull"] == pytest.approx(50e-3, rel=0.01)
    assert found["slip_share"] > 0.99
    assert not {"rows_in_contact", "rows_at_highest"} & set(found)  # it has no rows
    assert found["dominant_frequency"] == pytest.approx(100.0, abs=0.5)
    # At 150 ms, when the pressure has fallen, it is on its way back from the tendon, where it was
    # for pi / omega; the row before and the one after are up to 2 ms away.
    (displacement,) = found["displacement_per_cycle"]
    assert displacement == pytest.approx(-50e-3 * (0.15 - 0.08 - np.pi / 100.0), rel=0.01)
    assert found["mean_speed"] == pytest.approx(displacement / 0.15, rel=1e-9)
    assert found["onset_pressure"] == found["end_pressure"] == [None]
