"""Upper bound of the stiffness of a whole model, as the matrix M^-1/2 K M^-1/2 on nodal vectors.

Where masses are scaled (compute/mass_scaling.py), the matrix is R M^-1/2 K M^-1/2 R with R the
inverse root of M^-1/2 M' M^-1/2.

Where nodes are tied to facets (structures/ties.py), u = T q and the stiffness of the independent
components q is T^T K T. K is scaled by 1/sqrt(m) of each node; m of a tied node is the mass that a
force on it has to move. The matrix is P^T (M^-1/2 K M^-1/2) P with P = M^1/2 T M^-1/2.

K = G^T diag(V_a (kappa + 2 eta_a / dt)) G      volume: pressures, G_a = dJ_a/dx, with their bulk
                                                viscosity eta_a
  + sum_e V_e (material |Grad u|^2 + spatial |grad u|^2)  shape, initial stress: element_bound.py
                                                with d^2F_zz in elements with hoop strain
  + sum_j B_j (x) 1                             structures: Structure.stiffness_bound
  + diag(k_a)                                   contact: contact_bound.py
  + sum_c (-dp/dV) dV/dx (x) dV/dx              chambers, with the most content of their profile
  + sum_c b_c (x) b_c                           pulled cables: Structure.stiffness_roots.
Nodes that are tied to a rigid body count as free, with some of its mass (contact_bound.py). Its
contacts and springs are not part of this matrix. Fixed and prescribed components do not
move. The load stiffness of a pressure p is left out: some p / kappa of the contact stiffness.
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from softsim.elements.geometry import Geometry, Region
from softsim.mesh.mesh import incidence
from softsim.model import Model
from softsim.solver.contact_bound import ContactBound, ContactStiffness, tied_mass
from softsim.solver.element_bound import ALLOWED_STRAIN, ElementStiffness, RegionStiffness
from softsim.structures.structure import NodalStiffness


@dataclass(frozen=True)
class ScaledStiffness:
    """M^-1/2 K M^-1/2 [1/s^2] at one configuration and one step.

    gradient (p + r, n d): V_a G [m^2], then rows [(N/m)^1/2] whose squares are added, of the
    elements with hoop strain; back: its transpose, with the same data. volume_stiffness (p,)
    [N/m^5]: (kappa + 2 eta_a / dt) / V_a. shape (n, n) [N/m]: shape and initial stress, the same
    for every component. contact (n d,) [1/s^2]. chambers, structures: vectors (n d,) [1/s] whose
    squares are added; structures have their kind beside it. inverse_sqrt_mass (n d,): M^-1/2.
    slowing (n d, n d): R, or None. following (n d, n d): P, or None.
    """

    gradient: sp.csr_matrix
    back: sp.csc_matrix
    volume_stiffness: np.ndarray
    shape: sp.csr_matrix
    contact: np.ndarray
    chambers: list[np.ndarray]
    structures: list[tuple[str, np.ndarray]]
    inverse_sqrt_mass: np.ndarray
    slowing: sp.csr_matrix | None
    following: sp.csr_matrix | None

    def product(self, v: np.ndarray) -> np.ndarray:
        """Return the matrix times a vector (n d,)."""
        return self.reduced(self._product_of_own_masses(self.motion(v)))

    def motion(self, v: np.ndarray) -> np.ndarray:
        """Return P R v: the displacement of a vector v of the matrix, times M^1/2."""
        slowed = v if self.slowing is None else self.slowing @ v
        return slowed if self.following is None else self.following @ slowed

    def reduced(self, f: np.ndarray) -> np.ndarray:
        """Return R P^T f: the forces, times M^-1/2, on the independent components."""
        gathered = f if self.following is None else self.following.T @ f
        return gathered if self.slowing is None else self.slowing @ gathered

    def _product_of_own_masses(self, v: np.ndarray) -> np.ndarray:
        u = self.inverse_sqrt_mass * v
        strained = self.gradient @ u
        strained[: len(self.volume_stiffness)] *= self.volume_stiffness
        force = self.back @ strained
        force += (self.shape @ u.reshape(self.shape.shape[0], -1)).ravel()
        result = self.inverse_sqrt_mass * force
        result += self.contact * v
        for whole in (*self.chambers, *(root for _, root in self.structures)):
            result += np.einsum("i,i", whole, v) * whole  # not BLAS: see lanczos (stable_step.py)
        return result

    def pressures(self, v: np.ndarray) -> np.ndarray:
        """Return (kappa + 2 eta_a / dt) dJ_a (p,) [Pa] for the displacement M^-1/2 v [m]."""
        volumes = (self.gradient @ (self.inverse_sqrt_mass * v))[: len(self.volume_stiffness)]
        return self.volume_stiffness * volumes

    def chamber_frequency(self) -> float:
        """Return an upper bound of omega^2 [1/s^2] of the chambers alone."""
        return float(sum((self.reduced(c) ** 2).sum() for c in self.chambers))

    def structure_frequencies(self) -> dict[str, float]:
        """Return an upper bound of omega^2 [1/s^2] of the roots of each kind of structure alone."""
        return {
            kind: float(sum((self.reduced(b) ** 2).sum() for k, b in self.structures if k == kind))
            for kind, _ in self.structures
        }


class ModelStiffness:
    """Stiffness of a model in any configuration, with its sparsity pattern and masses.

    moving (n d,): True for independent components. inverse_sqrt_mass (n d,): 1/sqrt(m) of all that
    move, else 0. pressures: for each region the numbers (k, m) of its elements' pressures, of p in
    all. mobility (n,): acceleration of a node under a force on it alone, times m over that force
    [-].
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self.regions = [RegionStiffness(r, model.bulk_viscosity) for r in model.regions]
        n, d = model.points.shape
        self.contact = ContactStiffness(model)
        self.inverse_sqrt_mass = inverse_sqrt_mass(model).ravel()
        self.moving = self.inverse_sqrt_mass > 0.0
        self.moving.reshape(n, d)[model.ties.nodes] = False
        self.following = following(model, self.inverse_sqrt_mass)
        self.slowing, self.mobility = None, np.ones(n)
        if model.mass_scaling is not None:
            self.slowing = model.mass_scaling.scaled(model.mass, d, -0.5)
            self.mobility = model.mass_scaling.mobility(model.mass)
            self.mobility[model.ties.nodes] = 1.0  # at most
        members = [np.unique(r.pressed) for r in self.regions]
        starts = np.cumsum([0, *map(len, members)])
        self.pressures = [
            start + np.searchsorted(own, r.pressed)
            for r, own, start in zip(self.regions, members, starts, strict=False)
        ]
        p = int(starts[-1])
        of_members = [
            (r.pressure_volumes[own], np.full(len(own), r.bulk_modulus), r.bulk_viscosity[own])
            for r, own in zip(self.regions, members, strict=True)
        ]
        self.pressure_volumes, self.bulk_modulus, self.bulk_viscosity = (
            np.concatenate(parts) for parts in zip(*of_members, strict=True)
        )

        movers = [r.movers + r.region.first_node for r in self.regions]
        stencils = [*movers, *(bound.nodes for bound in self.structure_bounds(model.points))]
        of_volume, self.pair_of_volume = pairs(self.pressures, movers, (p, n))
        self.shape, self.pair_of_shape = pairs(stencils, stencils, (n, n))

        around = [m[:, r.around].T for m, r in zip(movers, self.regions, strict=True)]
        rows = [sp.csr_matrix((0, n * d)), *(hoop_rows(nodes, n, d) for nodes in around)]
        self.gradient = sp.vstack([of_components(of_volume, d), *rows], format="csr")

    def elements(self, x: np.ndarray) -> list[ElementStiffness]:
        """Return the element stiffness of each region with all nodes at x (n, d) [m]."""
        return [r.at(x[r.region.nodes]) for r in self.regions]

    def structure_bounds(self, x: np.ndarray) -> list[NodalStiffness]:
        """Return the stiffness of all structures with all nodes at x (n, d) [m]."""
        return [b for s in self.model.all_structures for b in s.stiffness_bound(x)]

    def at(self, elements: list[ElementStiffness], x: np.ndarray) -> ScaledStiffness:
        """Return the matrix without contact and damping, with all nodes at x (n, d) [m]."""
        d = x.shape[1]
        of_structures = [bound.values for bound in self.structure_bounds(x)]
        shape = flat([*(e.shape_stiffness for e in elements), *of_structures])
        # (r, movers, d), as the rows have them.
        hoop = flat([np.moveaxis(e.hoop_root, -1, 0) for e in elements])
        # dJ_a, V_a J_a being a sum of the elements' shares: that of all pressures of one alike.
        alike = [
            np.broadcast_to(e.volume_gradient, (len(p), *e.volume_gradient.shape))
            for e, p in zip(elements, self.pressures, strict=True)
        ]
        G = np.stack(
            [np.bincount(self.pair_of_volume, flat([a[:, :, i] for a in alike])) for i in range(d)]
        )
        gradient = with_values(self.gradient, np.concatenate([G.T.ravel(), hoop]))
        return ScaledStiffness(
            gradient,
            gradient.T,
            self.bulk_modulus / self.pressure_volumes,
            with_values(self.shape, np.bincount(self.pair_of_shape, shape)),
            np.zeros(x.size),
            chamber_vectors(self.model, self.inverse_sqrt_mass, x),
            [
                (s.kind, root.ravel() * self.inverse_sqrt_mass)
                for s in self.model.all_structures
                for root in s.stiffness_roots(x)
            ],
            self.inverse_sqrt_mass,
            self.slowing,
            self.following,
        )

    def damped(
        self, undamped: ScaledStiffness, contact: ContactBound, dt: float
    ) -> ScaledStiffness:
        """Return the matrix with contact and with (2 / dt) C of bulk viscosity at the step dt [s].

        contact: at that step, with its dashpots.
        """
        modulus = self.bulk_modulus + 2.0 * self.bulk_viscosity / dt
        return replace(
            undamped,
            volume_stiffness=modulus / self.pressure_volumes,
            contact=(contact.nodes[:, None] * self.inverse_mass).ravel(),
        )

    @property
    def inverse_mass(self) -> np.ndarray:
        """1/m (n, d) [1/kg] of all components that move, else 0."""
        return self.inverse_sqrt_mass.reshape(len(self.mobility), -1) ** 2

    def hardest_press(self, contact: ContactBound) -> float:
        """Return the largest omega^2 [1/s^2] of a node in contact with rigid bodies."""
        return float((contact.pressed[:, None] * self.inverse_mass).max())

    def hardest_hit(self, contact: ContactBound) -> float:
        """Return the largest omega^2 [1/s^2] of a node on impact, with that of nodes tied to it."""
        hits = self.model.ties.handed_over(contact.hits)
        return float((hits[:, None] * (self.mobility[:, None] * self.inverse_mass)).max())


