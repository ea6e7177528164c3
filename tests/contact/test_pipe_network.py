"""Pipes that branch: the gap of their union, places along them, and what kernels make of both."""

import numpy as np
import pytest

from softsim.contact.pipe_layout import Bend, Fork, Item, Straight, crossing, network_of_items
from softsim.contact.pipe_network import PipeNetwork
from tests.contact.test_network_obstacle import asking

LEFT, RIGHT = 0.0, np.pi
ARM = Straight(60e-3)


def tee(goes_on: bool, sides=("left",), to: float = 36e-3) -> Fork:
    """A fitting of 80 mm."""
    angles = {"left": LEFT, "right": RIGHT}
    return Fork(80e-3, {side: angles[side] for side in sides}, to, goes_on, 2e-3)


def network(kind: str, dimension: int = 2) -> PipeNetwork:
    """36 mm wide from (-60, 0) mm on: the fitting's middle lies at the origin. `aside`: a tee that
    goes on, with a branch to the left; `end`: a tee in which the pipe ends; `cross`: 30 mm wide to
    the sides.
    """
    ahead: list[Item] = [ARM]
    items: dict[str, list[Item]] = {
        "aside": [Straight(20e-3), tee(True), *ahead],
        "end": [Straight(20e-3), tee(False, ("left", "right"))],
        "cross": [Straight(20e-3), tee(True, ("left", "right"), 30e-3), *ahead],
    }
    branches = {"left": [ARM], "right": [ARM]} if kind != "aside" else {"left": [ARM]}
    start = np.array([-60e-3, 0.0, 0.0])[:dimension]
    return network_of_items("pipe", items[kind], branches, 36e-3, start, ())


KINDS = ["aside", "end", "cross"]


def places(dimension: int, count: int, seed: int) -> np.ndarray:
    """At random (count, d) within 45 mm of the fitting's middle, near the plane of the pipes."""
    x = np.random.default_rng(seed).uniform(-45e-3, 45e-3, (count, dimension))
    x[:, 2:] *= 0.5
    return x


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_the_gap_is_a_distance(kind, dimension):
    """Its slope is 1 everywhere but where two walls are equally near, and nowhere does it jump:
    between two places no more than their distance.
    """
    one, h = network(kind, dimension), 1e-7
    x = places(dimension, 4000, seed=1)
    steps = h * np.eye(dimension)
    slopes = np.stack([(one.gap(x + e) - one.gap(x - e)) / (2.0 * h) for e in steps], axis=1)
    size = np.linalg.norm(slopes, axis=1)
    assert (np.abs(size - 1.0) < 1e-6).mean() > 0.99
    gap, near = one.gap(x), x + 1e-3 * np.random.default_rng(2).standard_normal(x.shape)
    assert (np.abs(one.gap(near) - gap) <= np.linalg.norm(near - x, axis=1) + 1e-15).all()


@pytest.mark.parametrize("dimension", [2, 3])
def test_away_from_the_edge_it_is_that_of_the_bores(dimension):
    """Inside run and branch, in their walls, and beyond the exits, where the pipes go straight on;
    the arm that begins in the middle has no wall there.
    """
    one = network("end", dimension)
    x = np.array([[-50.0, 17.0], [-50.0, 19.0], [0.0, 90.0], [10.0, -50.0], [19.0, 0.0],
                  [0.0, 130.0], [17.0, -200.0]])  # fmt: skip
    places = np.zeros((len(x), dimension))
    places[:, :2] = 1e-3 * x
    expected = 1e-3 * np.array([1.0, -1.0, 18.0, 8.0, -1.0, 18.0, 1.0])
    np.testing.assert_allclose(one.gap(places), expected, rtol=0.0, atol=1e-13)


