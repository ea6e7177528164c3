"""Walls along polylines in kernels: gap and normal, against numpy and by differences."""

import numpy as np
import pytest
import taichi as ti

from softsim.compute import fields
from softsim.contact import terrain
from softsim.contact.polyline import MOST_CELLS, RIM, PolylineWall, cells_of
from softsim.contact.terrain import checked_polyline

GROUND = np.array([[0, 0], [10, 0], [9, 4], [16, 4], [17, 1], [18, 4], [30, 6]]) * 1e-3
STEP = np.array([[-10, 0], [0, 0], [0, -5], [10, -5]]) * 1e-3


def ground(across=None):
    return PolylineWall("ground", checked_polyline(GROUND, False), across)


def pipe():
    """A hollow of many edges, in the plane."""
    turn = 2.0 * np.pi * np.arange(150)[:, None] / 150
    points = 10e-3 * np.hstack([np.cos(turn), np.sin(turn)])
    return PolylineWall("pipe", checked_polyline(points, True), None)


def printed():
    """Corners closer to each other than cells are wide."""
    points = terrain.layered(terrain.half_round(20e-3), 0.15e-3)
    line = checked_polyline(terrain.on_ground(points, np.zeros(2), 0.2), False)
    return PolylineWall("printed", line, None)


def look(walls, scenario, places):
    """Gaps (n,) and normals (n, d) that contact computes."""
    from softsim.compute.fields import real_field, vector_field

    obstacle = walls[0].obstacle(walls, places)
    x = vector_field(places)
    gaps, normals = real_field(np.zeros(len(places))), vector_field(np.zeros(places.shape))

    @ti.kernel
    def each():
        for i in gaps:
            gap, n = obstacle.gap_and_normal(scenario, i, 0, x[i])
            gaps[i] = gap
            normals[i] = n

    each()
    return fields.read(gaps), fields.read(normals)


def scattered(wall, share, count=4000):
    """Places over the cells, and beyond them by a share of their extent."""
    cells = wall.cells
    extent = cells.size * cells.shape
    rng = np.random.default_rng(7)
    return cells.origin + extent * rng.uniform(-share, 1.0 + share, (count, 2))


@pytest.mark.parametrize("made", [ground, pipe, printed])
def test_gap_is_exact_and_its_gradient_the_normal(fresh_taichi, made):
    """Everywhere in the cells. Central differences over 1 nm, where no other edge gets nearer."""
    wall = made()
    (name,) = wall.names
    x = scattered(wall, 0.0)
    gaps, normals = look([wall], 0, x)
    np.testing.assert_allclose(gaps, wall.gaps(x)[name], rtol=1e-12, atol=1e-16)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-12)
    h = 1e-9
    slopes = [
        (wall.gaps(x + h * e)[name] - wall.gaps(x - h * e)[name]) / (2 * h) for e in np.eye(2)
    ]
    gradient = np.stack(slopes, axis=1)
    smooth = np.abs(np.linalg.norm(gradient, axis=1) - 1.0) < 1e-7
    assert smooth.mean() > 0.99
    np.testing.assert_allclose(normals[smooth], gradient[smooth], atol=2e-6)


def test_beyond_the_cells_lines_go_on_and_free_remains_free(fresh_taichi):
    wall = ground()
    x = scattered(wall, 3.0)
    gaps, _ = look([wall], 0, x)
    exact = wall.gaps(x)["ground"]
    assert np.array_equal(gaps < 0.0, exact < 0.0)
    line = wall.polyline
    behind = (x - line.points[-1]) @ line.directions[-1]
    near = (behind > 0.0) & (np.abs(exact) < 0.3 * behind)
    assert near.sum() > 50
    np.testing.assert_allclose(gaps[near], exact[near], atol=1e-16)


@pytest.mark.parametrize("made", [ground, pipe, printed])
def test_no_node_in_the_wall_is_passed_over(fresh_taichi, made):
    """Asked again and again, while it comes and goes; most that are far off are."""
    wall = made()
    x = np.concatenate([scattered(wall, 0.1), scattered(wall, 3.0)])
    obstacle, asked = wall.obstacle([wall], x), fields.index_field(np.zeros(len(x)))
    place = fields.vector_field(x)

    @ti.kernel
    def each():
        for i in asked:
            asked[i] = obstacle.may_touch(0, i, place[i], 0.0)

    each()
    assert fields.read(asked).all()  # nothing was known of them
    each()
    gap = wall.gaps(x)[wall.name]
    assert fields.read(asked)[gap <= 0.0].all()
    free = gap > 3.0 * wall.cells.size
    assert fields.read(asked)[free].mean() < 0.2