def pairs(
    first: list[np.ndarray], second: list[np.ndarray], shape: tuple[int, int]
) -> tuple[sp.csr_matrix, np.ndarray]:
    """Return the pattern of pairs that share an element, and the entry number of each pair.

    Pairs consist of a number of `first` (a, m) and one of `second` (b, m) of each region, smaller
    than `shape`. The pattern is sparse with an entry for each pair; the entry numbers (a b m,) of
    all regions follow one another.
    """
    of_first, of_second = (
        sp.vstack([incidence(n.T, count) for n in numbers], format="csr")
        for numbers, count in zip((first, second), shape, strict=True)
    )
    pattern = of_first.T.tocsr() @ of_second
    pattern.sort_indices()
    # Wide, for the square of the number of nodes.
    rows = np.repeat(np.arange(shape[0], dtype=np.int64), np.diff(pattern.indptr))
    keys = rows * shape[1] + pattern.indices
    entries = [
        np.searchsorted(keys, i.astype(np.int64) * shape[1] + j).astype(np.int32)
        for f, s in zip(first, second, strict=True)
        for i in f
        for j in s
    ]
    return pattern, np.concatenate(entries)


def of_components(pattern: sp.csr_matrix, d: int) -> sp.csr_matrix:
    """Return the pattern of components (rows, n d) for a pattern of nodes (rows, n)."""
    columns = (pattern.indices[:, None] * d + np.arange(d, dtype=np.int32)).ravel()
    parts = (np.ones(len(columns)), columns, pattern.indptr * d)
    return sp.csr_matrix(parts, shape=(pattern.shape[0], pattern.shape[1] * d))


