"""Thin layer on the surface of a body: a membrane with stiffness in stretching but not in bending.

The strain is constant on each straight edge of a section or triangle in space. With the places x_c
of its nodes and the gradients G_c of its shape functions along it at rest,
    F = sum_c x_c (x) G_c,   E = (F^T F - 1) / 2,
and the stress normal to it is zero, so that the law of St. Venant and Kirchhoff gives, in the plane
of the layer and with Young's modulus E_Y (Belytschko, Liu, Moran, Nonlinear Finite Elements, ch.
9),
    S = E_Y / (1 + nu) (E + nu / (1 - nu) tr(E) 1),   W = S : E / 2,   f_c = -V F S G_c,
V the volume at rest. A section has a second direction, hoop or out of plane, with the stretch 1 in
plane strain and, if revolved, mean radius over mean radius at rest, h = sum_c r_c / sum_c R_c.

The law is linear in E, so it is one of small strains: paper, thread, cloth, film. A strip that
is compressed to less than 0.58 of its length softens. The layer has no damping.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import Number, index_field, real_field, vector_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, Stage, Term
from softsim.elements.geometry import nodal_sums
from softsim.elements.solid import triangles_of
from softsim.rigid import RigidBodies
from softsim.scene.names import Names, in_mm
from softsim.scene.text import Keys
from softsim.structures.structure import NodalStiffness, Structure


@dataclass(frozen=True, eq=False)
class Layer(Structure):
    """Data of a layer.

    facets (m, c): edges or triangles, numbered in the model. gradients (m, c, k) [1/m]: G_c, k
    being 1 or 2. around (m,) [1/m]: 1 over the radius at rest of facets with hoop strain, else 0.
    volumes (m,) [m^3]. youngs_modulus [Pa], poisson_ratio [-]. masses (n,) [kg]: what it adds to
    each node of the model.
    """

    name: str
    facets: np.ndarray
    gradients: np.ndarray
    around: np.ndarray
    volumes: np.ndarray
    youngs_modulus: float
    poisson_ratio: float
    masses: np.ndarray
    kind: ClassVar[str] = "layer"

    @property
    def title(self) -> str:
        return f"layer '{self.name}'"

    def term(
        self, scenarios: Sequence["Layer"], nodes: Nodes, rigid_bodies: RigidBodies
    ) -> "LayerTerm":
        return LayerTerm(nodes, self)

    def nodal_mass(self, node_count: int) -> np.ndarray:
        return self.masses

    @property
    def drawn_facets(self) -> np.ndarray:
        return self.facets

    def description(self) -> dict[str, str]:
        mass = float(self.masses.sum())
        return {self.title: f"{len(self.facets)} facets, {mass * 1e3:.4g} g"}

    @property
    def lame(self) -> tuple[float, float]:
        """Constants lambda, that of plane stress, and mu [Pa] of S = lambda tr(E) 1 + 2 mu E."""
        E, nu = self.youngs_modulus, self.poisson_ratio
        return E * nu / (1.0 - nu**2), 0.5 * E / (1.0 + nu)

    @property
    def stiffest(self) -> float:
        """Largest S : E over E : E [Pa]; S over E of an edge without strain across it."""
        first, second = self.lame
        alone = self.gradients.shape[2] == 1 and not self.around.any()
        return first + 2.0 * second if alone else 2.0 * first + 2.0 * second

    def deformation(self, x: np.ndarray) -> np.ndarray:
        """Return F (m, d, k) with the model's nodes at x (n, d) [m]."""
        return np.einsum("mci,mck->mik", x[self.facets], self.gradients)

    def hoop(self, x: np.ndarray) -> np.ndarray:
        """Return the stretch (m,) in the second direction of a section."""
        return np.where(self.around > 0.0, self.around * x[self.facets][:, :, 0].mean(axis=1), 1.0)

    def stress(self, x: np.ndarray) -> np.ndarray:
        """Return S (m, 2, 2) [Pa]."""
        F, C = self.deformation(x), np.zeros((len(self.facets), 2, 2))
        C[:, 1, 1] = self.hoop(x) ** 2
        k = F.shape[2]
        C[:, :k, :k] = np.einsum("mip,miq->mpq", F, F)
        strain = 0.5 * (C - np.eye(2))
        first, second = self.lame
        trace = np.trace(strain, axis1=1, axis2=2)
        return first * trace[:, None, None] * np.eye(2) + 2.0 * second * strain

    def rest_stiffness(self, points: np.ndarray) -> sp.csr_matrix:
        """Return K (n d, n d) [N/m] at rest, with the nodes at points (n, d) [m].

        Without stress it is B^T D B, with E = B u.
        """
        (n, d), (m, c, k) = points.shape, self.gradients.shape
        F = self.deformation(points)
        B = np.zeros((m, 3, c, d))  # E_11, E_22, sqrt(2) E_12
        for row, (p, q) in enumerate([(0, 0), (1, 1), (0, 1)][: 2 * k - 1]):
            both = np.einsum("mi,mc->mci", F[:, :, p], self.gradients[:, :, q])
            both += np.einsum("mi,mc->mci", F[:, :, q], self.gradients[:, :, p])
            B[:, row] = both * (0.5 if p == q else np.sqrt(0.5))
        B[:, 1, :, 0] += np.where(self.around > 0.0, self.around / c, 0.0)[:, None]
        first, second = self.lame
        D = first * np.outer([1, 1, 0], [1, 1, 0]) + 2.0 * second * np.eye(3)
        blocks = np.einsum("m,mrai,rs,msbj->maibj", self.volumes, B, D, B)
        numbers = (self.facets[:, :, None] * d + np.arange(d)).reshape(m, c * d)
        rows, columns = np.broadcast_arrays(numbers[:, :, None], numbers[:, None, :])
        entries = (blocks.ravel(), (rows.ravel(), columns.ravel()))
        return sp.csr_matrix(entries, shape=(n * d, n * d))

    def stiffness_bound(self, x: np.ndarray) -> list[NodalStiffness]:
        """Return an upper bound of the stiffness of each facet with the nodes at x (n, d) [m].

        With a = grad u along the facet its second variation is V (dS : dE + S : a^T a), dE the
        symmetric part of F^T a. As |dE| <= |F^T a| <= lambda |a| with the largest stretch lambda,
        and dS : dE is at most D dE : dE,
            V (D lambda^2 + S+) |a|^2,   S+ the largest principal stress if it is tensile, else 0.
        The hoop direction adds V (D h^2 + S+) (dr / R)^2.
        """
        F, hoop = self.deformation(x), self.hoop(x)
        pull = np.maximum(np.linalg.eigvalsh(self.stress(x))[:, 1], 0.0)
        stretched = np.linalg.eigvalsh(np.einsum("mip,miq->mpq", F, F))[:, -1]
        along = self.volumes * (self.stiffest * stretched + pull)
        across = self.volumes * (self.stiffest * hoop**2 + pull)
        corners = self.facets.shape[1]
        radial = np.broadcast_to(self.around / corners, (corners, len(pull)))
        values = along * np.einsum("mak,mbk->abm", self.gradients, self.gradients)
        values += across * radial[:, None] * radial
        return [NodalStiffness(self.title, self.facets.T, values)]