def test_normals_at_corners(fresh_taichi):
    """Outside a convex corner from it to the place; behind a concave one back to it: the springs of
    both edges; behind a convex one that of the nearer edge.
    """
    step = PolylineWall("step", checked_polyline(STEP, False), None)
    places = 1e-6 * np.array([[3, 4], [-3, -5004], [-2, -1], [-1, -2]])
    gaps, normals = look([step], 0, places)
    np.testing.assert_allclose(gaps, [5e-6, -5e-6, -1e-6, -1e-6], atol=1e-17)
    expected = [[0.6, 0.8], [0.6, 0.8], [0.0, 1.0], [1.0, 0.0]]
    np.testing.assert_allclose(normals, expected, atol=1e-9)


def test_in_space_it_is_the_same_at_every_z(fresh_taichi):
    x = scattered(ground(), 0.5)
    z = np.linspace(-1.0, 1.0, len(x))
    gaps, normals = look([ground()], 0, x)
    found, of_space = look([ground((0.0, 0.1))], 0, np.column_stack([x, z]))
    assert np.array_equal(found, gaps)
    assert np.array_equal(of_space, np.column_stack([normals, 0.0 * z]))


def test_scenarios_share_a_line_or_have_their_own(fresh_taichi):
    """Of other extents, too."""
    walls = [ground(), PolylineWall("step", checked_polyline(STEP, False), None), ground()]
    assert len(fields.read(walls[0].obstacle(walls, GROUND).start)) == 6 + 3
    x = np.random.default_rng(3).uniform([-9e-3, -6e-3], [29e-3, 7e-3], (400, 2))
    for scenario, wall in enumerate(walls):
        gaps, _ = look(walls, scenario, x)
        near = np.abs(wall.gaps(x)[wall.name]) < RIM * wall.cells.size
        assert near.sum() > 10
        np.testing.assert_allclose(gaps[near], wall.gaps(x[near])[wall.name], atol=1e-16)


def test_a_lost_node_reads_nothing_outside_the_tables(fresh_taichi):
    """A run that fails goes on with NaN until a guard reads it: that must not end the process."""
    places = np.full((3, 2), np.nan)
    places[1], places[2, 0] = np.inf, 0.0
    _, normals = look([ground()], 0, places)
    assert np.isfinite(normals[2]).all()


@pytest.mark.physics
def test_lists_are_short():
    """As many edges as there are get into a cell's list only where the wall is fine."""
    for wall in (ground(), pipe(), printed()):
        cells = cells_of(wall.polyline)
        assert np.prod(cells.shape) <= MOST_CELLS
        assert len(cells.begin) == np.prod(cells.shape) + 1
        assert len(cells.edge) < 20 * np.prod(cells.shape)
        places = scattered(wall, 0.0)
        index = np.floor((places - cells.origin) / cells.size).astype(int)
        number = np.ravel_multi_index(tuple(index.T), tuple(cells.shape))
        assert (wall.gaps(places)[wall.name] >= cells.clearance[number]).all()


@pytest.mark.parametrize("across", [None, (-5e-3, 5e-3)])
def test_the_picture_is_the_line_with_its_free_side(across):
    (pieces,) = ground(across).drawn().values()
    np.testing.assert_allclose(pieces[1:, 0, :2], GROUND[1:-1])
    assert pieces[0, ..., 0].min() < 0.0 and pieces[-1, ..., 0].max() > 30e-3  # past both ends
    if across is not None:
        normal = np.cross(pieces[:, 2] - pieces[:, 0], pieces[:, 3] - pieces[:, 1])
        expected = ground().polyline.normals
        np.testing.assert_allclose(
            normal / np.linalg.norm(normal, axis=1)[:, None],
            np.column_stack([expected, np.zeros(6)]), atol=1e-12,
        )  # fmt: skip
