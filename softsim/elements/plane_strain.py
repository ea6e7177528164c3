"""Linear plane-strain triangles with averaged nodal pressure.

Kinematics      F = sum_a x_a (x) grad N_a,  J = det F,  F_zz = 1.
Deviatoric part by the element: W(I1_bar) with I1_bar = J^(-2/3) tr(F^T F).
Volumetric part by the node (Bonet and Burton 1998, Commun. Numer. Meth. Engng 14:437-449):
    J_a = current over reference nodal volume,  p_a = kappa (J_a - 1),  element pressure = mean p_a.
It is the gradient of sum_a V_a (kappa/2) (J_a - 1)^2, so it keeps energy and does not lock.
Maxwell branches (Linder, Tkachuk, Miehe 2011, J. Mech. Phys. Solids 59:2134-2156): each holds a
viscous metric A, at rest the inverse of C_bar:
    energy   mu/2 (A : C_bar - 3 - ln det A),    dA/dt = (C_bar^-1 - A) / tau,
    dissipation  mu/(2 tau) (A : C_bar + A^-1 : C_bar^-1 - 6) >= 0.
After a sudden stretch the branch stress decays as exp(-t / tau) exactly.
Bulk viscosity (the linear term of ABAQUS/Explicit): p_a also gets b1 rho c_d h_a dJ_a/dt.
"""

import numpy as np
import taichi as ti

from softsim import backend
from softsim.elements.geometry import reference_gradients
from softsim.elements.solid import Solid
from softsim.elements.tensors import determinant, inverse_cube_root, tensor_types
from softsim.nodes import Nodes, index_field, real_field