class LayerTerm(Term):
    """Force term of a layer."""

    def __init__(self, nodes: Nodes, layer: Layer) -> None:
        self.nodes, self.count = nodes, Number(len(layer.facets))
        self.corner_count, self.directions = layer.gradients.shape[1:]
        self.goes_around = bool(layer.around.any())
        self.corner = index_field(layer.facets)
        self.gradient = [vector_field(layer.gradients[:, c]) for c in range(self.corner_count)]
        self.around, self.volume = real_field(layer.around), real_field(layer.volumes)
        self.lame = real_field(np.array(layer.lame))
        self.first_slot = nodes.corner_forces.reserve(layer.facets)

    def passes(self) -> dict[Stage, list[Pass]]:
        return {Stage.MOVE: [Pass("layers", int(self.count), (self.stretch,))]}

    @ti.func
    def deformation(self, s, i):
        """Return F of facet i."""
        F = ti.Matrix.zero(backend.real, self.nodes.dimension, self.directions)
        for c in ti.static(range(self.corner_count)):
            F += self.nodes.position[s, self.corner[i, c]].outer_product(self.gradient[c][i])
        return F

    @ti.func
    def hoop(self, s, i):
        """Return the stretch of facet i in the second direction of a section."""
        h = ti.cast(1.0, backend.real)
        if ti.static(self.goes_around):
            h = 0.0
            for c in ti.static(range(self.corner_count)):
                share = self.around[i] / ti.static(float(self.corner_count))
                h += share * self.nodes.position[s, self.corner[i, c]][0]
        return h

    @ti.func
    def strain(self, F, h):
        """Return E (2, 2)."""
        E = ti.Matrix([[-0.5, 0.0], [0.0, 0.5 * (h * h - 1.0)]])
        if ti.static(self.directions == 2):
            E[1, 1] = -0.5
        C = F.transpose() @ F
        for p, q in ti.static(ti.ndrange(self.directions, self.directions)):
            E[p, q] += 0.5 * C[p, q]
        return E

    @ti.func
    def stress(self, E):
        """Return S (2, 2) [Pa]."""
        S = 2.0 * self.lame[1] * E
        pressed = self.lame[0] * E.trace()
        S[0, 0] += pressed
        S[1, 1] += pressed
        return S

    @ti.func
    def stretch(self, s, i, t, dt):
        """Write the forces of facet i on its nodes."""
        F, h = self.deformation(s, i), self.hoop(s, i)
        S, V = self.stress(self.strain(F, h)), self.volume[i]
        for c in ti.static(range(self.corner_count)):
            force = ti.Vector.zero(backend.real, self.nodes.dimension)
            for p, q in ti.static(ti.ndrange(self.directions, self.directions)):
                for k in ti.static(range(self.nodes.dimension)):
                    force[k] -= V * F[k, p] * S[p, q] * self.gradient[c][i][q]
            if ti.static(self.goes_around):
                force[0] -= V * S[1, 1] * h * self.around[i] / ti.static(float(self.corner_count))
            self.nodes.corner_forces.write(s, self.first_slot + self.corner_count * i + c, force)

    @ti.func
    def stored_energy(self, s, part):
        """Return the energy of stretching [J]."""
        energy = ti.cast(0.0, backend.real)
        for i in range(self.count.first(part), self.count.first(part + 1)):
            E = self.strain(self.deformation(s, i), self.hoop(s, i))
            S = self.stress(E)
            for p, q in ti.static(ti.ndrange(2, 2)):
                energy += 0.5 * self.volume[i] * S[p, q] * E[p, q]
        return energy


