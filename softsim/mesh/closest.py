"""Closest points of a surface of facets to given points."""

import numpy as np
from scipy.spatial import cKDTree

# Newton's steps to the foot on a bilinear facet; three do where it is nearly plane.
MOST_STEPS = 20


def closest_on_facets(
    places: np.ndarray, points: np.ndarray, facets: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the facet (k,) closest to each point (k, d) [m], and weights at its closest point.

    The weights are the shape functions (k, corners) of the facet's corners. points (n, d) [m];
    facets (f, corners): edges, triangles or bilinear quadrilaterals, of which a triangle has its
    last corner twice. Of facets that are equally close the first counts.
    """
    corners = points[facets]
    centres = corners.mean(axis=1)
    size = np.linalg.norm(corners - centres[:, None], axis=2).max()
    # No corner is closer than the closest facet, whose centre is not farther than its size beyond.
    used = points[np.unique(facets)]
    nearest, _ = cKDTree(used).query(places)
    near = cKDTree(centres).query_ball_point(places, nearest + size * (1.0 + 1e-9))
    place = np.repeat(np.arange(len(places)), [len(members) for members in near])
    facet = np.concatenate([np.sort(members) for members in near]).astype(int)
    weights = closest_weights(places[place], corners[facet])
    distance = np.linalg.norm(at(weights, corners[facet]) - places[place], axis=1)
    # By place, then by distance, to round-off of the model's size; then by the facet's number.
    rounded = np.round(distance / (1e-12 * np.ptp(used, axis=0).max()))
    order = np.lexsort((facet, rounded, place))
    first = order[np.searchsorted(place[order], np.arange(len(places)))]
    return facet[first], weights[first]


def at(weights: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the points (k, d) with these weights (k, c) of corners (k, c, d)."""
    return np.einsum("kc,kcd->kd", weights, corners)


def closest_weights(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the shape functions (k, c) at the point of each facet closest to a point (k, d).

    Facets have corners (k, c, d). The closest point is the foot of the perpendicular where that
    lies on the facet, else a point of a side.
    """
    count = corners.shape[1]
    if count == 2:
        return _along(places, corners)
    weights = _triangle_feet(places, corners[:, :3])
    if count == 4:
        weights = np.pad(weights, ((0, 0), (0, 1)))
        whole = np.flatnonzero((corners[:, 2] != corners[:, 3]).any(axis=1))
        weights[whole] = _quadrilateral_feet(places[whole], corners[whole])
    beside = np.flatnonzero(~(weights >= -1e-12).all(axis=1))
    weights[beside] = _on_sides(places[beside], corners[beside])
    return np.maximum(weights, 0.0)


def _along(places: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Return the weights (k, 2) of the closest point of an edge (k, 2, d)."""
    way = ends[:, 1] - ends[:, 0]
    square = (way**2).sum(axis=1)
    along = ((places - ends[:, 0]) * way).sum(axis=1)
    share = np.clip(np.divide(along, square, out=np.zeros_like(along), where=square > 0.0), 0, 1)
    return np.stack([1.0 - share, share], axis=1)


def _on_sides(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the weights (k, c) of the closest point of the sides of a facet (k, c, d)."""
    count = corners.shape[1]
    found, best = np.zeros(corners.shape[:2]), np.full(len(places), np.inf)
    for first in range(count):
        second = (first + 1) % count
        shares = _along(places, corners[:, [first, second]])
        distance = np.linalg.norm(at(shares, corners[:, [first, second]]) - places, axis=1)
        closer = distance < best
        best[closer] = distance[closer]
        found[closer] = 0.0
        found[closer, first], found[closer, second] = shares[closer].T
    return found


def _triangle_feet(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return barycentric weights (k, 3) of the foot on the plane of a triangle (k, 3, 3)."""
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal, apart = np.cross(e, f), places - corners[:, 0]
    square = (normal**2).sum(axis=1)
    second = (np.cross(apart, f) * normal).sum(axis=1) / square
    third = (np.cross(e, apart) * normal).sum(axis=1) / square
    return np.stack([1.0 - second - third, second, third], axis=1)


def _quadrilateral_feet(places: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return bilinear weights (k, 4) of the foot on a quadrilateral (k, 4, 3).

    They are found by the Gauss-Newton method; some are negative, or not a number, where the foot
    lies beside the facet.
    """
    local = np.full((len(places), 2), 0.5)
    for _ in range(MOST_STEPS):
        a, b = local.T
        weights, slopes = _bilinear(a, b)
        apart = places - at(weights, corners)
        along = np.einsum("kcp,kcd->kpd", slopes, corners)
        square = np.einsum("kpd,kqd->kpq", along, along)
        step = np.linalg.solve(square, np.einsum("kpd,kd->kp", along, apart)[:, :, None])[:, :, 0]
        # What is far beside the facet need not go on: its closest point is on a side.
        local = np.clip(local + step, -2.0, 3.0)
    return _bilinear(*local.T)[0]


def _bilinear(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shape functions (k, 4) at (a, b) of the unit square, and derivatives (k, 4, 2)."""
    weights = np.stack([(1 - a) * (1 - b), a * (1 - b), a * b, (1 - a) * b], axis=1)
    by_a = np.stack([b - 1, 1 - b, b, -b], axis=1)
    by_b = np.stack([a - 1, -a, a, 1 - a], axis=1)
    return weights, np.stack([by_a, by_b], axis=2)
