"""What kernels compute of a pipe along a path, against the gap in numpy."""

import numpy as np
import pytest

from tests.contact.pipe_layouts import layout, places_around


def contact_readings(obstacle, places, scenarios):
    """Gaps (scenarios, n) and normals (scenarios, n, d) after following nodes to places (n, d)."""
    import taichi as ti

    from softsim.fields import real_field, vector_field

    count = len(places)
    x = vector_field(places)
    gaps = real_field(np.zeros((scenarios, count)))
    normals = vector_field(np.zeros((scenarios, *places.shape)))

    @ti.kernel
    def look():
        for s, i in gaps:
            obstacle.follow(s, i, x[i])
            gap, n = obstacle.gap_and_normal(s, i, 0, x[i])
            gaps[s, i] = gap
            normals[s, i] = n

    look()
    return gaps.to_numpy(), normals.to_numpy()


@pytest.mark.parametrize("dimension", [2, 3])
def test_gap_and_normal(cpu, dimension):
    """In the wall the gap of numpy to round-off (1e-16 of the face's 100 m) and its gradient as
    normal, but where two walls are equally near; in free space a positive number. Side by side in
    both ways to close the ends; the nodes start where they are.
    """
    from softsim.contact.path_obstacle import PathObstacle

    paths = [layout(dimension, (False, True)), layout(dimension, (True, False))]
    x = places_around(paths[0], 2000, 2e-3, seed=6)
    gaps, normals = contact_readings(PathObstacle(paths, x), x, 2)
    h = 1e-7
    for path, gap, normal in zip(paths, gaps, normals, strict=True):
        exact = path.gap(x)
        inside = exact < 0.0
        assert inside.sum() > 100
        np.testing.assert_array_equal(gap < 0.0, inside)
        np.testing.assert_allclose(gap[inside], exact[inside], rtol=0.0, atol=1e-13)
        assert np.all(gap[~inside] >= exact[~inside] - 1e-13)
        steps = h * np.eye(dimension)
        gradient = np.stack([(path.gap(x + e) - path.gap(x - e)) / (2.0 * h) for e in steps], 1)
        # (h / radius of curvature)^2 and round-off of 1e-14 / 1e-7; at corners they differ.
        alike = np.linalg.norm(gradient - normal, axis=1)[inside] < 1e-5
        assert alike.mean() > 0.98
        np.testing.assert_allclose(np.linalg.norm(normal[inside], axis=1), 1.0, rtol=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
def test_nodes_are_followed_through_the_whole_path(cpu, dimension):
    """From before the start to beyond the end at once: they pass every joint on their way, and
    back again.
    """
    from softsim.contact.path_obstacle import PathObstacle

    path = layout(dimension)
    x = places_around(path, 500, -1e-3, seed=7)
    start = np.tile(path.axis_place(np.array([-1e-3]))[0], (500, 1))
    obstacle = PathObstacle([path], start)
    assert set(obstacle.near.to_numpy().ravel()) == {0}
    contact_readings(obstacle, x, 1)
    nearest, along, _ = path.coordinates(x)
    np.testing.assert_array_equal(obstacle.near.to_numpy()[0], path.beside(nearest, along))
    contact_readings(obstacle, start, 1)
    assert set(obstacle.near.to_numpy().ravel()) == {0}


def test_scenarios_of_other_lengths(cpu):
    """Paths of another number of segments side by side: each has its own."""
    from softsim.contact.laying import Straight, laid
    from softsim.contact.path_obstacle import PathObstacle

    short = laid("pipe", [Straight(0.01)], 0.03, np.zeros(2), (True, True))
    paths = [layout(2), short]
    x = np.array([[5e-3, 14e-3], [5e-3, 15.5e-3], [12e-3, 2e-3]])
    gaps, _ = contact_readings(PathObstacle(paths, x), x, 2)
    np.testing.assert_allclose(gaps[1, 1:], [-0.5e-3, -2e-3], rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(gaps[0, :2], paths[0].gap(x[:2]), rtol=0.0, atol=1e-13)
