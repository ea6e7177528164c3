"""Lists of what may touch, against looking at every pair."""

import numpy as np
from surface_rig import PLANE, SurfaceRig, pressed_together

from softsim.compute import fields
from softsim.contact.deformable_surface import DEPTH, NEIGHBOURHOOD
from softsim.contact.neighbour_lists import MARGIN


def distances(points, edges, x):
    """Distance (k, f) of places x (k, 2) to edges (f, 2)."""
    a, along = points[edges[:, 0]], np.diff(points[edges], axis=1)[:, 0]
    share = np.einsum("kfi,fi->kf", x[:, None] - a, along) / (along**2).sum(axis=1)
    closest = a + np.clip(share, 0.0, 1.0)[:, :, None] * along
    return np.linalg.norm(x[:, None] - closest, axis=2)


def contact_points(x, data):
    """Positions (k + f, 2) of the vertices and of the facets' centroids, all nodes at x (n, 2)."""
    return np.concatenate([x[data.nodes], x[data.facets].mean(axis=1)])


def listed(rig):
    """Pairs (node, facet) by the lists of the nodes and by those of the facets."""
    lists = rig.lists
    found = []
    for near, count in ((lists.near_facet, lists.near_facet_count),
                        (lists.near_node, lists.near_node_count)):  # fmt: skip
        near, count = fields.read(near)[0], fields.read(count)[0]
        found.append([(i, j) for i, row in enumerate(near) for j in row[: count[i]]])
    return found


def test_lists_hold_every_pair_within_reach_of_the_longest_facet(build, fresh_taichi):
    """Short ones too: whether they are closer than a long one has to be known."""
    model = build(PLANE, "bodies.upper.mesh.length=5.4 mm")
    rig = SurfaceRig(model)
    data = model.self_contact
    noise = np.random.default_rng(5).standard_normal(model.points.shape)
    x = pressed_together(model, 0.2e-3) + 0.1e-3 * noise
    rig.place(x)
    length = np.maximum(data.point_size[:, None], data.facet_size)
    assert data.facet_size.min() < 0.95 * data.facet_size.max()
    reach = DEPTH * data.facet_size.max() + MARGIN * data.facet_size.mean()
    within = distances(x, data.facets, contact_points(x, data)) <= reach
    at_rest = distances(model.points, data.facets, contact_points(model.points, data))
    apart = (data.point_part[:, None] != data.facet_part) | (at_rest >= NEIGHBOURHOOD * length)
    by_node, by_facet = listed(rig)
    assert by_node == [tuple(pair) for pair in np.argwhere(within & apart).tolist()]
    assert sorted((i, f) for f, i in by_facet) == by_node
    assert len(by_node) > 50


def test_lists_are_made_anew_when_nodes_have_moved_by_the_margin(build, fresh_taichi):
    """Relative to each other: not when the whole moves."""
    model = build(PLANE)
    rig = SurfaceRig(model)
    x = pressed_together(model, 0.0)
    rig.place(x)
    first = listed(rig)
    x += [5e-3, 3e-3]
    rig.place(x)
    x[model.bodies[1].nodes, 1] += 0.999e-3 * MARGIN
    rig.place(x)
    assert listed(rig) == first
    x[model.bodies[1].nodes, 1] += 0.002e-3 * MARGIN
    rig.place(x)
    assert listed(rig) != first


def test_a_list_without_room_is_seen(build, fresh_taichi):
    model = build(PLANE)
    rig = SurfaceRig(model)
    rig.lists.node_room = 2
    rig.place(pressed_together(model, 0.0))
    assert fields.read(rig.lists.overfull)[0] == 1
    assert fields.read(rig.lists.near_node_count).max() == 2
