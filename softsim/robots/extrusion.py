"""Cells of a plane section swept through space, from one position to the next."""

import numpy as np


def extruded_tetrahedra(layers: list[np.ndarray], stations: np.ndarray) -> np.ndarray:
    """Return tetrahedra (m, 4) of positive volume between neighbouring positions of a section.

    layers: for each layer the triangles (k, 3) of the section that it fills, counter-clockwise seen
    against the sweep; they may differ from layer to layer. stations: (layers + 1, n) node numbers
    of the section's nodes at each position. A closed sweep repeats its first station as its last.

    Each triangle becomes a prism and each prism three tetrahedra, conforming across all prisms. The
    diagonals on the prisms' sides alternate from layer to layer, so that the mesh has no twist of
    its own.
    """
    cells = []
    for layer, triangles in enumerate(layers):
        low, high = stations[layer], stations[layer + 1]
        # Swept backwards, a triangle seen from behind, the diagonals lean the other way.
        forth = layer % 2 == 0
        cells.append(
            _prism_cells(triangles, low, high)
            if forth
            else _prism_cells(triangles[:, ::-1], high, low)
        )
    return np.concatenate(cells)


def extruded_hexahedra(layers: list[np.ndarray], stations: np.ndarray) -> np.ndarray:
    """Return hexahedra (m, 8) of positive volume between neighbouring positions of a section.

    layers: the quadrilaterals (k, 4) of each; a triangle among them becomes a wedge. See
    `extruded_tetrahedra`.
    """
    below_and_above = zip(stations[:-1], stations[1:], layers, strict=True)
    return np.concatenate([np.hstack([low[q], high[q]]) for low, high, q in below_and_above])


EXTRUSIONS = {"simplex": extruded_tetrahedra, "quad": extruded_hexahedra}


def _prism_cells(triangles: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the tetrahedra of the prisms between the section's nodes at `low` and at `high`.

    On every side the diagonal rises from the node with the smaller number in the section, so that
    both prisms at a side cut it in the same way.
    """
    first, second, third = triangles.T
    # An odd permutation sorts these: it turns the triangle's sense, and its tetrahedra with it.
    odd = (second - first) * (third - first) * (third - second) < 0
    a, b, c = np.sort(triangles, axis=1).T
    cells = np.stack(
        [
            np.column_stack([low[a], low[b], low[c], high[c]]),
            np.column_stack([low[a], low[b], high[c], high[b]]),
            np.column_stack([low[a], high[a], high[b], high[c]]),
        ],
        axis=1,
    )
    return np.where(odd[:, None, None], cells[:, :, [0, 1, 3, 2]], cells).reshape(-1, 4)
