"""Hourglass modes of quadrilaterals and hexahedra: nodal motions that no linear field has.

With xi_i from -1 to 1 and vectors g_i and h_k, the position of a point of an element is
    x = x_0 + sum g_i xi_i + sum h_k phi_k,
    phi = xi_1 xi_2 in the plane; xi_2 xi_3, xi_3 xi_1, xi_1 xi_2, xi_1 xi_2 xi_3 in space.
One point integrates what is linear in x: with the mean gradient of the element
    F D_i = d_i = g_i + sum_k N_ki h_k,    D_i at rest.
The remainder of the modes after subtraction of the linear field is zero in every linear field, for
any shape of the element (Flanagan and Belytschko 1981, Int. J. Numer. Meth. Engng 17:679-706):
    h~_k = h_k - sum_i P_ki d_i.
Its components along the element's present directions, e_i = d_i / |d_i|,
    q_ki = e_i . h~_k,
do not change when the element turns. They store the energy of the bending and twisting that they
stand for, as a plate has it, whose fibres may strain freely across it: nothing locks, neither in
shear nor in volume (assumed strain, ASQBI: Belytschko and Bindeman 1991, Comput. Meth. Appl. Mech.
Engng 88:311-340; 1993, 105:225-260). There is no user-defined constant.

With the energy U(q, d) and p = dU/dq the forces on the nodes follow from
    Q_k = dU/dh~_k = sum_i p_ki e_i,
    T_i = dU/dd_i = sum_k p_ki (h~_k - q_ki e_i) / |d_i|,
added to those of the stress, T_i = V S^ij d_j, as what is conjugate to g_i and h_k:
    G_i = T_i - sum_k P_ki Q_k,    H_k = Q_k + sum_i N_ki G_i.

The moduli are those of the law at rest. U is written in amplitudes y, linear in q, as
    U = 1/2 mu y^2 + sum_b 1/2 mu_b (y - a_b)^2,    da_b/dt = (y - a_b) / tau_b:
each Maxwell branch has its own spring that relaxes, and dissipates the integral of
mu_b (y - a_b) da_b, summed by the trapezoidal rule as in elements/material_points.py.
"""

from dataclasses import dataclass, replace

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import Number, lane_field, real_field
from softsim.elements.geometry import PARENT_CORNERS, Region
from softsim.elements.material_points import MaterialPoints
from softsim.elements.one_point import OnePointElements
from softsim.materials.material import Material
from softsim.mesh.mesh import batches

# Of the corners of hexahedra i and j of each k.
CYCLIC = ((1, 2), (2, 0), (0, 1))


@dataclass(frozen=True, eq=False)
class HourglassModes:
    """Constant data of the hourglass modes of the elements of a region.

    material: of the region. volumes (m,) [m^3]: at rest.
    basis (m, d, d) [m]: D_i, row by row. directions (d, corners), modes (k, corners): xi_i and
    phi_k of the nodes. lean (m, k, d): N_ki. share (m, k, d): P_ki.
    """

    material: Material
    volumes: np.ndarray
    basis: np.ndarray
    directions: np.ndarray
    modes: np.ndarray
    lean: np.ndarray
    share: np.ndarray

    @property
    def of_edges(self) -> np.ndarray:
        """delta_i (m, d, corners): d_i = sum_a delta_ia x_a."""
        leaning = np.einsum("mki,ka->mia", self.lean, self.modes)
        return (self.directions + leaning) / self.modes.shape[1]

    @property
    def of_modes(self) -> np.ndarray:
        """gamma_k (m, k, corners): h~_k = sum_a gamma_ka x_a."""
        share = np.einsum("mki,mia->mka", self.share, self.of_edges)
        return self.modes / self.modes.shape[1] - share

    def of(self, batch: slice) -> "HourglassModes":
        """Return the data of some of the elements."""
        return replace(
            self,
            volumes=self.volumes[batch],
            basis=self.basis[batch],
            lean=self.lean[batch],
            share=self.share[batch],
        )