@ti.data_oriented
class PlaneStrainTriangles:
    """All triangles of one body.

    Parameters
    ----------
    nodes: the shared nodes; this body owns first_node .. first_node + len(points) - 1.
    points: reference positions (n, 2) [m]. cells: (m, 3), numbered within the body.
    thickness: [m]. bulk_viscosity: b1 [-].
    """

    def __init__(
        self,
        nodes: Nodes,
        first_node: int,
        points: np.ndarray,
        cells: np.ndarray,
        thickness: float,
        material: Solid,
        bulk_viscosity: float,
    ) -> None:
        scenarios, lanes = nodes.scenarios, backend.lanes()
        self.nodes, self.material, self.law = nodes, material, material.law
        self.energy_density = ti.func(material.law.energy_density)
        self.energy_slope = ti.func(material.law.energy_slope)
        self.tensors = tensor_types()
        self.first_node, self.node_count = first_node, len(points)
        self.cell_count, self.blocks = len(cells), backend.lane_blocks(len(cells))

        # Padding repeats the last cell with zero volume and sends its forces nowhere.
        padding = self.blocks * lanes - len(cells)
        padded = np.concatenate([cells, np.repeat(cells[-1:], padding, axis=0)])
        gradients, area = reference_gradients(points, padded)
        volume = thickness * area
        volume[len(cells) :] = 0.0
        self.corner = index_field(by_lane(padded + first_node, lanes))
        self.grad_1 = self._plane_vector(gradients[:, 1], lanes)
        self.grad_2 = self._plane_vector(gradients[:, 2], lanes)
        self.volume = self._lane_data(volume, lanes)
        owner = np.where(np.arange(len(padded))[:, None] < len(cells), padded + first_node, -1)
        # A block's rows: corner 0, 1, 2.
        self.first_row = nodes.corner_forces.claim(by_lane(owner, lanes).reshape(-1, lanes))

        cell_of_corner = np.repeat(np.arange(len(cells)), 3)
        order = np.argsort(cells.ravel(), kind="stable")
        start = np.searchsorted(cells.ravel()[order], np.arange(len(points) + 1))
        self.cell_start, self.cell_of_node = index_field(start), index_field(cell_of_corner[order])
        nodal_volume = np.bincount(
            cells.ravel(), np.repeat(volume[: len(cells)], 3) / 3.0, minlength=len(points)
        )
        self.nodal_volume = real_field(nodal_volume)
        wave_speed = np.sqrt(
            (material.bulk_modulus + 4.0 / 3.0 * material.instantaneous_shear_modulus)
            / material.density
        )
        size = np.sqrt(nodal_volume / thickness)
        self.bulk_viscosity = real_field(bulk_viscosity * material.density * wave_speed * size)

        self.constants = real_field(np.array(material.law.constants))
        self.bulk_modulus = real_field(np.array([material.bulk_modulus]))
        self.branch_count = len(material.branches)
        self.branch_modulus = real_field(np.array([b.shear_modulus for b in material.branches]))
        self.relaxation_time = real_field(np.array([b.relaxation_time for b in material.branches]))
        self.decay = real_field(np.ones(self.branch_count))
        self.mean_distance = real_field(np.ones(self.branch_count))

        self.F = [backend.lane_field((scenarios, self.blocks)) for _ in range(4)]
        self.current_volume = backend.lane_field((scenarios, self.blocks))
        self.element_pressure = backend.lane_field((scenarios, self.blocks))
        self.nodal_J = real_field(np.ones((scenarios, len(points))))
        self.nodal_pressure = real_field(np.zeros((scenarios, len(points))))
        self.bulk_dissipation = real_field(np.zeros((scenarios, len(points))))
        # A as (xx, yy, xy, zz), a branch after the other.
        self.metric = [
            [backend.lane_field((scenarios, self.blocks)) for _ in range(4)]
            for _ in range(self.branch_count)
        ]
        for xx, yy, _, zz in self.metric:
            for component in (xx, yy, zz):
                component.fill(1.0)
        self.branch_dissipation = backend.lane_field((scenarios, self.blocks))
        self.mass = material.density * nodal_volume

    @staticmethod
    def _lane_data(values: np.ndarray, lanes: int) -> ti.MatrixField:
        field = backend.lane_field((len(values) // lanes,))
        field.from_numpy(np.ascontiguousarray(values.reshape(-1, lanes)))
        return field

    def _plane_vector(self, values: np.ndarray, lanes: int) -> list[ti.MatrixField]:
        return [self._lane_data(values[:, i].copy(), lanes) for i in range(2)]

    def memory(self) -> dict[str, ti.Field]:
        """Fields that a checkpoint keeps."""
        fields = {
            "nodal_J": self.nodal_J,
            "bulk_dissipation": self.bulk_dissipation,
            "branch_dissipation": self.branch_dissipation,
        }
        for k, metric in enumerate(self.metric):
            for name, component in zip(("xx", "yy", "xy", "zz"), metric, strict=True):
                fields[f"metric_{k}_{name}"] = component
        return fields

    def set_increment(self, dt: float) -> None:
        """Take the time step [s]: exp(-dt / tau) of each branch."""
        for k, branch in enumerate(self.material.branches):
            ratio = dt / branch.relaxation_time
            self.decay[k] = float(np.exp(-ratio))
            # Dissipation is sampled at the end of an increment; over it the square of the metric's
            # distance from rest was larger by this factor on the mean.
            self.mean_distance[k] = float(np.expm1(2.0 * ratio) / (2.0 * ratio))

    # --- one increment, pass by pass -------------------------------------------------------------

    @ti.func
    def deform(self, s, b, t, dt):
        """F of each element from the corner positions, and its current volume J V."""
        x0 = self.tensors.lane(0.0)
        y0 = self.tensors.lane(0.0)
        x1 = self.tensors.lane(0.0)
        y1 = self.tensors.lane(0.0)
        x2 = self.tensors.lane(0.0)
        y2 = self.tensors.lane(0.0)
        for lane in ti.static(range(backend.lanes())):
            p0 = self.nodes.position[s, self.corner[b, 0, lane]]
            p1 = self.nodes.position[s, self.corner[b, 1, lane]]
            p2 = self.nodes.position[s, self.corner[b, 2, lane]]
            x0[lane] = p0[0]
            y0[lane] = p0[1]
            x1[lane] = p1[0]
            y1[lane] = p1[1]
            x2[lane] = p2[0]
            y2[lane] = p2[1]
        F = self.tensors.Plane(
            xx=(x1 - x0) * self.grad_1[0][b] + (x2 - x0) * self.grad_2[0][b],
            xy=(x1 - x0) * self.grad_1[1][b] + (x2 - x0) * self.grad_2[1][b],
            yx=(y1 - y0) * self.grad_1[0][b] + (y2 - y0) * self.grad_2[0][b],
            yy=(y1 - y0) * self.grad_1[1][b] + (y2 - y0) * self.grad_2[1][b],
        )
        self.F[0][s, b] = F.xx
        self.F[1][s, b] = F.xy
        self.F[2][s, b] = F.yx
        self.F[3][s, b] = F.yy
        self.current_volume[s, b] = determinant(F) * self.volume[b]

    @ti.func
    def press_nodes(self, s, a, t, dt):
        """p_a = kappa (J_a - 1) + viscosity dJ_a/dt, J_a = sum of a third of the volumes around."""
        bits = ti.static(self.nodes.corner_forces.lane_bits)
        mask = ti.static(self.nodes.corner_forces.lane_mask)
        volume = ti.cast(0.0, backend.real)
        for k in range(self.cell_start[a], self.cell_start[a + 1]):
            cell = self.cell_of_node[k]
            volume += self.current_volume[s, cell >> bits][cell & mask]
        J = volume / (3.0 * self.nodal_volume[a])
        dJ = J - self.nodal_J[s, a]
        viscous = self.bulk_viscosity[a] * dJ / dt
        self.nodal_J[s, a] = J
        self.nodal_pressure[s, a] = self.bulk_modulus[0] * (J - 1.0) + viscous
        self.bulk_dissipation[s, a] = (
            self.bulk_dissipation[s, a] + viscous * dJ * self.nodal_volume[a]
        )

    @ti.func
    def average_pressure(self, s, b, t, dt):
        """Element pressure: the mean of its nodes (positive in tension)."""
        p = self.tensors.lane(0.0)
        for lane in ti.static(range(backend.lanes())):
            for c in ti.static(range(3)):
                p[lane] += self.nodal_pressure[s, self.corner[b, c, lane] - self.first_node]
        self.element_pressure[s, b] = p * (1.0 / 3.0)

    @ti.func
    def stress_corners(self, s, b, t, dt):
        """Corner forces -V P grad N_a.

        P = J^(-2/3) (F M - (C : M) / 3 F^-T) + p J F^-T  with  M = 2 dW/dI1_bar I + sum mu A.
        """
        F = self._deformation(s, b)
        C = self._right_cauchy_green(F)
        J = determinant(F)
        r = inverse_cube_root(J)
        r2 = r * r
        slope = 2.0 * self._slope(r2 * (C.xx + C.yy + C.zz))
        M = self.tensors.Symmetric(xx=slope, yy=slope, zz=slope, xy=self.tensors.lane(0.0))
        inverse = self._inverse_isochoric(C, r2)
        for k in ti.static(range(self.branch_count)):
            A = self._relax(s, b, k, inverse)
            mu = self.branch_modulus[k]
            M = self.tensors.Symmetric(
                xx=M.xx + mu * A.xx, yy=M.yy + mu * A.yy, zz=M.zz + mu * A.zz, xy=M.xy + mu * A.xy
            )
        trace = (C.xx * M.xx + C.yy * M.yy + C.zz * M.zz + 2.0 * C.xy * M.xy) * (1.0 / 3.0)
        # J F^-T is the cofactor, (F.yy, -F.yx, -F.xy, F.xx); 1 / J = r^3.
        h = self.element_pressure[s, b] - trace * (r2 * r2 * r)
        P = self.tensors.Plane(
            xx=r2 * (F.xx * M.xx + F.xy * M.xy) + h * F.yy,
            xy=r2 * (F.xx * M.xy + F.xy * M.yy) - h * F.yx,
            yx=r2 * (F.yx * M.xx + F.yy * M.xy) - h * F.xy,
            yy=r2 * (F.yx * M.xy + F.yy * M.yy) + h * F.xx,
        )
        volume = self.volume[b]
        x1 = -volume * (P.xx * self.grad_1[0][b] + P.xy * self.grad_1[1][b])
        y1 = -volume * (P.yx * self.grad_1[0][b] + P.yy * self.grad_1[1][b])
        x2 = -volume * (P.xx * self.grad_2[0][b] + P.xy * self.grad_2[1][b])
        y2 = -volume * (P.yx * self.grad_2[0][b] + P.yy * self.grad_2[1][b])
        row = self.first_row + 3 * b
        self.nodes.corner_forces.x[s, row] = -x1 - x2
        self.nodes.corner_forces.y[s, row] = -y1 - y2
        self.nodes.corner_forces.x[s, row + 1] = x1
        self.nodes.corner_forces.y[s, row + 1] = y1
        self.nodes.corner_forces.x[s, row + 2] = x2
        self.nodes.corner_forces.y[s, row + 2] = y2

    @ti.func
    def dissipate(self, s, b, t, dt):
        """Add what the Maxwell branches dissipate in dt, a few increments long."""
        C = self._right_cauchy_green(self._deformation(s, b))
        r = inverse_cube_root(determinant(self._deformation(s, b)))
        inverse = self._inverse_isochoric(C, r * r)
        power = self.tensors.lane(0.0)
        for k in ti.static(range(self.branch_count)):
            A = self._metric(s, b, k)
            plane = A.xx * A.yy - A.xy * A.xy
            stretch = r * r * (A.xx * C.xx + A.yy * C.yy + A.zz * C.zz + 2.0 * A.xy * C.xy)
            back = (
                A.yy * inverse.xx + A.xx * inverse.yy - 2.0 * A.xy * inverse.xy
            ) / plane + inverse.zz / A.zz
            rate = self.branch_modulus[k] / (2.0 * self.relaxation_time[k])
            factor = self.mean_distance[k] * rate
            power += factor * (stretch + back - 6.0)
        self.branch_dissipation[s, b] = self.branch_dissipation[s, b] + dt * power * self.volume[b]

    # --- parts -----------------------------------------------------------------------------------

    @ti.func
    def _deformation(self, s, b):
        return self.tensors.Plane(
            xx=self.F[0][s, b], xy=self.F[1][s, b], yx=self.F[2][s, b], yy=self.F[3][s, b]
        )

    @ti.func
    def _right_cauchy_green(self, F):
        return self.tensors.Symmetric(
            xx=F.xx * F.xx + F.yx * F.yx,
            yy=F.xy * F.xy + F.yy * F.yy,
            zz=self.tensors.lane(1.0),
            xy=F.xx * F.xy + F.yx * F.yy,
        )

    @ti.func
    def _inverse_isochoric(self, C, r2):
        """C_bar^-1 = J^(2/3) C^-1, written with the cofactor of C and r2 = J^(-2/3)."""
        r4 = r2 * r2
        return self.tensors.Symmetric(
            xx=r4 * C.yy, yy=r4 * C.xx, zz=r4 * (C.xx * C.yy - C.xy * C.xy), xy=-r4 * C.xy
        )

    @ti.func
    def _slope(self, I1_bar):
        return self.energy_slope(I1_bar, self._constants())

    @ti.func
    def _constants(self):
        return ti.Vector([self.constants[i] for i in range(len(self.law.constants))])

    @ti.func
    def _metric(self, s, b, k: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        return self.tensors.Symmetric(
            xx=self.metric[k][0][s, b],
            yy=self.metric[k][1][s, b],
            zz=self.metric[k][3][s, b],
            xy=self.metric[k][2][s, b],
        )

    @ti.func
    def _relax(self, s, b, k: ti.template(), rest):  # type: ignore[valid-type]  # Taichi wants an instance
        """A moves towards `rest` = C_bar^-1 by one increment; exact for a constant C_bar."""
        e = self.decay[k]
        A = self._metric(s, b, k)
        A = self.tensors.Symmetric(
            xx=e * A.xx + (1.0 - e) * rest.xx,
            yy=e * A.yy + (1.0 - e) * rest.yy,
            zz=e * A.zz + (1.0 - e) * rest.zz,
            xy=e * A.xy + (1.0 - e) * rest.xy,
        )
        self.metric[k][0][s, b] = A.xx
        self.metric[k][1][s, b] = A.yy
        self.metric[k][2][s, b] = A.xy
        self.metric[k][3][s, b] = A.zz
        return A

    # --- what observers ask ----------------------------------------------------------------------

    @ti.func
    def stored_energy(self, s):
        """Energy [J] in the law, the Maxwell springs and the volume: ABAQUS's ALLSE."""
        in_elements = self.tensors.lane(0.0)
        for b in range(self.blocks):
            F = self._deformation(s, b)
            C = self._right_cauchy_green(F)
            r = inverse_cube_root(determinant(F))
            I1_bar = r * r * (C.xx + C.yy + C.zz)
            w = self.energy_density(I1_bar, self._constants())
            for k in ti.static(range(self.branch_count)):
                A = self._metric(s, b, k)
                stretch = r * r * (A.xx * C.xx + A.yy * C.yy + A.zz * C.zz + 2.0 * A.xy * C.xy)
                det_A = A.zz * (A.xx * A.yy - A.xy * A.xy)
                w += 0.5 * self.branch_modulus[k] * (stretch - 3.0 - ti.log(det_A))
            in_elements += w * self.volume[b]
        energy = in_elements.sum()
        for a in range(self.node_count):
            dilation = self.nodal_J[s, a] - 1.0
            energy += 0.5 * self.bulk_modulus[0] * dilation * dilation * self.nodal_volume[a]
        return energy

    @ti.func
    def dissipated_energy(self, s):
        """Dissipated by Maxwell dashpots and bulk viscosity so far [J]."""
        in_elements = self.tensors.lane(0.0)
        for b in range(self.blocks):
            in_elements += self.branch_dissipation[s, b]
        energy = in_elements.sum()
        for a in range(self.node_count):
            energy += self.bulk_dissipation[s, a]
        return energy


def by_lane(corners: np.ndarray, lanes: int) -> np.ndarray:
    """Corner lists (cells, corners) in the order of the lane fields: (blocks, corners, lanes)."""
    return np.ascontiguousarray(
        corners.reshape(-1, lanes, corners.shape[1]).transpose(0, 2, 1), dtype=np.int32
    )
