"""Search for the elements that contain given points, and their shape functions there."""

import numpy as np
from scipy.spatial import cKDTree

from softsim.elements.quadrature import cube_functions, simplex_gradients
from softsim.mesh.closest import at, closest_on_facets

# A place that is outside an element by no more than this share of it lies in it.
ROUND_OFF = 1e-9
# Newton's steps to a place in a bilinear or trilinear element; four do where it is no wedge.
MOST_STEPS = 30


def embedded(
    places: np.ndarray, points: np.ndarray, cells: np.ndarray, surface: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the nodes that places in a body follow, their weights, and how far places are moved.

    Each place (k, d) [m] in a body follows nodes (k, c) with weights (k, c) and is moved by a
    distance (k,) [m].

    points (n, d) [m], cells (m, c) and surface (f, corners) of the body's mesh. A place in
    a cell follows the nodes of the cell with its shape functions as weights and is not moved; where
    several cells meet, the first is taken. A place outside is moved to the closest point of the
    surface, and follows the nodes of that facet.
    """
    cell, weights = holding_cells(places, points, cells)
    nodes, moved = cells[cell], np.zeros(len(places))
    outside = np.flatnonzero(cell < 0)
    if len(outside):
        facet, shares = closest_on_facets(places[outside], points, surface)
        corners = surface[facet]
        moved[outside] = np.linalg.norm(at(shares, points[corners]) - places[outside], axis=1)
        spare = ((0, 0), (0, cells.shape[1] - surface.shape[1]))  # corners without weight
        nodes[outside] = np.pad(corners, spare, mode="edge")
        weights[outside] = np.pad(shares, spare)
    return nodes, weights, moved


def holding_cells(
    places: np.ndarray, points: np.ndarray, cells: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the number of the cell that contains each place, and its shape functions there.

    The result is the number (k,) of the cell (m, c) for places (k, d) [m], -1 for none, and the
    shape functions (k, c). points (n, d) [m] of the mesh.
    """
    corners = points[cells]
    centres = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centres[:, None], axis=2).max() * (1.0 + ROUND_OFF)
    near = cKDTree(centres).query_ball_point(places, reach)
    place = np.repeat(np.arange(len(places)), [len(members) for members in near])
    candidate = np.concatenate([np.sort(members) for members in near]).astype(int)
    weights, beside = shape_functions(places[place], points, cells[candidate])
    inside = np.flatnonzero(beside <= ROUND_OFF)
    held, first = np.unique(place[inside], return_index=True)
    found, of_places = np.full(len(places), -1), np.zeros((len(places), cells.shape[1]))
    found[held], of_places[held] = candidate[inside[first]], weights[inside[first]]
    return found, of_places


def shape_functions(
    places: np.ndarray, points: np.ndarray, cells: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return shape functions of cells at one place each, and how far outside the place lies.

    N_a (k, c) of cells (k, c) at places (k, d) [m]; the distance outside (k,) is a fraction of the
    cell's size, zero or less inside.
    """
    if cells.shape[1] == points.shape[1] + 1:
        first = points[cells[:, 0]]
        weights = np.einsum("kci,ki->kc", simplex_gradients(points, cells), places - first)
        weights[:, 0] += 1.0
        return weights, -weights.min(axis=1)
    corners = points[cells]
    size = np.linalg.norm(corners - places[:, None], axis=2).max(axis=1)
    xi = np.zeros(places.shape)
    for _ in range(MOST_STEPS):
        weights, slopes = cube_functions(xi, cells.shape[1])
        apart = places - at(weights, corners)
        if np.linalg.norm(apart, axis=1).max(initial=0.0) < 1e-15 * size.max(initial=0.0):
            break
        # dx_j / dxi_i; a pseudo-inverse, as corners of a wedge fall together.
        inverse = np.linalg.pinv(slopes.swapaxes(1, 2) @ corners)
        step = np.einsum("ki,kij->kj", apart, inverse)
        # What is far outside need not go on: another cell holds it.
        xi = np.clip(xi + step, -2.0, 2.0)
    weights, _ = cube_functions(xi, cells.shape[1])
    missed = np.linalg.norm(places - at(weights, corners), axis=1) / size
    return weights, np.maximum(np.abs(xi).max(axis=1) - 1.0, missed)