def hourglass_modes(region: Region) -> HourglassModes:
    """Return the hourglass modes of a region of quadrilaterals or hexahedra."""
    at_corner = PARENT_CORNERS[region.cells.shape[1]]
    corners, d = at_corner.shape
    directions = at_corner.T
    others = [np.delete(directions, i, axis=0).prod(axis=0) for i in range(d)]
    all_of_them = directions.prod(axis=0)
    modes = np.stack([all_of_them] if d == 2 else [*others, all_of_them])
    # In another order of memory einsum would round otherwise, and with it all forces.
    gradients = np.ascontiguousarray(region.gradients)
    dual = np.einsum("ia,maj->mij", directions, gradients)
    basis = np.linalg.inv(dual).transpose(0, 2, 1)
    lean = np.einsum("ka,maj,mij->mki", modes, gradients, basis)
    at_rest = np.einsum("ka,maj->mkj", modes, region.points[region.cells]) / corners
    share = np.einsum("mkj,mij->mki", at_rest, dual)
    return HourglassModes(region.material, region.volumes, basis, directions, modes, lean, share)


def fibre_scales(modes: HourglassModes) -> np.ndarray:
    """Return y_i / q_i (m, 2) [m^(1/2)] of quadrilaterals: sqrt(V/3 E'/mu) / |D_i|.

    The modulus in plane strain is E' = 4 mu (kappa + mu/3) / (kappa + 4 mu/3).
    """
    mu, kappa = modes.material.law.initial_shear_modulus, modes.material.bulk_modulus
    modulus = 4.0 * (kappa + mu / 3.0) / (kappa + 4.0 / 3.0 * mu)
    root = np.sqrt(modulus * modes.volumes / 3.0)
    scales: np.ndarray = root[:, None] / np.linalg.norm(modes.basis, axis=2)
    return scales


def plate_factors(modes: HourglassModes, k: int) -> np.ndarray:
    """Return sqrt(V/3 / mu) L (m, 3, 3), upper triangular, of plate k of hexahedra.

    The plate bends along xi_k; the factors are y over its strains E_ii, E_jj, 2 E_ij
    (elements/solid.py).
    """
    sides = modes.basis[:, CYCLIC[k]]
    a = np.linalg.inv(sides @ sides.transpose(0, 2, 1))
    mu, kappa = modes.material.law.initial_shear_modulus, modes.material.bulk_modulus
    dilation = 2.0 * (kappa - 2.0 / 3.0 * mu) / (kappa + 4.0 / 3.0 * mu)
    H = dilation * np.einsum("mab,mcd->mabcd", a, a)
    H += np.einsum("mac,mbd->mabcd", a, a) + np.einsum("mad,mbc->mabcd", a, a)
    first, second = [0, 1, 0], [0, 1, 1]  # of the components ii, jj, ij
    stiffness = H[:, first, second][:, :, first, second]
    root = np.sqrt(modes.volumes / 3.0)[:, None, None]
    factors: np.ndarray = root * np.linalg.cholesky(stiffness).transpose(0, 2, 1)
    return factors


def warping_scales(modes: HourglassModes) -> np.ndarray:
    """Return y / q_4i (m, 3) [m^(1/2)] of hexahedra: sqrt(V/9 Y/mu) / |D_i|, Y Young's modulus."""
    mu, kappa = modes.material.law.initial_shear_modulus, modes.material.bulk_modulus
    root = np.sqrt(9.0 * kappa / (3.0 * kappa + mu) * modes.volumes / 9.0)
    scales: np.ndarray = root[:, None] / np.linalg.norm(modes.basis, axis=2)
    return scales


def amplitudes(modes: HourglassModes) -> np.ndarray:
    """Return y over q (m, n, n) of all modes, q_ki at k d + i."""
    m, d = modes.basis.shape[:2]
    count = len(modes.modes) * d
    result = np.zeros((m, count, count))
    if d == 2:
        result[:, [0, 1], [0, 1]] = fibre_scales(modes)
        return result
    lengths = np.linalg.norm(modes.basis, axis=2)
    for k, (i, j) in enumerate(CYCLIC):
        strains = np.zeros((m, 3, count))
        strains[:, 0, 3 * j + i] = strains[:, 2, 4 * i] = lengths[:, i]
        strains[:, 1, 3 * i + j] = strains[:, 2, 4 * j] = lengths[:, j]
        result[:, 3 * k : 3 * k + 3] = plate_factors(modes, k) @ strains
    result[:, [9, 10, 11], [9, 10, 11]] = warping_scales(modes)
    return result