def hoop_rows(nodes: np.ndarray, n: int, d: int) -> sp.csr_matrix:
    """Return a pattern (r, n d) with the components of the nodes (r, k) of each row."""
    starts = np.arange(0, nodes.size + 1, max(1, nodes.shape[1]))
    rows = sp.csr_matrix((np.ones(nodes.size), nodes.ravel(), starts), (len(nodes), n))
    return of_components(rows, d)


def flat(of_regions: list[np.ndarray]) -> np.ndarray:
    """Return all values in one array, region by region."""
    if len(of_regions) == 1:  # a concatenation would copy it
        return of_regions[0].ravel()
    return np.concatenate([values.ravel() for values in of_regions])


def with_values(pattern: sp.csr_matrix, values: np.ndarray) -> sp.csr_matrix:
    """Return the matrix of a pattern with these values of its entries."""
    return sp.csr_matrix((values, pattern.indices, pattern.indptr), shape=pattern.shape)


def inverse_sqrt_mass(model: Model) -> np.ndarray:
    """Return 1/sqrt(m) (n, d) of the components that move, 0 for the others.

    If none moves, all count as moving, so that a step can be computed. m of a tied node is the mass
    that a force on it has to move.
    """
    own_mass = np.where(model.mass > 0.0, model.mass, np.inf)  # corners of outlines have none
    moves, mass = model.is_free.copy(), own_mass.copy()
    for body in model.rigid_bodies:
        tied = body.tied[model.mass[body.tied] > 0.0]
        moves[tied] = True
        mass[tied] += tied_mass(body, model.points, tied)  # infinite if the body is held
    found = moves / np.sqrt(mass)[:, None]
    found[model.ties.nodes] = np.sqrt(
        np.einsum("kc,kcd->kd", model.ties.weights**2, found[model.ties.corners] ** 2)
    )
    return found if found.any() else np.ones_like(found) / np.sqrt(own_mass)[:, None]


