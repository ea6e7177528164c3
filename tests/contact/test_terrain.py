"""Terrain of a scene: shapes of walls, what is asked of a body before them, what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from softsim.analysis.catalogue import VERDICTS
from softsim.analysis.passage import CrossingCondition, crossing_report
from softsim.contact import terrain
from softsim.errors import MeshError, SceneError
from softsim.output.stop_conditions import see_history
from softsim.scene.measures import Part

SCENE = """\
bodies:
  b: {mesh: {generator: block, length: 20 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 1 mm, material: dragon_skin_10}
environment:
  walls:
    ground: {kind: ramp, slope: 45 deg, height: 5 mm, plateau: 30 mm, foot: [20 mm, 0 mm]}
crossing: {}
time: {end: 1 s}
"""
OTHERS = {
    "step": "{kind: ramp, slope: 90 deg, height: 5 mm, foot: [20 mm, 0 mm]}",
    "round": "{kind: semicircle, radius: 5 mm, foot: [20 mm, 0 mm]}",
    "printed": "{kind: semicircle, radius: 5 mm, layers: 0.5 mm, foot: [20 mm, 0 mm]}",
    "field": "{kind: step_field, rugosity: 0.185, foot: [20 mm, 0 mm]}",
}


def heights(wall, x):
    """Where the gap is zero above the places x [m]."""
    y = np.linspace(-2e-3, 12e-3, 1401)
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    (gap,) = wall.gaps(places.reshape(-1, 2)).values()
    return y[np.argmax(gap.reshape(len(x), -1) > 0.0, axis=1)]


def test_a_ramp_goes_up_along_and_down(build):
    model = build(SCENE)
    x = 1e-3 * np.array([0.0, 22.5, 40.0, 54.0, 56.0, 90.0])
    found = heights(model.walls[0], x)
    assert found == pytest.approx(1e-3 * np.array([0.0, 2.5, 5.0, 5.0, 0.0, 0.0]), abs=5e-5)
    assert (model.crossing.goal, model.crossing.foot) == pytest.approx((25e-3, 20e-3))


@pytest.mark.parametrize(
    ("kind", "goal", "place", "height"),
    [
        ("step", 20.0, 20.5, 5.0),
        ("round", 30.0, 22.0, 4.0),
        ("printed", 30.0, 25.0, 5.0),
        ("field", 720.0, 721.0, 0.0),
    ],
)
def test_other_shapes(build, kind, goal, place, height):
    model = build(SCENE, f"environment.walls.ground={OTHERS[kind]}")
    assert model.crossing.goal == pytest.approx(1e-3 * goal)
    found = heights(model.walls[0], np.array([1e-3 * place]))
    assert found == pytest.approx([1e-3 * height], abs=1e-4)


@pytest.mark.parametrize("slope", [30.0, 60.0, 90.0])
def test_corners_are_sharp(slope):
    """Wherever they lie: along both edges up to a corner nothing is off."""
    rng = np.random.default_rng(1)
    for _ in range(5):
        before, foot, more = rng.uniform(0.0, 0.25e-3, 3)
        points = terrain.ramp(np.radians(slope), 10e-3 + more, 50e-3)
        ground = terrain.on_ground(points, np.array([foot, 0.0]), 20e-3 + before)
        line = terrain.checked_polyline(ground, False)
        away = np.linspace(0.0, 1.5e-3, 121)[:, None]
        for corner in (1, 2):
            back, on = line.directions[corner - 1], line.directions[corner]
            along = np.stack([ground[corner] - away * back, ground[corner] + away * on])
            assert np.abs(line.gaps(along.reshape(-1, 2))).max() < 1e-16


def test_a_ramp_in_space_is_the_same_at_every_z(build):
    model = build(
        SCENE.replace(
            "generator: block, length: 20 mm", "generator: box, width: 3 mm, length: 20 mm"
        ).replace("formulation: plane_strain, thickness: 1 mm", "formulation: solid")
    )
    x = np.array([[22.5, 2.6, 0.0], [22.5, 2.6, 9.0], [40.0, 4.0, -9.0]]) * 1e-3
    height = 0.1e-3 * np.sqrt(0.5)
    (gap,) = model.walls[0].gaps(x).values()
    assert gap == pytest.approx([height, height, -1e-3])
    (faces,) = model.walls[0].drawn().values()
    assert faces[..., 2].min() < 0.0 and faces[..., 2].max() > 3e-3


def test_layers_are_level_and_upright():
    points = terrain.layered(terrain.half_round(5e-3), 0.5e-3)
    steps = np.diff(points, axis=0)
    assert ((steps == 0.0).sum(axis=1) == 1).all()
    assert points[:, 1].max() == pytest.approx(5e-3)


@pytest.mark.parametrize(("rugosity", "mean"), [(0.185, 4.66), (0.284, 5.17)])
def test_fields_are_as_rough_as_they_say(rugosity, mean):
    """The thesis's two: whole millimetres, a shuffle a seed."""
    fields = [terrain.step_heights(rugosity, mean, 70, seed) for seed in (1, 2)]
    for drawn in fields:
        assert drawn.mean() == pytest.approx(mean, abs=0.02)
        assert drawn.std() / 8.0 == pytest.approx(rugosity, abs=0.0025)
        assert ((drawn == drawn.round()) & (drawn >= 1) & (drawn <= 8)).all()
    assert (fields[0] != fields[1]).any()
    with pytest.raises(MeshError, match="include none with a mean of"):
        terrain.step_heights(1.0, 4.66, 70, 1)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("environment.walls.ground.slope=95 deg", "greater than 0 and at most 90 deg"),
        ("environment.walls.ground.plateau=4 mm", "4 mm is less than the height of the ramp, 5 mm"),
        ("environment.walls.ground.foot=[0 mm, 0 mm]", "inside the body"),
        (
            f"environment.walls.ground={OTHERS['field'].replace('0.185', '2')}",
            "random fields of 70 blocks",
        ),
        ("environment.walls.ground={kind: plane}", "the goal is unknown"),
        ("crossing.body=c", "there is no body 'c'"),
        ("crossing.goal=-30 mm", "starts beyond the goal at x = -30 mm"),
    ],
)
def test_what_makes_no_terrain_is_refused(build, override, message):
    with pytest.raises(SceneError) as caught:
        build(SCENE, override)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("rear", "verdict", "sentence"),
    [
        ([0.0, 10.0, 20.0, 26.0, 27.0], "passed", "passed at 3 s"),
        ([0.0, 8.0, 12.0, 4.0, 3.0], "stuck", "slipped back by 9 mm"),
        ([0.0, 2.0, 4.0, 6.0, 8.0], "stuck", "still moving at the end time"),
        ([0.0, 5.0, 9.0, 9.0, 9.0], "stuck", "stands still at the obstacle"),
        (
            [-30.0, -29.0, -29.0, -29.0, -29.0],
            "stuck",
            "stands still before the obstacle, without thrust",
        ),
    ],
)
def test_verdicts_say_why(build, rear, verdict, sentence):
    crossing = build(SCENE).crossing
    rear = 1e-3 * np.array(rear)
    history = {"time": np.arange(5.0), "rear_x": rear, "front_x": rear + 20e-3}
    report = crossing_report(crossing, history)
    assert (report["verdict"], report["passed"]) == (verdict, float(verdict == "passed"))
    assert sentence in report["sentence"]
    assert {f"crossing.{name}" for name in report} == set(VERDICTS[Part.CROSSING])
    assert seen(CrossingCondition(crossing), history).is_over == (verdict == "passed")
    impatient = seen(CrossingCondition(replace(crossing, patience=1.5)), history)
    assert impatient.is_over == (sentence != "still moving at the end time")


