"""Geometry of the elements in numpy: volumes, deformation gradients, mass shares.

One class a formulation, beside the Taichi class of the same name that computes forces. Builders,
guards and figures, which must answer without Taichi, ask here.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from softsim.mesh.mesh import signed_volumes


def shape_gradients(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Gradients (cells, corners, d) [1/m] of the shape functions of linear triangles (d = 2) or
    tetrahedra (d = 3), N_a = 1 at corner a.
    """
    corners = points[cells]
    edges = corners[:, 1:] - corners[:, :1]  # x = x0 + edges^T xi, so grad xi = edges^-1
    inner = np.linalg.inv(edges).transpose(0, 2, 1)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)


class Hoop(ABC):
    """What of a section goes around: F_zz of its elements, and how nodes that move change it."""

    @abstractmethod
    def stretch(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """F_zz (m,) of the elements with their nodes now at x."""

    @abstractmethod
    def stencil(self, cells: np.ndarray) -> np.ndarray:
        """Nodes (m, movers) whose motion strains each cell, its corners first: no others."""

    @abstractmethod
    def gradient(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """dF_zz/dx / F_zz (m, movers, d) [1/m] of these nodes, now at x."""

    @abstractmethod
    def curvature(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Of d^2F_zz/dx^2 / F_zz an upper bound (m, movers, movers) [1/m^2] that is the same for
        every component.
        """


class Geometry(ABC):
    """Kinematics of the elements of one formulation."""

    name: ClassVar[str]
    dimension: ClassVar[int]

    @property
    def hoop(self) -> Hoop | None:
        """What goes around, of a section in which something does."""
        return None

    @abstractmethod
    def volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Volume of each element (m,) [m^3]."""

    @abstractmethod
    def mass_shares(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Share (m, corners) of an element's mass that each corner carries."""

    def deformation(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """F (m, 3, 3) of the elements with their nodes now at x; zz lies across a section."""
        d = self.dimension
        F = np.zeros((len(cells), 3, 3))
        F[:, 2, 2] = 1.0 if self.hoop is None else self.hoop.stretch(points, cells, x)
        F[:, :d, :d] = np.einsum("eai,eaj->eij", x[cells], shape_gradients(points, cells))
        return F

    def pressed(self, facets: np.ndarray, first_node: int) -> np.ndarray:
        """Nodes (k, corners) that a pressure on facets acts on; first_node: the body's."""
        return facets

    @abstractmethod
    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Volume [m^3] on the free side of a closed surface of facets, as `pressed` gives them."""

    @abstractmethod
    def corner_areas(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Area (k, corners) [m^2] of facets (k, corners) that each of their corners stands for."""

    @abstractmethod
    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """d(enclosed volume)/dx of the nodes of facets, as `pressed` gives them, (k, nodes, d)
        [m^2]: forces of a pressure of 1 Pa.
        """


@dataclass(frozen=True)
class PlaneStrain(Geometry):
    """Triangles of a plate of given thickness [m] that cannot strain across it."""

    thickness: float
    name = "plane_strain"
    dimension = 2

    def volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Volume of each element (m,) [m^3]."""
        return self.thickness * signed_volumes(points, cells)

    def mass_shares(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Share (m, corners) of an element's mass that each corner carries."""
        return np.full(cells.shape, 1.0 / 3.0)

    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Volume [m^3] on the free side of a closed chain of edges (k, 2)."""
        a, b = x[facets[:, 0]], x[facets[:, 1]]
        return 0.5 * self.thickness * float((a[:, 1] * b[:, 0] - a[:, 0] * b[:, 1]).sum())

    def corner_areas(self, x: np.ndarray, edges: np.ndarray) -> np.ndarray:
        """Area (k, 2) [m^2] of edges (k, 2) that each of their ends stands for."""
        return 0.5 * self.thickness * np.repeat(_lengths(x, edges)[:, None], 2, axis=1)

    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """d(enclosed volume)/dx of the corners (k, 2, d) [m^2]: forces of a pressure of 1 Pa."""
        d = x[facets[:, 1]] - x[facets[:, 0]]
        half = 0.5 * self.thickness * np.stack([-d[:, 1], d[:, 0]], axis=1)
        return np.stack([half, half], axis=1)


class RevolvedHoop(Hoop):
    """Of triangles revolved about the y axis: F_zz = r / R of the centroid, whose radius is the
    mean of the corners'.
    """

    def stretch(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """F_zz (m,): present over reference radius."""
        return x[cells][:, :, 0].sum(axis=1) / points[cells][:, :, 0].sum(axis=1)

    def stencil(self, cells: np.ndarray) -> np.ndarray:
        """The corners (m, 3)."""
        return cells

    def gradient(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """dF_zz/dx / F_zz (m, 3, 2) [1/m]: 1 / (3 r) along the radius."""
        gradient = np.zeros((*cells.shape, 2))
        gradient[:, :, 0] = 1.0 / x[cells][:, :, 0].sum(axis=1, keepdims=True)
        return gradient

    def curvature(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """None (m, 3, 3): F_zz is linear in x."""
        return np.zeros((len(cells), 3, 3))


@dataclass(frozen=True)
class Axisymmetric(Geometry):
    """Triangles revolved about the y axis: x is the radius. Whole rings, 2 pi around.

    One integration point, the centroid, whose radius is the mean of the corners'.
    """

    name = "axisymmetric"
    dimension = 2

    @property
    def hoop(self) -> RevolvedHoop:
        """Every element goes around."""
        return RevolvedHoop()

    def volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Volume of each ring (m,) [m^3], exact (Pappus): 2 pi r A."""
        radius = points[cells][:, :, 0].mean(axis=1)
        return 2.0 * np.pi * radius * signed_volumes(points, cells)

    def mass_shares(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Row sums of the consistent mass matrix: int N_a 2 pi r dA over the volume, so that
        weight and inertia do the work of the continuous body.
        """
        radius = points[cells][:, :, 0]
        total = radius.sum(axis=1, keepdims=True)
        return (radius + total) / (4.0 * total)

    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Volume [m^3] between a chain of edges (k, 2), revolved, and the axis."""
        a, b = x[facets[:, 0]], x[facets[:, 1]]
        squares = a[:, 0] ** 2 + a[:, 0] * b[:, 0] + b[:, 0] ** 2
        return np.pi / 3.0 * float(((a[:, 1] - b[:, 1]) * squares).sum())

    def corner_areas(self, x: np.ndarray, edges: np.ndarray) -> np.ndarray:
        """Area (k, 2) [m^2] of edges (k, 2) that each of their ends stands for: int N_a 2 pi r
        ds.
        """
        return np.pi / 3.0 * _lengths(x, edges)[:, None] * _weighted(2.0 * x[edges][:, :, 0])

    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """d(enclosed volume)/dx of the corners (k, 2, d) [m^2]: forces of a pressure of 1 Pa."""
        (a, za), (b, zb) = x[facets[:, 0]].T, x[facets[:, 1]].T
        squares = a**2 + a * b + b**2
        first = np.stack([(2.0 * a + b) * (za - zb), squares], axis=1)
        second = np.stack([(a + 2.0 * b) * (za - zb), -squares], axis=1)
        return np.pi / 3.0 * np.stack([first, second], axis=1)


@dataclass(frozen=True, eq=False)
class PairedHoop(Hoop):
    """Of ring cells, whose corners c have the nodes c' opposite them; single parts have F_zz = 1.
    opposite (n,), is_ring (m,) and the equation of F_zz: see RingSection.
    """

    opposite: np.ndarray
    is_ring: np.ndarray

    def stretch(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """F_zz (m,): present over reference diameter; of single parts one."""
        now, before = (self.diameters(at, cells).sum(axis=1) for at in (x, points))
        return now / before

    def stencil(self, cells: np.ndarray) -> np.ndarray:
        """Nodes (m, 6) whose motion strains each cell: its corners, and of a ring cell the nodes
        opposite them; of single parts the corners once more, to no effect.
        """
        return np.hstack([cells, np.where(self.is_ring[:, None], self.opposite[cells], cells)])

    def gradient(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """dF_zz/dx / F_zz (m, 6, 2) [1/m] of these nodes: with the unit vector n_c from c' to c
        n_c / sum |x_c - x_c'| on c, the opposite on c'.
        """
        diameters = self.diameters(x, cells)
        direction = (x[cells] - x[self.opposite[cells]]) / diameters[:, :, None]
        gradient = direction / diameters.sum(axis=1)[:, None, None]
        gradient[~self.is_ring] = 0.0
        return np.concatenate([gradient, -gradient], axis=1)

    def curvature(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Bound of d^2F_zz/dx^2 / F_zz (m, 6, 6) [1/m^2]: what turns a diameter lengthens it, by
            d^2 |x_c - x_c'| = |t_c . (u_c - u_c')|^2 / |x_c - x_c'|,  t_c across the diameter;
        taken for every direction.
        """
        diameters = self.diameters(x, cells)
        turning = 1.0 / (diameters * diameters.sum(axis=1, keepdims=True))
        turning[~self.is_ring] = 0.0
        each = turning[:, :, None] * np.eye(3)
        return np.block([[each, -each], [-each, each]])

    def diameters(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """|x_c - x_c'| of the corners (m, 3) [m]; of single parts, which may lie on the axis, one
        metre.
        """
        lengths = np.linalg.norm(x[cells] - x[self.opposite[cells]], axis=2)
        return np.where(self.is_ring[:, None], lengths, 1.0)


@dataclass(frozen=True, eq=False)
class RingSection(Geometry):
    """A section of a robot that is round about its axis: two strips, opposite sides of the same
    rings of skin, with single fins on them. At rest the axis is parallel to x.

    What a full ring has and a plane section lacks is its tension around. Opposite places are a
    diameter apart, so of a ring cell, whose corners c have the opposite nodes c',
        F_zz = sum_c |x_c - x_c'| / sum_c |X_c - X_c'|.
    The assumption is that rings stay round with these diameters, in the section's plane. A ring
    that moves or turns as a whole is not stretched, wherever it goes. A strip stands for `sector`
    [rad] of the ring's circumference; of what stands singly on it, for a `thickness` [m] of that,
    in plane strain.

    opposite: node across the axis of each node (n,), numbered within the body. is_ring: (m,) cells
    that go around. Not for parts of a body: cells are all of them, in their order.
    """

    thickness: float
    sector: float
    opposite: np.ndarray
    is_ring: np.ndarray
    name = "ring_section"
    dimension = 2

    @property
    def hoop(self) -> PairedHoop:
        """Of the ring cells."""
        return PairedHoop(self.opposite, self.is_ring)

    def volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Volume of each element (m,) [m^3]: sector r A (Pappus), or thickness A."""
        radius = self.hoop.diameters(points, cells).sum(axis=1) / 6.0
        depth = np.where(self.is_ring, self.sector * radius, self.thickness)
        return depth * signed_volumes(points, cells)

    def mass_shares(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Share (m, corners) of an element's mass that each corner carries: of a ring cell as
        `Axisymmetric` has it.
        """
        diameters = self.hoop.diameters(points, cells)
        total = diameters.sum(axis=1, keepdims=True)
        return np.where(self.is_ring[:, None], (diameters + total) / (4.0 * total), 1.0 / 3.0)

    def pressed(self, edges: np.ndarray, first_node: int) -> np.ndarray:
        """Nodes (k, 4) that a pressure on edges (k, 2) acts on: their ends and the opposite ones,
        with which it has to do because the radius is half the way between them.
        """
        return np.column_stack([edges, first_node + self.opposite[edges - first_node]])

    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Volume [m^3] between edges and the axis over the sector; facets: of `pressed`.

        That of frusta, sector/6 h (a^2 + a b + b^2) with radii a, b and the length h along the
        axis, in terms that turn with the section: the diameters are d_a = x_a - x_a' and d_b, so
        2 a = |d_a|, and 2 h a = (x_b - x_a) x d_a, or with d_b and b, where they are parallel.
        """
        _, lengths, crossed = self._frusta(x, facets)
        return self.sector / 24.0 * float((crossed * _weighted(lengths)).sum())

    def corner_areas(self, x: np.ndarray, edges: np.ndarray) -> np.ndarray:
        """Area (k, 2) [m^2] of rings' edges (k, 2) that each of their ends stands for: int N_a
        sector r ds.
        """
        diameters = np.linalg.norm(x[edges] - x[self.opposite[edges]], axis=2)
        return self.sector / 6.0 * _lengths(x, edges)[:, None] * _weighted(diameters)

    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """d(enclosed volume)/dx of the nodes (k, 4, d) [m^2]: forces of a pressure of 1 Pa."""
        diameters, lengths, crossed = self._frusta(x, facets)
        edge = x[facets[:, 1]] - x[facets[:, 0]]
        weights = _weighted(lengths)[:, :, None]
        of_edge = (weights * _across(diameters)).sum(axis=1)
        direction = diameters / lengths[:, :, None]
        a, b = (
            _weighted(crossed)[:, :, None] * direction - weights * _across(edge)[:, None]
        ).transpose(1, 0, 2)
        return self.sector / 24.0 * np.stack([a - of_edge, b + of_edge, -a, -b], axis=1)

    def _frusta(
        self, x: np.ndarray, facets: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of both ends of facets (k, 4): diameters d (k, 2, 2) [m], their lengths (k, 2) [m], and
        the facet's edge times them, D x d = D_x d_y - D_y d_x (k, 2) [m^2].
        """
        edge = x[facets[:, 1]] - x[facets[:, 0]]
        diameters = x[facets[:, :2]] - x[facets[:, 2:]]
        crossed = np.einsum("ki,kci->kc", edge, _across(diameters))
        return diameters, np.linalg.norm(diameters, axis=2), crossed


def _lengths(x: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Length (k,) [m] of edges (k, 2)."""
    return np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)


def _across(vectors: np.ndarray) -> np.ndarray:
    """(d_y, -d_x) of vectors d (..., 2): D x d = D . that."""
    return np.stack([vectors[..., 1], -vectors[..., 0]], axis=-1)


def _weighted(ends: np.ndarray) -> np.ndarray:
    """Of two ends (k, 2) each with half of the other."""
    return ends + 0.5 * ends[:, ::-1]


@dataclass(frozen=True)
class Solid(Geometry):
    """Tetrahedra in space."""

    name = "solid"
    dimension = 3

    def volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Volume of each element (m,) [m^3]."""
        return signed_volumes(points, cells)

    def mass_shares(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Share (m, corners) of an element's mass that each corner carries."""
        return np.full(cells.shape, 0.25)

    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Volume [m^3] on the free side of a closed surface of triangles (k, 3)."""
        a, b, c = x[facets].transpose(1, 0, 2)
        return float(np.einsum("ki,ki->", a, np.cross(c, b))) / 6.0

    def corner_areas(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Area (k, 3) [m^2] of triangles (k, 3) that each of their corners stands for."""
        a, b, c = x[facets].transpose(1, 0, 2)
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return np.repeat(area[:, None] / 3.0, 3, axis=1)

    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """d(enclosed volume)/dx of the corners (k, 3, d) [m^2]: forces of a pressure of 1 Pa."""
        a, b, c = x[facets].transpose(1, 0, 2)
        return np.repeat(np.cross(c - a, b - a)[:, None] / 6.0, 3, axis=1)


def nodal_sums(cells: np.ndarray, per_corner: np.ndarray, node_count: int) -> np.ndarray:
    """Sum over each node's elements (n,) of the values (m, corners) at its corners."""
    return np.bincount(cells.ravel(), np.broadcast_to(per_corner, cells.shape).ravel(), node_count)


def nodal_sizes(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Length of each node's surroundings (n,) [m]: the root of its share of area or volume."""
    share = signed_volumes(points, cells)[:, None] / cells.shape[1]
    return nodal_sums(cells, share, len(points)) ** (1.0 / points.shape[1])