def test_corners_of_a_cross_are_alike():
    """Centres of the arcs are at (17, 20) mm: 15 mm and 18 mm and the fillet of 2 mm."""
    corners = np.array([[i * 17e-3, k * 20e-3] for i in (1.0, -1.0) for k in (1.0, -1.0)])
    towards = np.array([[-1.0, 0.0], [0.0, -1.0], [-np.sqrt(0.5)] * 2])
    for way in towards:
        x = corners - 1.5e-3 * np.sign(corners) * np.abs(way)
        np.testing.assert_allclose(network("cross").gap(x), -0.5e-3, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("dimension", [2, 3])
def test_places_along_the_branches(dimension):
    """Arc lengths go on from the pipe into both arms, from 60 mm on; beyond an exit too."""
    one = network("end", dimension)
    x = np.zeros((5, dimension))
    x[:, :2] = 1e-3 * np.array([[-70, 2], [-20, 5], [3, 30], [-2, -45], [0, 140]])
    branch, s = one.locate(x)
    assert [one.branches[b].path.name for b in branch] == ["pipe", "pipe", "left", "right", "left"]
    np.testing.assert_allclose(s, 1e-3 * np.array([-10, 40, 90, 105, 200]), atol=1e-15)
    ways = one.tangents(branch, s)[:, :2]
    expected = [[1, 0], [1, 0], [0, 1], [0, -1], [0, 1]]
    np.testing.assert_allclose(ways, expected, rtol=0.0, atol=1e-15)


def test_exits():
    assert network("aside").exits == {"end": 0, "left": 1}
    assert network("end").exits == {"left": 1, "right": 2}
    assert network("cross").exits == {"end": 0, "left": 1, "right": 2}
    closed = network_of_items("p", [tee(True), ARM], {"left": [ARM]}, 36e-3, np.zeros(2), {"left"})
    assert closed.exits == {"end": 0}
    assert closed.gap(np.array([[40e-3, 99e-3]]))[0] == pytest.approx(1e-3)


def test_branches_of_branches():
    """The way to the second one leaves the pipe at 40 mm, the first one 40 + 40 + 40 mm on."""
    second = Fork(80e-3, {"second": RIGHT}, 36e-3, True, 2e-3)
    branches = {"left": [second], "second": [ARM]}
    one = network_of_items("p", [tee(True)], branches, 36e-3, np.zeros(2), ())
    assert one.ways_to(2) == {2: np.inf, 1: pytest.approx(0.12), 0: pytest.approx(0.04)}
    branch, s = one.locate(np.array([[0.1, 0.08]]))
    assert (branch[0], s[0]) == (2, pytest.approx(0.18))


def test_branches_that_meet_again_cross():
    """An arm that turns back into the pipe that it has left; one that leads away does not."""
    back = [Bend(0.5 * np.pi, 40e-3, RIGHT), Bend(0.5 * np.pi, 40e-3, RIGHT), Straight(80e-3)]
    items = [Straight(20e-3), tee(True), Straight(150e-3)]
    one = network_of_items("p", items, {"left": back}, 36e-3, np.zeros(2), ())
    found = crossing(one)
    assert found is not None
    assert {found[0].item, found[1].item} <= {2, 4, 5}
    for kind in KINDS:
        assert crossing(network(kind)) is None


@pytest.mark.parametrize("dimension", [2, 3])
def test_kernels(fresh_taichi, dimension):
    """Gaps of numpy to round-off, of networks with one to three bores side by side, and unit
    normals that are the gradient of the gap.
    """
    from softsim.contact.pipe_network import NetworkObstacle

    walls = [network(kind, dimension) for kind in KINDS]
    x, h = places(dimension, 10_000, seed=4), 1e-7
    asked, gaps, normals = asking(NetworkObstacle(walls, x), x, len(walls))(x)
    assert asked.all()
    for one, gap, normal in zip(walls, gaps, normals, strict=True):
        np.testing.assert_allclose(gap, one.gap(x), rtol=0.0, atol=1e-13)
        steps = h * np.eye(dimension)
        slopes = np.stack([(one.gap(x + e) - one.gap(x - e)) / (2.0 * h) for e in steps], axis=1)
        assert (np.linalg.norm(slopes - normal, axis=1) < 1e-5).mean() > 0.99
        on_edges = np.any([j.holds(x) for j in one.junctions], axis=0) & (gap < 0.0)
        assert on_edges.sum() > 2
        np.testing.assert_allclose(normal[on_edges], slopes[on_edges], rtol=0.0, atol=1e-5)
        np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, rtol=1e-9)


@pytest.mark.parametrize("dimension", [2, 3])
def test_a_penalty_does_no_work_around_a_loop(fresh_taichi, dimension):
    """k g n along closed ways through the walls of an edge: k g^2 / 2 is its potential, so the work
    is what the trapezoidal rule leaves of it.
    """
    from softsim.contact.pipe_network import NetworkObstacle

    one = network("aside", dimension)
    turn = np.linspace(0.0, 2.0 * np.pi, 20_001)
    x = np.zeros((len(turn), dimension))
    x[:, 0] = 18.3e-3 + 1.2e-3 * np.cos(turn)
    x[:, 1] = 18.3e-3 + 1.2e-3 * np.sin(turn)
    x[:, 2:] = 2e-3 + 0.5e-3 * np.sin(2.0 * turn[:, None])
    _, (gap,), (normal,) = asking(NetworkObstacle([one], x), x, 1)(x)
    force = 1e3 * np.minimum(gap, 0.0)[:, None] * -normal
    power = (0.5 * (force[1:] + force[:-1]) * np.diff(x, axis=0)).sum(axis=1)
    assert np.abs(power).sum() > 1e-4
    assert abs(power.sum()) < 1e-6 * np.abs(power).sum()


def test_the_drawn_wall_lies_on_the_wall():
    """With its corners; the middles of its pieces are half a millimetre off at most."""
    for dimension, name in ((2, "wall_lines"), (3, "wall_faces")):
        for kind in KINDS:
            one = network(kind, dimension)
            pieces = one.drawn()[name]
            assert np.abs(one.gap(pieces.reshape(-1, dimension))).max() < 1e-9
            assert np.abs(one.gap(pieces.mean(axis=1))).max() < 0.5e-3
