"""Lists of what belongs to each node, and sums in parts."""

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.nodes import PARTS, NodeLists, parts_of


def test_nodes_sum_their_entries(fresh_taichi):
    """Side by side as one by one: nodes without entries, entries without a node, a last block that
    is not full.
    """
    from softsim.compute.fields import real_field

    random = np.random.default_rng(3)
    count, node_count = 700, 203
    owner = random.integers(-1, node_count - 2, count)
    entry = random.permutation(count)
    values = np.append(random.standard_normal(count), 0.0)
    lists = NodeLists(owner, entry, node_count, pad_entry=count)
    field, found = real_field(values[None]), real_field(np.full((1, node_count), -1.0))

    @ti.kernel
    def add_up():
        for b in range(lists.blocks.read()):
            total = lists.sum(field, 0, b)
            for lane in ti.static(range(backend.lanes())):
                if lists.node[b, lane] >= 0:
                    found[0, lists.node[b, lane]] = total[lane]

    add_up()
    owned = owner >= 0
    exact = np.bincount(owner[owned], values[entry[owned]], node_count)
    np.testing.assert_allclose(fields.read(found)[0], exact, rtol=0.0, atol=1e-13)


def test_parts_cover_each_thing_once():
    starts = parts_of([3, 0, 1000])
    assert len(starts) == 3 * PARTS + 1
    assert np.all(np.diff(starts) >= 0)
    assert [starts[k * PARTS] for k in range(4)] == [0, 3, 3, 1003]
