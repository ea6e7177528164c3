"""The pattern of a model's stiffness."""

import numpy as np

from softsim.solver.stiffness import node_pairs


def test_pairs_of_many_nodes():
    """The square of the number of nodes is beyond 32 bits."""
    cells = np.array([[0, 99_999], [70_000, 70_000], [99_998, 3]], dtype=np.int32)
    first, second, of_corners = node_pairs(cells, 100_000)
    of_corners = of_corners.reshape(3, 3, 2)
    for a in range(3):
        for b in range(3):
            np.testing.assert_array_equal(first[of_corners[a, b]], cells[a])
            np.testing.assert_array_equal(second[of_corners[a, b]], cells[b])
    assert len(first) == len({(p, q) for p, q in zip(first, second, strict=True)}) == 17