def following(model: Model, inverse_sqrt_mass: np.ndarray) -> sp.csr_matrix | None:
    """Return P = M^1/2 T M^-1/2 (n d, n d), or None for a model without tied nodes.

    Rows of tied nodes have the length 1. inverse_sqrt_mass (n d,): the result of the function of
    this name.
    """
    if not len(model.ties.nodes):
        return None
    n, d = model.points.shape
    T = sp.kron(model.ties.matrix(n), sp.identity(d))
    root_mass = np.divide(
        1.0, inverse_sqrt_mass, out=np.zeros(n * d), where=inverse_sqrt_mass > 0.0
    )
    return (sp.diags(root_mass) @ T @ sp.diags(inverse_sqrt_mass)).tocsr()


def chamber_vectors(model: Model, inverse_sqrt_mass: np.ndarray, x: np.ndarray) -> list[np.ndarray]:
    """Return sqrt(-dp/dV) M^-1/2 dV/dx (n d,) [1/s] of each chamber with volume stiffness.

    These are chambers whose pressure falls with their volume, with the most content of their
    profile. inverse_sqrt_mass (n d,): M^-1/2.
    """
    vectors = []
    for load in model.pressures:
        stiffness = load.source.stiffness(load.volume(x))
        if stiffness > 0.0:
            gradient = volume_gradient(load.geometry, load.facets, x)
            vectors.append(np.sqrt(stiffness) * (gradient.ravel() * inverse_sqrt_mass))
    return vectors