# -------------------------------------------------------------------------------------------------
# Layers of a scene.


def layers(names: Names, points: np.ndarray, is_free: np.ndarray) -> list[Layer]:
    """Return the layers of a scene, with the nodes at points (n, d) [m]."""
    return [layer(names, name, points) for name in names.scene.layers]


def layer(names: Names, name: str, points: np.ndarray) -> Layer:
    """Return a layer of a scene, with the nodes at points (n, d) [m].

    Layers on the same facets add up. Raises SceneError in a ring section, and on the axis.
    """
    data, keys = names.scene.layers[name], ("layers", name)
    if names.is_ring_section:
        raise names.loaded.error(
            keys,
            "a ring_section cannot have a layer: the hoop stretch at its surface is not defined",
            "write formulation plane_strain, axisymmetric or solid",
        )
    facets, areas = layer_facets(names, name)
    masses = nodal_sums(facets, data.density * data.thickness * areas, len(points))
    if names.dimension == 3:
        facets, share = triangles_of(facets)
        gradients, areas = on_triangles(points[facets])
        whole = areas > 0.0  # not what is left of a triangle among quadrilaterals
        facets, gradients, areas = facets[whole], gradients[whole], share * areas[whole]
    else:
        gradients, areas = on_edges(points[facets]), areas.sum(axis=1)
    around = np.zeros(len(facets))
    if names.is_axisymmetric:
        radius = points[facets][:, :, 0].mean(axis=1)
        refuse_axis(names, data.facets, points, facets, radius, (*keys, "facets"))
        around = 1.0 / radius
    return Layer(
        name=name,
        facets=facets,
        gradients=gradients,
        around=around,
        volumes=data.thickness * areas,
        youngs_modulus=data.youngs_modulus,
        poisson_ratio=data.poisson_ratio,
        masses=masses,
    )


def layer_facets(names: Names, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the facets (m, corners) of a layer, and their corners' areas (m, corners) [m^2]."""
    data = names.scene.layers[name]
    facets = names.facet_set(data.facets, ("layers", name, "facets"))
    areas = np.zeros(facets.shape)
    for body, region, chosen in names.bounded(facets):
        of_body = facets[chosen] - body.first_node
        areas[chosen] = region.geometry.corner_areas(body.mesh.points, of_body)
    return facets, areas


def on_edges(ends: np.ndarray) -> np.ndarray:
    """Return gradients (m, 2, 1) [1/m] along edges between these ends (m, 2, d) [m]."""
    inverse = 1.0 / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return np.stack([-inverse, inverse], axis=1)[:, :, None]


def on_triangles(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return gradients (m, 3, 2) [1/m] in the plane of triangles, and their areas (m,) [m^2].

    The corners are (m, 3, 3) [m]; the directions are the first side and across it. The gradients of
    a flat triangle are zero.
    """
    e, f = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    length = np.linalg.norm(e, axis=1)
    double = np.linalg.norm(np.cross(e, f), axis=1)
    whole = double > 1e-12 * (length**2 + (f**2).sum(axis=1))
    length, double = np.where(whole, length, 1.0), np.where(whole, double, 1.0)
    along, height = (e * f).sum(axis=1) / length, double / length
    zero = np.zeros(len(e))
    second = np.stack([1.0 / length, -along / double], axis=1)
    third = np.stack([zero, 1.0 / height], axis=1)
    gradients = np.stack([-second - third, second, third], axis=1)
    return gradients, np.where(whole, 0.5 * double, 0.0)


def refuse_axis(
    names: Names, reference: str, points: np.ndarray, facets: np.ndarray, radius: np.ndarray,
    keys: Keys,
) -> None:  # fmt: skip
    """Raise SceneError if a facet lies on the axis, where it would have no circumference."""
    on_axis = np.flatnonzero(radius < 1e-12)
    if len(on_axis):
        raise names.loaded.error(
            keys,
            f"the facet of '{reference}' at {in_mm(points[facets[on_axis[0]]].mean(axis=0))} lies "
            "on the axis",
            "leave it out of the set: a facet on the axis is not part of the surface of the body",
        )
