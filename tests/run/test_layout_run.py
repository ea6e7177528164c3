"""Runs along a pipe: they end when the question is answered, the same after an interruption."""

from functools import partial

import numpy as np
import pytest
from batches import finished

# A block that nothing touches stands before the pipe; a ball inside is pushed along it.
SCENE = """
bodies:
  block: {mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm},
          formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10,
          position: [-50 mm, 0 mm], fixed: [bottom]}
rigid_bodies:
  ball: {mass: 1 g, inertia: 1 g*mm^2, center: [20 mm, 0 mm], outline: {radius: 5 mm}}
environment:
  gravity: 0 m/s^2
  walls:
    pipe: {kind: pipe_path, diameter: 20 mm,
           pipe: [{straight: 50 mm}, {bend: 30 deg, radius: 40 mm}, {straight: 60 mm}]}
contact: {friction_coefficient: 0}
loads: {push: {kind: rigid_force, acts_on: ball, force: [10 mN, 0 mN]}}
layout: {goal: 40 mm, patience_time: 30 ms, least_progress: 1 mm}
time: {end: 1 s}
output: {frame_interval: 20 ms}
"""


@pytest.fixture
def batch(batch_of):
    """A batch of one, the scene in a folder of that name."""
    return partial(batch_of, SCENE)


def test_a_pushed_ball_passes_and_the_run_ends(batch):
    """20 mm at 10 m/s^2: 63 ms, and the row after it, up to 2 ms later."""
    results = finished(batch("pushed", "expect.passes=true"))
    layout = results.summary["layout"]
    assert (results.summary["status"], layout["verdict"]) == ("done", "passed")
    assert results.summary["ended_by"] == "layout"
    exact = np.sqrt(2.0 * 0.02 / 10.0)
    assert exact <= results.summary["simulated_time"] <= exact + 2.1e-3
    s = results.history["arc_length"]
    assert s[0] == pytest.approx(0.02, abs=1e-12)
    assert s == pytest.approx(results.history["frame_x"], abs=1e-12)  # straight so far
    # The block is far away; the ball is 5 mm wide in a pipe of 10 mm radius.
    assert results.history["clearance"] == pytest.approx(5e-3, abs=1e-12)
    assert layout["segments"][0]["mean_speed"] == pytest.approx(0.02 / exact, rel=0.04)


def test_a_ball_that_is_not_pushed_is_stuck(batch):
    from softsim.errors import ExpectationError

    idle = batch("idle", "loads.push.force=[0 mN, 0 mN]", "expect.passes=true")
    with pytest.raises(
        ExpectationError, match="verdict passed, found stuck in segment 1"
    ) as caught:
        finished(idle)
    assert caught.value.exit_code == 5
    summary = idle.runs[0].files.summary
    assert summary["layout"]["blocked_by"] == "no thrust"
    assert summary["simulated_time"] == pytest.approx(30e-3, abs=2.1e-3)


def test_a_frame_too_long_for_a_bend_is_wedged(batch):
    """The longest rectangle of height W that a bend of radius R in a pipe of diameter D takes has
    (R - D/2 + W)^2 + (L/2)^2 = (R + D/2)^2; this one is 3 % longer. Its corners lack 0.8 mm, the
    work of the force over the way presses them in by sqrt(2 E / k), a third of a millimetre.
    """
    from softsim.errors import ExpectationError

    longest = 2.0 * np.sqrt(55.0**2 - 40.0**2)  # mm: R 40, D 30, W 15
    pipe = "[{straight: 90 mm}, {bend: 90 deg, radius: 40 mm}, {straight: 100 mm}]"
    outline = f"{{length: {1.03 * longest:.6g} mm, height: 15 mm}}"
    wedged = batch(
        "wedged",
        f"environment.walls.pipe.pipe={pipe}",
        "environment.walls.pipe.diameter=30 mm",
        f"rigid_bodies.ball.outline={outline}",
        "rigid_bodies.ball.center=[45 mm, 0 mm]",
        "rigid_bodies.ball.mass=10 g",
        "rigid_bodies.ball.inertia=5 kg*mm^2",
        "loads.push.force=[5 mN, 5 mN]",
        "contact.penalty_stiffness=10 kN/m",
        "contact.damping_ratio=0.1",
        "layout={patience_time: 300 ms}",
        "time.end=3 s",
        "expect.passes=true",
    )
    with pytest.raises(ExpectationError, match="frame wedged"):
        finished(wedged)
    layout = wedged.runs[0].files.summary["layout"]
    assert (layout["where"]["segment"], layout["blocked_by"]) == (2, "frame wedged")


def test_a_wall_pushes_across_the_path(batch):
    """Around the bend the ball leans on its outer wall, on that side alone."""
    results = finished(batch("round", "layout.goal=70 mm"))
    h = results.history
    leaning = h["frame_wall_force"] > 0.0
    assert leaning.any()
    assert h["arc_length"][leaning].min() > 0.05
    # Without friction the wall pushes across the path only, but for the turn of the path within
    # the interval of a row, over which forces are averaged.
    turn = np.diff(h["arc_length"], prepend=0.02) / 0.04
    along = np.maximum(h["thrust"], h["drag"])
    assert (along <= h["frame_wall_force"] * (turn + 0.05)).all()
    # All of it on one side, so that nothing cancels out but for the same turn.
    assert (h["frame_pinch"] <= h["frame_wall_force"] * (turn**2 + 1e-3)).all()


def test_an_interrupted_run_decides_alike(batch):
    whole = finished(batch("whole", "layout.goal=30 mm"))
    first = batch("parts", "layout.goal=30 mm")
    first.act()
    while first.solver.time < 0.02:
        first.do_blocks()
    first.checkpoint()
    first.close()
    second = finished(batch("parts", "layout.goal=30 mm", resume=True))
    assert second.summary["layout"] == whole.summary["layout"]
    for name, column in whole.history.items():
        np.testing.assert_array_equal(second.history[name], column, err_msg=name)