def volume_gradient(geometry: Geometry, facets: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return dV/dx (n, d) [m^2] of the volume that facets enclose: the forces per pressure."""
    gradient = np.zeros_like(x)
    np.add.at(gradient, facets, geometry.volume_gradient(x, facets))
    return gradient


# -------------------------------------------------------------------------------------------------
# Shape for which the stable step was estimated; near it, the estimate holds.
#
# The bound assumes contact at every node that may touch (contact_bound.py), and the most
# content that chambers ever have: it changes only if elements deform, or if nodes on outlines and
# surfaces come near a wall. A body that moves as a whole changes it through structures alone, whose
# lines may lead to other bodies. An element whose principal stretches have changed by the fraction
# e since the estimate has gradients of at most 1 / (1 - e) times those then, so that its stable
# step has fallen by about e, and by as much again if its law stiffens with strain.

# Growth of the measures of shape of a structure: the stiffness of a cable's joint grows with 1 + 4
# of its measure at most, the step with the root (structures/cable.py).
ALLOWED_GROWTH = 0.04


class ReferenceShape:
    """Shape of a model with all nodes at x (n, d) [m]."""

    def __init__(self, stiffness: ModelStiffness, x: np.ndarray) -> None:
        self.model, self.x = stiffness.model, x
        self.regions = [ReferenceRegion(region, x[region.nodes]) for region in self.model.regions]
        self.measures = [s.shape_measures(x) for s in self.model.all_structures]
        self.places = stiffness.contact.places(x)
        has_lines = any(structure is not self.model.ties for structure in self.model.all_structures)
        self.longest_motion = 0.5 * stiffness.contact.reach if has_lines else np.inf

    def is_near(self, x: np.ndarray) -> bool:
        """Return True if all nodes at x (n, d) [m] form a shape near this one.

        No element is strained relative to this shape by more than ALLOWED_STRAIN, no measure of a
        structure has grown by more than ALLOWED_GROWTH, the places on which the contact bound
        depends hold, and in a model with structures no node has moved by more than half the reach
        of contact in any component. False for NaN.
        """
        with np.errstate(invalid="ignore", over="ignore"):
            if not np.abs(x - self.x).max() <= self.longest_motion or not self.places.hold(x):
                return False
            for structure, measures in zip(self.model.all_structures, self.measures, strict=True):
                if not (structure.shape_measures(x) <= measures + ALLOWED_GROWTH).all():
                    return False
            return all(
                reference.largest_strain(x[reference.region.nodes]) <= ALLOWED_STRAIN
                for reference in self.regions
            )


class ReferenceRegion:
    """Elements of a region in a deformed shape, with the nodes at x (n, d) [m].

    gradients (corners, d, m) [1/m]: of the shape functions with respect to that shape. F_zz (m,).
    """

    def __init__(self, region: Region, x: np.ndarray) -> None:
        self.region, self.cells = region, np.ascontiguousarray(region.cells.T)
        F, d = region.deformation(x), region.geometry.dimension
        inverse = np.linalg.inv(F)[:, :d, :d]
        gradients = np.einsum("eai,eij->aje", region.gradients, inverse)
        self.gradients, self.F_zz = np.ascontiguousarray(gradients), F[:, 2, 2]

    def largest_strain(self, x: np.ndarray) -> float:
        """Return the largest norm of the Green strain (F^T F - I) / 2 relative to that shape.

        The nodes are now at x (n, d) [m]. Arrays have their elements last: numpy multiplies small
        matrices one by one, which is slower.
        """
        hoop, d = self.region.geometry.hoop, self.region.geometry.dimension
        corners = np.ascontiguousarray(x.T)[:, self.cells]
        F = (corners[:, :, None] * self.gradients).sum(axis=1)
        strain = 0.5 * (F[:, :, None] * F[:, None]).sum(axis=0)
        for i in range(d):
            strain[i, i] -= 0.5
        squares = (strain**2).sum(axis=(0, 1))
        if d == 2:
            F_zz = 1.0 if hoop is None else hoop.stretch(self.region.points, self.region.cells, x)
            squares += (0.5 * ((F_zz / self.F_zz) ** 2 - 1.0)) ** 2
        return float(np.sqrt(squares.max()))
