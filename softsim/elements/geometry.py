"""Interface of an element formulation, integration points, regions of bodies.

A formulation gives volumes, deformation gradients, mass fractions and facets in numpy. Its Geometry
stands beside the Taichi classes that this creates in `elements`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import index_field, real_field
from softsim.compute.nodes import Nodes
from softsim.compute.vectors import KERNEL, NUMPY
from softsim.materials.material import Material
from softsim.mesh.mesh import batches, signed_volumes

if TYPE_CHECKING:
    from softsim.compute.term import Term


# -------------------------------------------------------------------------------------------------
# Integration points of elements, and shape functions at these points.
#
# Triangles (x, N linear), tetrahedra, quadrilaterals and hexahedra (linear along each of xi_i from
# -1 to 1). Corners are ordered as in VTK and ABAQUS. A cell with repeated corners is the element
# that remains when these coincide: a quadrilateral a b c c is the triangle a b c.


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


# -------------------------------------------------------------------------------------------------
# Element formulation: volumes, deformation gradients, mass fractions, facets.


class Hoop(ABC):
    """Hoop stretch F_zz of the elements of a section, and its derivatives by nodal positions."""

    @abstractmethod
    def stretch(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return F_zz (m,) of the elements with their nodes at x (n, d) [m]."""

    @abstractmethod
    def stencil(self, cells: np.ndarray) -> np.ndarray:
        """Return all nodes (m, movers) whose motion strains each cell, its own nodes first."""

    @abstractmethod
    def gradient(self, points: np.ndarray, cells: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return dF_zz/dx / F_zz (m, movers, d) [1/m] of these nodes, at x."""

    @abstractmethod
    def curvature(self, x: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return an upper bound (m, movers, movers) [1/m^2] of d^2F_zz/dx^2 / F_zz.

        It is the same for all components.
        """


class Geometry(ABC):
    """Kinematics of the elements of one formulation."""

    name: ClassVar[str]
    dimension: ClassVar[int]

    @property
    def hoop(self) -> Hoop | None:
        """Hoop stretch of a section that has one, else None."""
        return None

    @abstractmethod
    def depths(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the depth of the section at its nodes (m, corners) or (1, 1) [m]; 1 in space.

        It is interpolated linearly between nodes.
        """

    def volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the volume of each element (m,) [m^3]."""
        return self.corner_volumes(points, cells).sum(axis=1)

    def corner_volumes(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return int N_a dV (m, corners) [m^3].

        These are row sums of the consistent mass matrix over the density, so that weight and
        inertia do the same work as in the continuous body.
        """

        def of(cells: np.ndarray, depths: np.ndarray) -> np.ndarray:
            return quadrature(points, cells).integrals(depths)

        return self._with_depths(of, points, cells)

    def mass_shares(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the fraction (m, corners) of an element's mass that each node carries."""
        volumes = self.corner_volumes(points, cells)
        return volumes / volumes.sum(axis=1, keepdims=True)

    def gradients(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return the mean of grad N_a over each element's volume (m, corners, d) [1/m].

        With it the forces of a uniform stress cancel at every inner node, whatever the shape of the
        elements (Flanagan and Belytschko 1981, Int. J. Numer. Meth. Engng 17:679-706).
        """

        def of(cells: np.ndarray, depths: np.ndarray) -> np.ndarray:
            return quadrature(points, cells).mean_gradients(depths)

        return self._with_depths(of, points, cells)

    def _with_depths(
        self,
        of: Callable[[np.ndarray, np.ndarray], np.ndarray],
        points: np.ndarray,
        cells: np.ndarray,
    ) -> np.ndarray:
        """Return the values of a function of cells and their depths for all cells, batch by batch.

        The depths are computed for all cells at once: a ring section identifies rings by number.
        """
        depths = self.depths(points, cells)
        found = [
            of(cells[batch], depths if len(depths) == 1 else depths[batch])
            for batch in batches(len(cells))
        ]
        return np.concatenate(found)

    def of_cells(self, numbers: np.ndarray, thickness: float | None) -> "Geometry":
        """Return the geometry of some of the elements, with another thickness [m] if given."""
        return self

    def bounds_with(self, other: "Geometry") -> bool:
        """Return True if facets of elements of both geometries may enclose one volume."""
        return self == other

    def pressed(self, facets: np.ndarray, first_node: int) -> np.ndarray:
        """Return the nodes (k, corners) loaded by a pressure on facets; first_node: the body's."""
        return facets

    @property
    def facet_factor(self) -> float:
        """Factor of a facet's volume: thickness [m] or sector [rad] of a section, else 1."""
        return 1.0

    @staticmethod
    @abstractmethod
    def facet_volume_and_gradient(x, factor, m):
        """Return the volume [m^3] that a facet adds to its chamber, and the forces [m^2] of a
        pressure of 1 Pa on its nodes.

        Summed over a closed surface the forces are the gradient of the volume; those of a single
        facet need not be. x: positions of the facet's nodes, as from `pressed`. factor: that of
        `facet_factor`. One text serves numpy and kernels, see compute/vectors.py.
        """

    def enclosed_volume(self, x: np.ndarray, facets: np.ndarray) -> float:
        """Return the volume [m^3] on the free side of a closed surface of facets from `pressed`."""
        return float(np.sum(self._volumes_and_gradients(x, facets)[0]))

    def volume_gradient(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Return d(enclosed volume)/dx (k, nodes, d) [m^2] of the nodes of facets from `pressed`:
        forces of a pressure of 1 Pa.
        """
        return np.stack(self._volumes_and_gradients(x, facets)[1]).transpose(2, 0, 1)

    def _volumes_and_gradients(self, x: np.ndarray, facets: np.ndarray) -> tuple[Any, Any]:
        of_nodes = [x[nodes].T for nodes in facets.T]
        volumes, gradients = self.facet_volume_and_gradient(of_nodes, self.facet_factor, NUMPY)
        return volumes, gradients

    @abstractmethod
    def corner_areas(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Return the tributary area (k, corners) [m^2] of each node of facets (k, corners)."""

    @abstractmethod
    def elements(self, nodes: "Nodes", region: "Region", bulk_viscosity: float) -> "Term":
        """Return the force term of a region's elements; bulk_viscosity: b1 [-]."""

    def facets(self, nodes: Nodes, facets: np.ndarray) -> "Facets":
        """Return the kernel class that applies a pressure to facets from `pressed`."""
        return Facets(nodes, facets, self)


def edge_lengths(x: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the length (k,) [m] of edges (k, 2)."""
    return np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1)


def weighted_ends(ends: np.ndarray) -> np.ndarray:
    """Return the value at each of two ends (k, 2) plus half of that at the other."""
    return ends + 0.5 * ends[:, ::-1]


def nodal_sums(cells: np.ndarray, per_corner: np.ndarray, node_count: int) -> np.ndarray:
    """Return the sum (n,) over the elements at each node of their nodal values (m, corners)."""
    return np.bincount(cells.ravel(), np.broadcast_to(per_corner, cells.shape).ravel(), node_count)


# -------------------------------------------------------------------------------------------------
# Facets under pressure: the nodal forces of a unit pressure, and the volume they bound.
#
# The force is the gradient of the volume, so a load built on it follows the deformation, does not
# depend on the time step, and on a closed surface has no resultant. Facets have the material to
# their left (an edge) or behind them (a triangle): the chamber is on the other side.


class Facets:
    """Kernel class of facets, with the nodes (k, corners) that a pressure on them acts on."""

    def __init__(self, nodes: Nodes, facets: np.ndarray, geometry: Geometry) -> None:
        self.nodes, self.corner_nodes, self.kind = nodes, facets, geometry.name
        self.count, self.corners = facets.shape
        self.node = index_field(facets)
        self.factor = real_field(np.array([geometry.facet_factor]))
        self.formula = ti.func(geometry.facet_volume_and_gradient)

    @ti.func
    def unit_forces(self, s, i):
        """Return the forces (corner, component) of a pressure of 1 Pa on facet i [m^2]."""
        x = [self.nodes.position[s, self.node[i, c]] for c in ti.static(range(self.corners))]
        _, gradient = self.formula(x, self.factor[0], KERNEL)
        forces = ti.Matrix.zero(backend.real, self.corners, self.nodes.dimension)
        for c, k in ti.static(ti.ndrange(self.corners, self.nodes.dimension)):
            forces[c, k] = gradient[c][k]
        return forces

    @ti.func
    def volume(self, s, i):
        """Return the volume [m^3] that facet i adds to that of its chamber."""
        x = [self.nodes.position[s, self.node[i, c]] for c in ti.static(range(self.corners))]
        volume, _ = self.formula(x, self.factor[0], KERNEL)
        return volume


# -------------------------------------------------------------------------------------------------
# Regions of a body: elements of one material and one geometry.


@dataclass(frozen=True)
class Region:
    """Cell set of a body, or the cells in no set with its own region: then cell_set is None.

    Regions share nodes, so displacements are continuous. Each has pressures of its own, see
    elements/one_point.py: at an interface a node has one for each region, as a stiffer
    material may hold another one than what it is bonded to.

    body: name. first_node: of the body's nodes in the model. points (n, d) [m]: of the whole body.
    cells (m, corners): numbered within the body. numbers (m,): which of the body's cells they are.
    """

    body: str
    cell_set: str | None
    first_node: int
    points: np.ndarray
    cells: np.ndarray
    numbers: np.ndarray
    geometry: Geometry
    material: Material

    @property
    def nodes(self) -> slice:
        """Slice of the body's nodes in the model."""
        return slice(self.first_node, self.first_node + len(self.points))

    @property
    def has_hourglass_modes(self) -> bool:
        """True for quadrilaterals and hexahedra, which have hourglass modes."""
        return self.cells.shape[1] > self.points.shape[1] + 1

    @property
    def pressure_points(self) -> np.ndarray:
        """Numbers (m, k), below `pressure_count`, of the pressures of each element.

        Triangles and tetrahedra, which would lock with one pressure each, have those of their
        nodes; an element with hourglass modes has one of its own. In a region of the latter,
        collapsed elements have those of their nodes, numbered after the elements' own; the others
        then list their own once for each node of a triangle or tetrahedron.
        """
        if not self.has_hourglass_modes:
            return self.cells
        own = np.arange(len(self.cells))[:, None]
        if not self._is_simplex.any():
            return own
        points = np.repeat(own, self.points.shape[1] + 1, axis=1)
        corners = np.sort(self.cells[self._is_simplex], axis=1)
        last_of_its_node = np.diff(corners, append=-1, axis=1) != 0
        points[self._is_simplex] = len(own) + corners[last_of_its_node].reshape(-1, points.shape[1])
        return points

    @property
    def pressure_count(self) -> int:
        """Number of pressures of the region."""
        if not self.has_hourglass_modes:
            return len(self.points)
        return len(self.cells) + (len(self.points) if self._is_simplex.any() else 0)

    @property
    def _is_simplex(self) -> np.ndarray:
        """True (m,) for cells that have collapsed to triangles or tetrahedra."""
        corners = np.sort(self.cells, axis=1)
        distinct = 1 + (corners[:, 1:] != corners[:, :-1]).sum(axis=1)
        simplexes: np.ndarray = distinct == self.points.shape[1] + 1
        return simplexes

    @property
    def pressure_sizes(self) -> np.ndarray:
        """Length (k,) [m] of each pressure: the root of its area or volume.

        It is zero for nodes outside the region.
        """
        points = self.pressure_points
        volume = signed_volumes(self.points, self.cells)[:, None] / points.shape[1]
        return nodal_sums(points, volume, self.pressure_count) ** (1.0 / self.points.shape[1])

    @cached_property
    def volumes(self) -> np.ndarray:
        """Reference volume of each element (m,) [m^3]."""
        return self.geometry.volumes(self.points, self.cells)

    @cached_property
    def gradients(self) -> np.ndarray:
        """Mean of grad N_a over each element's reference volume (m, corners, d) [1/m].

        In memory the elements of each component are contiguous, for fast sums over elements.
        """
        found = self.geometry.gradients(self.points, self.cells)
        return np.ascontiguousarray(found.transpose(1, 2, 0)).transpose(2, 0, 1)

    @property
    def nodal_volumes(self) -> np.ndarray:
        """Reference volume (n,) [m^3] of the elements around each of the body's nodes."""
        return nodal_sums(self.cells, self.volumes[:, None], len(self.points))

    def deformation(self, x: np.ndarray) -> np.ndarray:
        """Return F (m, 3, 3) with the body's nodes at x (n, d) [m]; zz is out of plane."""
        d, hoop = self.geometry.dimension, self.geometry.hoop
        F = np.zeros((len(self.cells), 3, 3))
        F[:, 2, 2] = 1.0 if hoop is None else hoop.stretch(self.points, self.cells, x)
        F[:, :d, :d] = np.einsum("eai,eaj->eij", x[self.cells], self.gradients)
        return F


def joined_regions(regions: Sequence[Region], points: np.ndarray) -> list[Region]:
    """Return the regions of a model, merged across bodies.

    Regions with the same material, geometry and cell set are merged, so that kernels are compiled
    once and not for each body.

    points (n, d) [m]: of all nodes. Nodes that lie between those of joined bodies belong to no
    element of the region, as do a body's nodes outside a region.
    """
    return [_joined([regions[k] for k in alike], points) for alike in alike_regions(regions)]


def alike_regions(regions: Sequence[Region]) -> list[list[int]]:
    """Return the numbers of the regions that `joined_regions` merges, group by group."""
    kinds: dict[Hashable, list[int]] = {}
    for number, region in enumerate(regions):
        kind = (region.geometry, region.material, region.cell_set)
        kinds.setdefault(kind, []).append(number)
    return list(kinds.values())


def _joined(alike: Sequence[Region], points: np.ndarray) -> Region:
    first = alike[0]
    if len(alike) == 1:
        return first
    return replace(
        first,
        body=" + ".join(r.body for r in alike),
        points=points[first.nodes.start : alike[-1].nodes.stop],
        cells=np.concatenate([r.cells + r.first_node - first.first_node for r in alike]),
        numbers=np.concatenate([r.numbers for r in alike]),
    )


# -------------------------------------------------------------------------------------------------
# Element results in numpy: volume ratio, stretch, von Mises stress, nodal pressure.


@dataclass(frozen=True)
class ElementMeasures:
    """Results of the elements of a region.

    Per element (m,): J [-], largest principal stretch [-], I1_bar [-], von Mises stress [Pa] and
    shear stiffness [Pa] as in `Law.shear_stiffness` (law alone).

    nodal_pressure (n,) [Pa]: -kappa (J_a - 1), J_a of all elements around a node, positive in
    compression; NaN outside the region. Where elements have one pressure each it is their mean.
    """

    J: np.ndarray
    stretch: np.ndarray
    I1_bar: np.ndarray
    von_mises: np.ndarray
    shear_stiffness: np.ndarray
    nodal_pressure: np.ndarray


def measure_elements(
    region: Region, x: np.ndarray, peak_energy: np.ndarray | float = 0.0
) -> ElementMeasures:
    """Return the results of a region's elements with its body's nodes at x (n, d) [m].

    peak_energy (m,) [J/m^3]: largest energy density so far of a material that softens.
    """
    volume, cells, material = region.volumes, region.cells, region.material
    # A failed run is measured too: places that are no numbers give measures that are none.
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        F = region.deformation(x)
        J = np.linalg.det(F)
        b = np.einsum("eij,ekj->eik", F, F)
        principal = principal_values(b)
        b_bar = (np.abs(J) ** (-2.0 / 3.0))[:, None] * principal
        # tau / J is the deviator of the Cauchy stress.
        tau = material.stress(b_bar, peak_energy)
        von_mises = np.sqrt(1.5 * (tau**2).sum(axis=1)) / np.abs(J)
        shear_stiffness = material.law.shear_stiffness(b_bar)
        stretch = np.sqrt(principal[:, 0])
        share = 1.0 / cells.shape[1]
        current = nodal_sums(cells, (J * volume * share)[:, None], len(x))
        rest = nodal_sums(cells, (volume * share)[:, None], len(x))
        pressure = -material.bulk_modulus * (current / rest - 1.0)
    return ElementMeasures(J, stretch, b_bar.sum(axis=1), von_mises, shear_stiffness, pressure)


def cauchy_stress(
    region: Region, x: np.ndarray, peak_energy: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return the Cauchy stress (m, 6) [Pa] of a region's elements: xx, yy, zz, xy, yz, zx.

    x (n, d) [m]: positions of the body's nodes; peak_energy: as in `measure_elements`. The stress
    is that of the law and of the mean of the nodal pressures, without Maxwell branches; NaN where
    the position of a node is NaN.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        F = region.deformation(x)
        J = np.linalg.det(F)
        b = np.nan_to_num(np.einsum("eij,ekj->eik", F, F), posinf=0.0, neginf=0.0)
        squares, axes = np.linalg.eigh(b)
        b_bar = (np.abs(J) ** (-2.0 / 3.0))[:, None] * squares
        tau = region.material.stress(b_bar, peak_energy)
        pressure = measure_elements(region, x).nodal_pressure[region.cells].mean(axis=1)
        stress = np.einsum("eik,ek,ejk->eij", axes, tau / J[:, None], axes)
    stress -= pressure[:, None, None] * np.eye(3)
    return stress[:, [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]


def principal_values(tensors: np.ndarray) -> np.ndarray:
    """Return the eigenvalues (m, 3), falling, of symmetric tensors (m, 3, 3).

    In closed form (Smith 1961, Comm. ACM 4:168); numpy's solver takes fifty times as long on many
    small matrices. NaN where a tensor contains NaN. Where two eigenvalues are equal each keeps
    half the digits (the arc cosine near 1), their sum and product all.
    """
    mean = np.trace(tensors, axis1=1, axis2=2) / 3.0
    deviator = tensors - mean[:, None, None] * np.eye(3)
    size = np.sqrt((deviator**2).sum(axis=(1, 2)) / 6.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        half_determinant = np.where(size > 0.0, np.linalg.det(deviator) / (2.0 * size**3), 0.0)
    angle = np.arccos(np.clip(half_determinant, -1.0, 1.0)) / 3.0
    angles = angle[:, None] - np.array([0.0, 2.0, -2.0]) * np.pi / 3.0
    return mean[:, None] + 2.0 * size[:, None] * np.cos(angles)