def seen(condition, history):
    see_history([condition], history)
    return condition


REFUSED = {
    "one point": ([[0, 0]], False, "1 different points: at least 2"),
    "a closed line": ([[0, 0], [1, 0], [0, 0]], True, "2 different points: at least 3"),
    "twice the same": ([[0, 0], [1, 0], [1, 0], [2, 0]], False, "points 1 and 2 .* are the same"),
    "crossing": (
        [[0, 0], [10, 0], [10, 10], [4, -5]], False,
        r"edges 0 and 2 .*counted from 0, at \(6000, 0\) mm",
    ),
    "touching": ([[0, 0], [10, 0], [10, 5], [5, 0], [5, 9]], False, "edges 0 and 2"),
    "folding back": ([[0, 0], [10, 0], [5, 0]], False, "edges 0 and 1"),
    "along itself": ([[0, 0], [10, 0], [10, 1], [4, 1], [4, 0], [6, 0]], False, "edges 0 and [34]"),
    "a bow": ([[0, 0], [1, 1], [1, 0], [0, 1]], True, "edges 0 and 2,"),
    "ends that cross": ([[0, 1], [1, 1.5], [1, 0], [0, 0.1]], False, "extended straight"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_wall(case):
    points, closed, message = REFUSED[case]
    with pytest.raises(MeshError, match=message):
        terrain.checked_polyline(np.array(points, dtype=float), closed)


def test_crossings_are_found_among_many_edges():
    """A closed star of 3,000 edges has none; with two of its corners exchanged it has one there."""
    turn = 2.0 * np.pi * np.arange(3000)[:, None] / 3000
    star = (5.0 + np.sin(70.0 * turn)) * np.hstack([np.cos(turn), np.sin(turn)])
    assert len(terrain.checked_polyline(star, True).points) == 3000
    star[[1500, 1501]] = star[[1501, 1500]]
    with pytest.raises(MeshError, match="edges 1499 and 1501,"):
        terrain.checked_polyline(star, True)
