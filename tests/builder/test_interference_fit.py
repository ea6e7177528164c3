"""Walls that start inside bodies and close on them while bodies settle."""

import numpy as np
import pytest

from softsim.contact.wall import FittedWall
from softsim.errors import SceneError

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 8 mm, height: 4 mm, element_size: 2 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10,
      position: [0 mm, -1.9 mm]}
environment:
  gravity: 0 m/s^2
  walls: {pipe: {kind: pipe, diameter: 3 mm}, floor: {kind: plane, point: [0 mm, -9 mm]}}
contact: {interference_fit: [pipe]}
time: {settle: 0.2 s, end: 1 s}
"""


def test_each_side_of_a_pipe_recedes_by_its_own_overlap(build):
    """0.6 mm above, 0.4 mm below; the floor, far away, stays where it is."""
    model = build(SCENE)
    [wall] = model.walls
    assert isinstance(wall, FittedWall)
    overlaps = dict(zip(wall.names, wall.overlap, strict=True))
    assert overlaps == pytest.approx({"pipe.top": 0.6e-3, "pipe.bottom": 0.4e-3, "floor": 0.0})
    gaps = wall.gaps(model.points)
    assert [gaps[name].min() for name in wall.names[:2]] == pytest.approx([0.0, 0.0], abs=1e-12)
    # It closes in the first half of the settling time, before which nothing counts as settled.
    assert (wall.begin, wall.duration) == (-0.2, 0.1)
    assert model.settling.shortest == 0.1
    assert wall.thickness() == wall.wall.thickness()
    assert (wall.least_gap(model.points) <= np.min(list(gaps.values()), axis=0)).all()


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("contact: {interference_fit: [pipe]}", "", "contact.interference_fit: \\[pipe\\]"),
        ("[pipe]}", "[tube]}", "there is no wall 'tube'"),
        ("settle: 0.2 s, ", "", "does not settle before t = 0"),
        ("settle: 0.2 s, ", "settle: 0.2 s, procedure: static, ", "does not settle before t = 0"),
        ("{kind: pipe, diameter: 3 mm}",
         "{kind: ramp, foot: [0 mm, 0 mm], slope: 30 deg, height: 5 mm, plateau: 5 mm}",
         "has corners"),
    ],
)  # fmt: skip
def test_an_overlap_is_refused_where_no_wall_can_close(build, old, new, problem):
    with pytest.raises(SceneError, match=problem):
        build(SCENE.replace(old, new))
