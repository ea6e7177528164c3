"""Closed surfaces of triangles for tests; normals outwards."""

import numpy as np

BOX_CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=float)
BOX_FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)


def of_quads(quads):
    """Two triangles (2 q, 3) for each face of four corners (q, 4)."""
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def box(size):
    """A box from the origin, edges `size` (3,) [m]: points, triangles."""
    return BOX_CORNERS * size, of_quads(BOX_FACES)


def sphere(radius, parts):
    """A sphere of a cube's faces in parts x parts fields each, blown up: points, triangles."""
    steps = np.tan(np.linspace(-1.0, 1.0, parts + 1) * np.pi / 4.0)
    i, j = (n.ravel() for n in np.mgrid[:parts, :parts])
    width = parts + 1
    places, quads = [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            u, v = (n.ravel() for n in np.meshgrid(steps, steps, indexing="ij"))
            side = np.stack([np.full(len(u), sign), sign * u, v], axis=1)
            field = np.stack([i * width + j, (i + 1) * width + j], axis=1)
            field = np.concatenate([field, field[:, ::-1] + 1], axis=1) + len(places) * width**2
            places.append(np.roll(side, axis, axis=1))
            quads.append(field)
    points = np.concatenate(places)
    points, number = np.unique(np.round(points, 12), axis=0, return_inverse=True)
    points *= radius / np.linalg.norm(points, axis=1)[:, None]
    return points, number.reshape(-1)[of_quads(np.concatenate(quads))]
