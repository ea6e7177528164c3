"""Groups of nodes and the inertia of motion within them, by hand."""

import numpy as np
import pytest

from softsim.compute.mass_scaling import MassScaling, edges_of, grouped

MASS = np.array([1.0, 3.0, 2.0, 5.0])
SCALING = MassScaling(np.array([0, 0, -1, 0]), 1, 4.0)


def test_inertia_is_scaled_about_the_mean_of_a_group():
    """M' v by its definition; nodes of no group and of no mass have their own."""
    mass = np.append(MASS, 0.0)
    scaling = MassScaling(np.append(SCALING.group, -1), 1, 4.0)
    v = np.random.default_rng(0).standard_normal((5, 2))
    mean = mass[[0, 1, 3]] @ v[[0, 1, 3]] / 9.0
    apart = np.where(scaling.group[:, None] >= 0, v - mean, 0.0)
    momentum = mass[:, None] * (v + 3.0 * apart)
    root = np.sqrt(mass)[:, None]
    found = root * (scaling.scaled(mass, 2, 1.0) @ (root * v).ravel()).reshape(v.shape)
    np.testing.assert_allclose(found, momentum, atol=1e-14)
    back = scaling.scaled(mass, 2, -0.5) @ (scaling.scaled(mass, 2, -0.5) @ found.ravel())
    there = scaling.scaled(mass, 2, -1.0) @ found.ravel()
    np.testing.assert_allclose(back, there, atol=1e-14)


def test_a_force_on_one_node_moves_it_by_its_own_and_the_groups_mass():
    """1/m' = 1/(factor m) + (1 - 1/factor) / sum m."""
    expected = (1.0 / (4.0 * MASS) + 0.75 / 9.0) * MASS
    expected[2] = 1.0
    np.testing.assert_allclose(SCALING.mobility(MASS), expected)


def test_added_turning_of_two_equal_masses_is_that_of_a_dumbbell():
    points = np.array([[0.0, 1.0], [0.0, -1.0], [3.0, 0.0], [-3.0, 0.0]])
    scaling = MassScaling(np.array([0, 0, -1, -1]), 1, 4.0)
    assert scaling.added_turning(points, np.ones(4)) == pytest.approx(3.0 * 2.0 / 20.0)


def wall(length, thickness):
    """Quadrilaterals of a wall one element thick: points, cells, facets of its surface."""
    x = np.linspace(0.0, length, 11)
    points = np.array([[a, y] for y in (0.0, thickness) for a in x])
    k = np.arange(10)
    cells = np.column_stack([k, k + 1, k + 12, k + 11])
    sides = np.concatenate([cells[:, :2], cells[:, 2:]])
    return points, cells, np.concatenate([sides, [[0, 11], [10, 21]]])


def test_a_wall_is_grouped_across_though_its_elements_are_shorter_along_it():
    """At its ends, where elements have a facet across, as elsewhere."""
    points, cells, facets = wall(7.0, 1.0)
    group, count = grouped(points, *edges_of(cells, facets), np.full(22, True), 1.1)
    inner = np.arange(1, 10)
    assert count >= 9
    np.testing.assert_array_equal(group[inner], group[inner + 11])
    assert len(np.unique(group[inner])) == 9


def test_groups_are_small_connected_and_of_nodes_that_may_join():
    points, cells, facets = wall(7.0, 1.0)
    apart = points + np.array([0.0, 1.001])  # another wall that all but touches the first one
    two = np.concatenate([points, apart])
    edges, crosses = map(
        np.concatenate,
        zip(edges_of(cells, facets), edges_of(cells + 22, facets + 22), strict=True),
    )
    may_join = np.arange(44) != 5
    group, count = grouped(two, edges, crosses, may_join, 2.2)
    assert group[5] == -1
    for k in range(count):
        nodes = np.flatnonzero(group == k)
        assert np.ptp(nodes // 22) == 0
        spread = two[nodes][:, None] - two[nodes]
        assert len(nodes) > 1 and np.linalg.norm(spread, axis=2).max() <= 2.2
    assert (group >= 0).sum() > 35


def test_too_small_a_distance_joins_nothing():
    points, cells, facets = wall(7.0, 1.0)
    group, count = grouped(points, *edges_of(cells, facets), np.full(22, True), 0.6)
    assert count == 0 and (group == -1).all()
