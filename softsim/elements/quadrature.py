"""Integration points of elements, and shape functions at these points.

Triangles (x, N linear), tetrahedra, quadrilaterals and hexahedra (linear along each of xi_i from -1
to 1). Corners are ordered as in VTK and ABAQUS. A cell with repeated corners is the element that
remains when these coincide: a quadrilateral a b c c is the triangle a b c.
"""

from dataclasses import dataclass

import numpy as np

from softsim.mesh.mesh import signed_volumes

# Corners of the square and of the cube, by their xi_i.
PARENT_CORNERS = {
    4: np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float),
    8: np.array(
        [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1],
         [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
        dtype=float,
    ),
}  # fmt: skip
# N_a at each corner's own point is this, and a share of the rest at the others: exact for
# polynomials of second order (Zienkiewicz, Taylor, The Finite Element Method, vol. 1, ch. 5).
SIMPLEX_POINT = {3: 2.0 / 3.0, 4: (5.0 + 3.0 * np.sqrt(5.0)) / 20.0}


@dataclass(frozen=True, eq=False)
class Quadrature:
    """Quadrature of cells (m, corners) at points (g,).

    values (g, corners): shape functions N_a; gradients (m, g, corners, d) [1/m]: theirs; weights
    (m, g): area [m^2] or volume [m^3].
    """

    values: np.ndarray
    gradients: np.ndarray
    weights: np.ndarray

    def integrals(self, depth: np.ndarray) -> np.ndarray:
        """Return int N_a depth dA (m, corners); depth (m, corners) or (1, 1): at the nodes."""
        return np.einsum("mg,ga->ma", self.weights * self.at_points(depth), self.values)

    def mean_gradients(self, depth: np.ndarray) -> np.ndarray:
        """Return the mean gradients of N_a (m, corners, d) [1/m], weighted by area and depth."""
        weights = self.weights * self.at_points(depth)
        shares = weights / weights.sum(axis=1, keepdims=True)
        return np.einsum("mg,mgai->mai", shares, self.gradients)

    def at_points(self, depth: np.ndarray) -> np.ndarray:
        """Return the values at the points (m, g) of a function that is `depth` at the nodes."""
        corners = np.broadcast_to(depth, (len(depth), self.values.shape[1]))
        return corners @ self.values.T


def quadrature(points: np.ndarray, cells: np.ndarray) -> Quadrature:
    """Return the quadrature of cells (m, corners) of a mesh with points (n, d) [m].

    It has one point per node of the cell."""
    if cells.shape[1] == points.shape[1] + 1:
        return _of_simplexes(points, cells)
    return _of_cubes(points, cells)


def _of_simplexes(points: np.ndarray, cells: np.ndarray) -> Quadrature:
    m, corners = cells.shape
    d = corners - 1
    own = SIMPLEX_POINT[corners]
    rest = (1.0 - own) / d
    values = np.full((corners, corners), rest) + (own - rest) * np.eye(corners)
    gradients = simplex_gradients(points, cells)
    volume = signed_volumes(points, cells)
    return Quadrature(
        values,
        np.broadcast_to(gradients[:, None], (m, corners, corners, d)),
        np.broadcast_to((volume / corners)[:, None], (m, corners)),
    )


def simplex_gradients(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Return grad N_a (m, corners, d) [1/m] of triangles (m, 3) or tetrahedra (m, 4)."""
    corners = points[cells]
    edges = corners[:, 1:] - corners[:, :1]  # x = x0 + edges^T xi, so grad xi = edges^-1
    inner = np.linalg.inv(edges).transpose(0, 2, 1)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)


def altitude(corners: np.ndarray) -> float:
    """Return the smallest altitude [m] of a cell with these corners (c, d).

    It is the shortest distance over which the shape functions of one side fall from 1 to 0.
    """
    distinct = np.unique(corners, axis=0)
    if len(distinct) == corners.shape[1] + 1:
        corners = distinct  # a simplex, however it was written
    whole = quadrature(corners, np.arange(len(corners))[None])
    slopes = whole.mean_gradients(np.ones((1, 1)))[0]
    if len(corners) > corners.shape[1] + 1:
        slopes = (PARENT_CORNERS[len(corners)].T > 0.0) @ slopes
    return 1.0 / float(np.linalg.norm(slopes, axis=1).max())


def _of_cubes(points: np.ndarray, cells: np.ndarray) -> Quadrature:
    """Return the quadrature with two Gauss points along each xi_i, exact up to xi_i^3."""
    corners = cells.shape[1]
    values, by_xi = cube_functions(PARENT_CORNERS[corners] / np.sqrt(3.0), corners)
    jacobian = by_xi.swapaxes(1, 2) @ points[cells][:, None]  # dx_j / dxi_i
    gradients = by_xi @ np.linalg.inv(jacobian).swapaxes(2, 3)
    return Quadrature(values, gradients, np.linalg.det(jacobian))


def cube_functions(xi: np.ndarray, corners: int) -> tuple[np.ndarray, np.ndarray]:
    """Return N_a (g, corners) and dN_a / dxi_i (g, corners, d) of a quadrilateral or hexahedron.

    xi (g, d): points.
    """
    at_corner = PARENT_CORNERS[corners]
    factors = 0.5 * (1.0 + xi[:, None] * at_corner)  # (g, corners, d): along each xi_i
    by_xi = np.empty_like(factors)
    for i in range(at_corner.shape[1]):
        others = np.delete(factors, i, axis=2)
        by_xi[:, :, i] = 0.5 * at_corner[:, i] * others.prod(axis=2)
    return factors.prod(axis=2), by_xi