# So many modes are relaxed one by one in the text of a kernel. That is faster than a loop, but the
# twelve modes of hexahedra take a minute to compile.
UNROLLED = 2


class HourglassSprings:
    """Springs on the amplitudes y of `count` modes, with the energy 1/2 mu y^2 [J].

    There is one spring of the law, and one of each Maxwell branch of `points`, which relaxes.

    Fields (scenarios, blocks, count): `amplitude` [m^(3/2)], to be set before `load`, which
    computes `force` dU/dy.
    """

    def __init__(self, points: MaterialPoints, count: int, scenarios: int, blocks: int) -> None:
        self.points, self.count, self.blocks = points, count, Number(blocks)
        self.lane = backend.lane_vector()
        mu = float(points.shear_modulus)
        with_branches = mu + float(points.branch_sum)
        self.modulus = real_field(np.array([mu, with_branches]))
        shape = (scenarios, blocks, count)
        self.amplitude, self.force = lane_field(shape), lane_field(shape)
        if points.branch_count:
            self.last, self.relaxed_force = lane_field(shape), lane_field(shape)  # sum mu r
            self.relaxed = lane_field((*shape, points.branch_count))
            self.dissipation = lane_field((scenarios, blocks))

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        kept = {"hourglass_amplitude": self.amplitude}
        if self.points.branch_count:
            kept |= {"hourglass_last": self.last, "hourglass_dissipation": self.dissipation}
            kept["hourglass_relaxed"] = self.relaxed
            kept["hourglass_relaxed_force"] = self.relaxed_force
        return kept

    def forget_dissipation(self, scenario: int) -> None:
        """Reset the dissipated energy of a scenario."""
        if self.points.branch_count:
            fields.write_row(self.dissipation, scenario, 0.0)

    @ti.func
    def load(self, s, b):
        """Compute the forces of block b after relaxing the branches that are due."""
        if ti.static(self.points.branch_count > 0):
            for k in ti.static(range(self.points.branch_count)):
                if self.points.relaxation.due[s, k] == 1:
                    self.relax(s, b, k)
        for m in ti.static(range(self.count)):
            y = self.amplitude[s, b, m]
            self.force[s, b, m] = self.modulus[0] * y
            if ti.static(self.points.branch_count > 0):
                self.force[s, b, m] = self.modulus[1] * y - self.relaxed_force[s, b, m]
                self.last[s, b, m] = y

    @ti.func
    def relax(self, s, b, k: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Relax branch k of all modes of a block."""
        dissipated = self.lane(0.0)
        if ti.static(self.count <= UNROLLED):
            for m in ti.static(range(self.count)):
                dissipated += self.relax_mode(s, b, k, m)
        else:
            for m in range(ti.static(self.count)):
                dissipated += self.relax_mode(s, b, k, m)
        self.dissipation[s, b] = self.dissipation[s, b] + dissipated

    @ti.func
    def relax_mode(self, s, b, k: ti.template(), m):  # type: ignore[valid-type]  # Taichi wants an instance
        """Relax branch k of mode m and return the energy [J] that it dissipates."""
        share, behind = self.points.relaxation.share[s, k], self.points.relaxation.behind[s, k]
        mu, r = self.points.branch_modulus[k], self.relaxed[s, b, m, k]
        y, last = self.amplitude[s, b, m], self.last[s, b, m]
        change = share * ((1.0 - behind) * y + behind * last - r)
        self.relaxed[s, b, m, k] = r + change
        self.relaxed_force[s, b, m] = self.relaxed_force[s, b, m] + mu * change
        return mu * (0.5 * (y + last) - r - 0.5 * change) * change

    @ti.func
    def stored_energy(self, s, part):
        """Return the energy of all springs [J]."""
        energy = self.lane(0.0)
        for b in range(self.blocks.first(part), self.blocks.first(part + 1)):
            for m in range(ti.static(self.count)):
                y = self.amplitude[s, b, m]
                energy += 0.5 * self.modulus[0] * y * y
                for k in ti.static(range(self.points.branch_count)):
                    stretch = y - self.relaxed[s, b, m, k]
                    energy += 0.5 * self.points.branch_modulus[k] * stretch * stretch
        return energy.sum()

    @ti.func
    def dissipated_energy(self, s, part):
        """Return the energy dissipated by the branches so far [J]."""
        energy = self.lane(0.0)
        if ti.static(self.points.branch_count > 0):
            for b in range(self.blocks.first(part), self.blocks.first(part + 1)):
                energy += self.dissipation[s, b]
        return energy.sum()


class HourglassElements(OnePointElements):
    """Elements with hourglass modes and their `springs`."""

    springs: HourglassSprings

    def rest_edges(self, region: Region) -> np.ndarray:
        """Return D_i (m, d, d) [m]."""
        return hourglass_modes(region).basis

    def state_fields(self) -> dict[str, ti.Field]:
        return super().state_fields() | self.springs.state_fields()

    def forget_dissipation(self, scenario: int) -> None:
        super().forget_dissipation(scenario)
        self.springs.forget_dissipation(scenario)

    @ti.func
    def hourglass_energy(self, s, part):
        """Return the energy in the hourglass modes [J]."""
        return self.springs.stored_energy(s, part)

    @ti.func
    def hourglass_dissipation(self, s, part):
        """Return the energy dissipated by the branches of the hourglass modes so far [J]."""
        return self.springs.dissipated_energy(s, part)


# -------------------------------------------------------------------------------------------------
# Upper bound of the stiffness of the hourglass modes of a region's elements.
#
# U = 1/2 mu |A q|^2, q_ki = e_i . h~_k, where mu includes all branches.
# With the largest eigenvalue a of A^T A, |p| <= mu a |q| in an element that was deformed straight
# from rest, whose branches carry no more than if they were unrelaxed. A displacement of the nodes
# gives
#     dq_ki = e_i . dh~_k + h~_k . (dd_i across d_i) / |d_i|,
#     |d^2 q_ki| <= 2 |dh~_k| |dd_i| / |d_i| + 3 |h~_k| |dd_i|^2 / |d_i|^2.
# With r^2 = sum |h~_k|^2 / min |d_i|^2, g the largest row sum of the |e_i . e_j|, whose root bounds
# |q| by |h~|, and 2 r x y <= r (x^2 + y^2), that is
#     d^2 U <= mu a [(g (1 + r) + sqrt(g) r) sum |dh~_k|^2
#                    + (r + r^2 + sqrt(g) (r + 3 r^2)) sum |dd_i|^2].


class HourglassStiffness:
    """Stiffness of the hourglass modes of a region in any configuration.

    Arrays have the elements last, as in solver/element_bound.py. of_modes (k, corners, m), of_edges
    (d, corners, m): derivatives of h~_k and d_i with respect to the positions of the nodes.
    modulus (m,) [N/m]: mu a.
    """

    def __init__(self, region: Region) -> None:
        modes = hourglass_modes(region)
        self.of_modes = np.ascontiguousarray(modes.of_modes.transpose(1, 2, 0))
        self.of_edges = np.ascontiguousarray(modes.of_edges.transpose(1, 2, 0))
        parts = batches(len(region.cells))
        norms = [np.linalg.norm(amplitudes(modes.of(part)), ord=2, axis=(1, 2)) for part in parts]
        squares = np.concatenate(norms) ** 2
        self.modulus = region.material.instantaneous_shear_modulus * squares

    def at(self, x: np.ndarray, batch: slice) -> np.ndarray:
        """Return the stiffness (corners, corners, batch) [N/m] between the nodes of each element.

        It is the same for every component. x (d, corners, batch) [m]: positions of the nodes.
        """
        H, D = self.of_modes[:, :, batch], self.of_edges[:, :, batch]
        modes = np.einsum("kam,iam->kim", H, x)
        edges = np.einsum("jam,iam->jim", D, x)
        lengths = np.sqrt((edges**2).sum(axis=1))
        with np.errstate(invalid="ignore", divide="ignore"):
            directions = edges / lengths[:, None]
            leaning = np.abs((directions[:, None] * directions).sum(axis=2)).sum(axis=0)
            r = np.sqrt((modes**2).sum(axis=(0, 1))) / lengths.min(axis=0)
        g = leaning.max(axis=0)
        of_modes = g * (1.0 + r) + np.sqrt(g) * r
        of_edges = r + r**2 + np.sqrt(g) * (r + 3.0 * r**2)
        return self.modulus[batch] * (
            of_modes * np.einsum("kam,kbm->abm", H, H) + of_edges * np.einsum("jam,jbm->abm", D, D)
        )
