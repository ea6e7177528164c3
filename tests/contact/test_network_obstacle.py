"""What kernels compute of a pipe along a path, against the gap in numpy."""

import numpy as np
import pytest

from softsim.compute import fields
from softsim.contact.pipe_network import PipeNetwork
from tests.contact.pipe_layouts import layout, places_around


def asking(obstacle, places, scenarios):
    """A function of places (n, d) where nodes are now: whether they may touch (scenarios, n), gaps
    (scenarios, n) and normals (scenarios, n, d).
    """
    import taichi as ti

    from softsim.compute.fields import index_field, real_field, vector_field

    x = vector_field(places)
    asked = index_field(np.zeros((scenarios, len(places))))
    gaps = real_field(np.zeros((scenarios, len(places))))
    normals = vector_field(np.zeros((scenarios, *places.shape)))

    @ti.kernel
    def look():
        for s, i in gaps:
            asked[s, i] = obstacle.may_touch(s, i, x[i], 0.0)
            gap, n = obstacle.gap_and_normal(s, i, 0, x[i])
            gaps[s, i] = gap
            normals[s, i] = n

    def ask(now):
        fields.write(x, now)
        look()
        return fields.read(asked).astype(bool), fields.read(gaps), fields.read(normals)

    return ask


@pytest.mark.parametrize("dimension", [2, 3])
def test_gap_and_normal(fresh_taichi, dimension):
    """The gap of numpy to round-off (1e-16 of the face's 100 m), and its gradient as normal but
    where two walls are equally near. Side by side in both ways to close the ends; the nodes start
    where they are.
    """
    from softsim.contact.pipe_network import NetworkObstacle

    paths = [layout(dimension, (False, True)), layout(dimension, (True, False))]
    x = places_around(paths[0], 2000, 2e-3, seed=6)
    asked, gaps, normals = asking(
        NetworkObstacle([PipeNetwork.of_one(path) for path in paths], x), x, 2
    )(x)
    assert asked.all()
    h = 1e-7
    for path, gap, normal in zip(paths, gaps, normals, strict=True):
        exact = path.gap(x)
        assert (exact < 0.0).sum() > 100
        np.testing.assert_allclose(gap, exact, rtol=0.0, atol=1e-13)
        steps = h * np.eye(dimension)
        gradient = np.stack([(path.gap(x + e) - path.gap(x - e)) / (2.0 * h) for e in steps], 1)
        # (h / radius of curvature)^2 and round-off of 1e-14 / 1e-7; at corners they differ.
        alike = np.linalg.norm(gradient - normal, axis=1) < 1e-5
        assert alike.mean() > 0.99
        np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
def test_nodes_are_followed_through_the_whole_path(fresh_taichi, dimension):
    """From before the start into the wall of any segment at once: they pass every joint on their
    way, and back again.
    """
    from softsim.contact.pipe_network import NetworkObstacle

    path = layout(dimension)
    x = places_around(path, 2000, 2e-3, seed=7)
    x = x[path.gap(x) < 0.0]
    start = np.tile(path.axis_place(np.array([-1e-3]))[0], (len(x), 1))
    obstacle = NetworkObstacle([PipeNetwork.of_one(path)], start)
    assert set(fields.read(obstacle.near).ravel()) == {0}
    ask = asking(obstacle, start, 1)
    ask(x)
    beside = path.beside(*path.coordinates(x)[:2])
    assert len(np.unique(beside)) > len(path.segments)
    np.testing.assert_array_equal(fields.read(obstacle.near)[0, :, 0], beside)
    ask(start)
    assert set(fields.read(obstacle.near).ravel()) == {0}


def test_scenarios_of_other_lengths(fresh_taichi):
    """Paths of another number of segments side by side: each has its own."""
    from softsim.contact.pipe_layout import Straight, path_of_items
    from softsim.contact.pipe_network import NetworkObstacle

    short = path_of_items("pipe", [Straight(0.01)], 0.03, np.zeros(2), (True, True))
    paths = [layout(2), short]
    x = np.array([[5e-3, 14e-3], [5e-3, 15.5e-3], [12e-3, 2e-3]])
    _, gaps, _ = asking(NetworkObstacle([PipeNetwork.of_one(path) for path in paths], x), x, 2)(x)
    np.testing.assert_allclose(gaps[1, 1:], [-0.5e-3, -2e-3], rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(gaps[0, :2], paths[0].gap(x[:2]), rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("dimension", [2, 3])
def test_nodes_that_cannot_touch_are_not_asked(fresh_taichi, dimension):
    """While they wander about at random, up to a tenth of a millimetre a step: every node in the
    wall is asked, and once more when it is out again; of those a millimetre from it few are.
    """
    from softsim.contact.pipe_network import NetworkObstacle

    path = layout(dimension)
    x = places_around(path, 300, 0.2e-3, seed=8)
    obstacle = NetworkObstacle([PipeNetwork.of_one(path)], x)
    ask = asking(obstacle, x, 1)
    ask(x)
    generator = np.random.default_rng(9)
    was_inside, spared = path.gap(x) < 0.0, []
    for _ in range(30):
        x = x + 0.1e-3 * generator.uniform(-1.0, 1.0, x.shape) / np.sqrt(dimension)
        asked = ask(x)[0][0]
        gap = path.gap(x)
        assert np.all(asked[(gap < 0.0) | was_inside])
        spared.append(np.mean(~asked[gap > 1e-3]))
        was_inside = gap < 0.0
    assert np.mean(spared) > 0.99
