"""Bodies in space: tetrahedra and hexahedra, their geometry and facets.

Material in elements/material_points.py, volumetric part in elements/one_point.py.
"""

from dataclasses import dataclass

import numpy as np
import taichi as ti

from softsim.compute import backend
from softsim.compute.fields import lane_field
from softsim.compute.nodes import Nodes
from softsim.compute.term import Pass, Stage
from softsim.elements.geometry import PARENT_CORNERS, Geometry, Region
from softsim.elements.hourglass import (
    CYCLIC,
    HourglassElements,
    HourglassSprings,
    hourglass_modes,
    plate_factors,
    warping_scales,
)
from softsim.elements.kinematics import SpaceMetric
from softsim.elements.one_point import OnePointElements, followed_by_zeros, lane_tables, padded

# -------------------------------------------------------------------------------------------------
# Linear tetrahedra: edges d_i = x_i - x_0, corner forces f_i = -V S^ij d_j, f_0 = -sum f_i.


class SpaceElements(OnePointElements):
    """Elements in space; parameters as for OnePointElements."""

    def __init__(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> None:
        super().__init__(nodes, region, SpaceMetric(), bulk_viscosity)

    @ti.func
    def volume_ratio(self, s, b):
        """Return J of block b."""
        ax, ay, az, bx, by, bz, cx, cy, cz = ti.static(self.edge)
        determinant = (
            ax[s, b] * (by[s, b] * cz[s, b] - bz[s, b] * cy[s, b])
            + ay[s, b] * (bz[s, b] * cx[s, b] - bx[s, b] * cz[s, b])
            + az[s, b] * (bx[s, b] * cy[s, b] - by[s, b] * cx[s, b])
        )
        return determinant * self.inverse_determinant[b]

    @ti.func
    def stretch(self, s, b):
        """Return C in the basis of the edges, and J."""
        C = self.metric.Symmetric(
            aa=self.dot(s, b, 0, 0),
            bb=self.dot(s, b, 1, 1),
            cc=self.dot(s, b, 2, 2),
            ab=self.dot(s, b, 0, 1),
            bc=self.dot(s, b, 1, 2),
            ca=self.dot(s, b, 2, 0),
        )
        return C, self.volume_ratio(s, b)

    @ti.func
    def dot(self, s, b, i: ti.template(), j: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return d_i . d_j."""
        return (
            self.edge[3 * i][s, b] * self.edge[3 * j][s, b]
            + self.edge[3 * i + 1][s, b] * self.edge[3 * j + 1][s, b]
            + self.edge[3 * i + 2][s, b] * self.edge[3 * j + 2][s, b]
        )

    @ti.func
    def sum_of_edges(self, s, b, S_1, S_2, S_3):
        """Return S_1 d_1 + S_2 d_2 + S_3 d_3, by component."""
        ax, ay, az, bx, by, bz, cx, cy, cz = ti.static(self.edge)
        x = S_1 * ax[s, b] + S_2 * bx[s, b] + S_3 * cx[s, b]
        y = S_1 * ay[s, b] + S_2 * by[s, b] + S_3 * cy[s, b]
        z = S_1 * az[s, b] + S_2 * bz[s, b] + S_3 * cz[s, b]
        return x, y, z


class Tetrahedra(SpaceElements):
    """Tetrahedra; parameters as for SpaceElements."""

    @ti.func
    def deform(self, s, b, t, dt):
        """Compute edges and current volumes from the nodal positions."""
        for k in ti.static(range(3)):
            d1 = self.metric.lane(0.0)
            d2 = self.metric.lane(0.0)
            d3 = self.metric.lane(0.0)
            for lane in ti.static(range(backend.lanes())):
                x0 = self.nodes.position[s, self.corner[b, 0, lane]][k]
                d1[lane] = self.nodes.position[s, self.corner[b, 1, lane]][k] - x0
                d2[lane] = self.nodes.position[s, self.corner[b, 2, lane]][k] - x0
                d3[lane] = self.nodes.position[s, self.corner[b, 3, lane]][k] - x0
            self.edge[k][s, b] = d1
            self.edge[3 + k][s, b] = d2
            self.edge[6 + k][s, b] = d3
        self.keep_volume(s, b, self.volume_ratio(s, b))

    @ti.func
    def stress_corners(self, s, b, t, dt):
        """Write the nodal forces of the stress."""
        S = self.stress(s, b)
        x1, y1, z1 = self.sum_of_edges(s, b, S.aa, S.ab, S.ca)
        x2, y2, z2 = self.sum_of_edges(s, b, S.ab, S.bb, S.bc)
        x3, y3, z3 = self.sum_of_edges(s, b, S.ca, S.bc, S.cc)
        # All of them first, then the stores: in between these would keep LLVM from vectorising.
        self.push_corner(s, b, 0, 0, x1 + x2 + x3)
        self.push_corner(s, b, 0, 1, y1 + y2 + y3)
        self.push_corner(s, b, 0, 2, z1 + z2 + z3)
        self.push_corner(s, b, 1, 0, -x1)
        self.push_corner(s, b, 1, 1, -y1)
        self.push_corner(s, b, 1, 2, -z1)
        self.push_corner(s, b, 2, 0, -x2)
        self.push_corner(s, b, 2, 1, -y2)
        self.push_corner(s, b, 2, 2, -z2)
        self.push_corner(s, b, 3, 0, -x3)
        self.push_corner(s, b, 3, 1, -y3)
        self.push_corner(s, b, 3, 2, -z3)


# -------------------------------------------------------------------------------------------------
# Hexahedra with one integration point and hourglass stiffness in bending, torsion and warping.
#
# The hourglass modes h~_1 .. h~_4 and their forces: elements/hourglass.py. With phi_k = xi_i xi_j
# (i, j, k cyclic) the strain that grows along xi_k is that of a plate in the directions i and j,
#     E_ii = |D_i| q_ji,    E_jj = |D_j| q_ij,    2 E_ij = |D_i| q_ii + |D_j| q_jj,
# whose fibres strain freely along k. In the components of its directions its stiffness is (Green
# and Zerna 1968, Theoretical Elasticity, ch. 10), with the inverse a^ab of D_a . D_b,
#     H^abcd = lambda' a^ab a^cd + mu (a^ac a^bd + a^ad a^bc),
#     lambda' = 2 mu lambda / (lambda + 2 mu),    lambda = kappa - 2/3 mu,
# and U = V/2 1/3 E H E, as the integral of xi_k^2 is V/3. Of xi_1 xi_2 xi_3 the fibres along each i
# store V/2 1/9 Y (q_4i / |D_i|)^2, with Young's modulus Y. In bricks that is the exact energy of
# bending.
#
# Amplitudes: y = sqrt(V/3 / mu) L E of each plate, with H = L^T L.

MODES, AMPLITUDES = 4, 12
SIGNS = tuple(map(tuple, PARENT_CORNERS[8].tolist()))  # xi_i of the corners


class Hexahedra(HourglassElements, SpaceElements):
    """Hexahedra; parameters as for SpaceElements."""

    def __init__(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> None:
        super().__init__(nodes, region, bulk_viscosity)
        modes = hourglass_modes(region)
        scenarios, blocks = nodes.scenarios, int(self.blocks)
        self.springs = HourglassSprings(self.points, AMPLITUDES, scenarios, blocks)
        self.lean = lane_tables(padded(modes.lean))
        self.share = lane_tables(padded(modes.share))
        lengths = np.linalg.norm(modes.basis, axis=2)
        self.length = lane_tables(padded(lengths))
        self.warping = lane_tables(followed_by_zeros(warping_scales(modes)))
        L = np.stack([plate_factors(modes, k) for k in range(3)], axis=1)
        self.plate = lane_tables(followed_by_zeros(L.reshape(len(L), 3, 9)))
        self.mode = lane_field((scenarios, blocks, MODES, 3))  # h~_k
        self.moment = lane_field((scenarios, blocks, MODES, 3))  # Q_k
        self.turned = lane_field((scenarios, blocks, AMPLITUDES))  # q_ki at 3 k + i
        self.slope = lane_field((scenarios, blocks, AMPLITUDES))  # p_ki
        self.bent = lane_field((scenarios, blocks, 9))  # of T_i, at 3 i + component

    def passes(self) -> dict[Stage, list[Pass]]:
        passes = super().passes()
        passes[Stage.PRESS].append(Pass("elements", int(self.blocks), (self.bend,)))
        return passes

    @ti.func
    def deform(self, s, b, t, dt):
        """Compute edges, hourglass modes and current volumes from the nodal positions."""
        for k in ti.static(range(3)):
            x0 = self.corner_component(s, b, 0, k)
            x1 = self.corner_component(s, b, 1, k)
            x2 = self.corner_component(s, b, 2, k)
            x3 = self.corner_component(s, b, 3, k)
            x4 = self.corner_component(s, b, 4, k)
            x5 = self.corner_component(s, b, 5, k)
            x6 = self.corner_component(s, b, 6, k)
            x7 = self.corner_component(s, b, 7, k)
            # Differences and sums along xi_1 of the four sides, then along xi_2, then xi_3.
            d0, s0, d1, s1 = x1 - x0, x1 + x0, x2 - x3, x2 + x3
            d2, s2, d3, s3 = x5 - x4, x5 + x4, x6 - x7, x6 + x7
            self.mode[s, b, 0, k] = 0.125 * ((s3 - s2) - (s1 - s0))
            self.mode[s, b, 1, k] = 0.125 * ((d3 + d2) - (d1 + d0))
            self.mode[s, b, 2, k] = 0.125 * ((d3 - d2) + (d1 - d0))
            self.mode[s, b, 3, k] = 0.125 * ((d3 - d2) - (d1 - d0))
            g1 = 0.125 * ((d3 + d2) + (d1 + d0))
            g2 = 0.125 * ((s3 - s2) + (s1 - s0))
            g3 = 0.125 * ((s3 + s2) - (s1 + s0))
            for m in ti.static(range(MODES)):
                h = self.mode[s, b, m, k]
                g1 += self.lean[b, m, 0] * h
                g2 += self.lean[b, m, 1] * h
                g3 += self.lean[b, m, 2] * h
            for m in ti.static(range(MODES)):
                share = self.share[b, m, 0] * g1 + self.share[b, m, 1] * g2
                self.mode[s, b, m, k] = self.mode[s, b, m, k] - share - self.share[b, m, 2] * g3
            self.edge[k][s, b] = g1
            self.edge[3 + k][s, b] = g2
            self.edge[6 + k][s, b] = g3
        self.keep_volume(s, b, self.volume_ratio(s, b))

    @ti.func
    def bend(self, s, b, t, dt):
        """Compute Q_k and the contribution of the hourglass modes to T_i, less sum P_ki Q_k."""
        ax, ay, az, bx, by, bz, cx, cy, cz = ti.static(self.edge)
        r_a, r_b, r_c = (
            self.inverse_root(s, b, 0),
            self.inverse_root(s, b, 1),
            self.inverse_root(s, b, 2),
        )
        e_ax, e_ay, e_az = r_a * ax[s, b], r_a * ay[s, b], r_a * az[s, b]
        e_bx, e_by, e_bz = r_b * bx[s, b], r_b * by[s, b], r_b * bz[s, b]
        e_cx, e_cy, e_cz = r_c * cx[s, b], r_c * cy[s, b], r_c * cz[s, b]
        for m in ti.static(range(MODES)):
            x, y, z = self.mode[s, b, m, 0], self.mode[s, b, m, 1], self.mode[s, b, m, 2]
            self.turned[s, b, 3 * m] = e_ax * x + e_ay * y + e_az * z
            self.turned[s, b, 3 * m + 1] = e_bx * x + e_by * y + e_bz * z
            self.turned[s, b, 3 * m + 2] = e_cx * x + e_cy * y + e_cz * z
        self.strain_plates(s, b)
        self.springs.load(s, b)
        self.pull_plates(s, b)
        for m in ti.static(range(MODES)):
            p_a = self.slope[s, b, 3 * m]
            p_b = self.slope[s, b, 3 * m + 1]
            p_c = self.slope[s, b, 3 * m + 2]
            self.moment[s, b, m, 0] = p_a * e_ax + p_b * e_bx + p_c * e_cx
            self.moment[s, b, m, 1] = p_a * e_ay + p_b * e_by + p_c * e_cy
            self.moment[s, b, m, 2] = p_a * e_az + p_b * e_bz + p_c * e_cz
        self.bend_edge(s, b, 0, r_a, e_ax, e_ay, e_az)
        self.bend_edge(s, b, 1, r_b, e_bx, e_by, e_bz)
        self.bend_edge(s, b, 2, r_c, e_cx, e_cy, e_cz)

    @ti.func
    def bend_edge(self, s, b, i: ti.template(), r, e_x, e_y, e_z):  # type: ignore[valid-type]  # Taichi wants an instance
        """Compute sum_k p_ki (h~_k - q_ki e_i) / |d_i| - P_ki Q_k."""
        T_x, T_y, T_z = self.metric.lane(0.0), self.metric.lane(0.0), self.metric.lane(0.0)
        along = self.metric.lane(0.0)
        for m in ti.static(range(MODES)):
            p, share = self.slope[s, b, 3 * m + i], self.share[b, m, i]
            along += p * self.turned[s, b, 3 * m + i]
            T_x += p * r * self.mode[s, b, m, 0] - share * self.moment[s, b, m, 0]
            T_y += p * r * self.mode[s, b, m, 1] - share * self.moment[s, b, m, 1]
            T_z += p * r * self.mode[s, b, m, 2] - share * self.moment[s, b, m, 2]
        self.bent[s, b, 3 * i] = T_x - along * r * e_x
        self.bent[s, b, 3 * i + 1] = T_y - along * r * e_y
        self.bent[s, b, 3 * i + 2] = T_z - along * r * e_z

    @ti.func
    def stress_corners(self, s, b, t, dt):
        """Write the nodal forces of the stress and the hourglass modes."""
        S = self.stress(s, b)
        a_x, a_y, a_z = self.sum_of_edges(s, b, S.aa, S.ab, S.ca)
        b_x, b_y, b_z = self.sum_of_edges(s, b, S.ab, S.bb, S.bc)
        c_x, c_y, c_z = self.sum_of_edges(s, b, S.ca, S.bc, S.cc)
        self.push_corners(s, b, 0, a_x, b_x, c_x)
        self.push_corners(s, b, 1, a_y, b_y, c_y)
        self.push_corners(s, b, 2, a_z, b_z, c_z)

    @ti.func
    def inverse_root(self, s, b, i: ti.template()):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return 1 / |d_i|."""
        return 1.0 / ti.sqrt(self.dot(s, b, i, i))

    @ti.func
    def strain_plates(self, s, b):
        """Compute the amplitudes of the plates' strains and of the warping."""
        for k in ti.static(range(3)):
            i, j = ti.static(CYCLIC[k])
            first = self.length[b, i] * self.turned[s, b, 3 * j + i]
            second = self.length[b, j] * self.turned[s, b, 3 * i + j]
            both = self.length[b, i] * self.turned[s, b, 4 * i]
            both += self.length[b, j] * self.turned[s, b, 4 * j]
            # L is upper triangular.
            upper = self.plate[b, k, 0] * first + self.plate[b, k, 1] * second
            lower = self.plate[b, k, 4] * second + self.plate[b, k, 5] * both
            self.springs.amplitude[s, b, 3 * k] = upper + self.plate[b, k, 2] * both
            self.springs.amplitude[s, b, 3 * k + 1] = lower
            self.springs.amplitude[s, b, 3 * k + 2] = self.plate[b, k, 8] * both
            self.springs.amplitude[s, b, 9 + k] = self.warping[b, k] * self.turned[s, b, 9 + k]

    @ti.func
    def pull_plates(self, s, b):
        """Compute p = dU/dq from the springs: the transpose of `strain_plates`."""
        for k in ti.static(range(3)):
            self.slope[s, b, 4 * k] = self.metric.lane(0.0)
        for k in ti.static(range(3)):
            i, j = ti.static(CYCLIC[k])
            f_0 = self.springs.force[s, b, 3 * k]
            f_1 = self.springs.force[s, b, 3 * k + 1]
            f_2 = self.springs.force[s, b, 3 * k + 2]
            both = self.plate[b, k, 2] * f_0 + self.plate[b, k, 5] * f_1 + self.plate[b, k, 8] * f_2
            self.slope[s, b, 3 * j + i] = self.length[b, i] * (self.plate[b, k, 0] * f_0)
            self.slope[s, b, 3 * i + j] = self.length[b, j] * (
                self.plate[b, k, 1] * f_0 + self.plate[b, k, 4] * f_1
            )
            self.slope[s, b, 4 * i] = self.slope[s, b, 4 * i] + self.length[b, i] * both
            self.slope[s, b, 4 * j] = self.slope[s, b, 4 * j] + self.length[b, j] * both
            self.slope[s, b, 9 + k] = self.warping[b, k] * self.springs.force[s, b, 9 + k]

    @ti.func
    def push_corners(self, s, b, k: ti.template(), T_1, T_2, T_3):  # type: ignore[valid-type]  # Taichi wants an instance
        """Write component k of the nodal forces -1/8 (sum_i xi_i G_i + sum_m phi_m H_m).

        T_1, T_2, T_3: component k of T_i of the stress.
        """
        g_1, g_2 = T_1 + self.bent[s, b, k], T_2 + self.bent[s, b, 3 + k]
        g_3 = T_3 + self.bent[s, b, 6 + k]
        h_1 = self.pulled(s, b, 0, k, g_1, g_2, g_3)
        h_2 = self.pulled(s, b, 1, k, g_1, g_2, g_3)
        h_3 = self.pulled(s, b, 2, k, g_1, g_2, g_3)
        h_4 = self.pulled(s, b, 3, k, g_1, g_2, g_3)
        for c in ti.static(range(8)):
            x, y, z = ti.static(SIGNS[c])
            along = x * ((g_1 + z * h_2) + y * (h_3 + z * h_4))
            self.push_corner(s, b, c, k, -0.125 * (along + y * (g_2 + z * h_1) + z * g_3))

    @ti.func
    def pulled(self, s, b, m: ti.template(), k: ti.template(), g_1, g_2, g_3):  # type: ignore[valid-type]  # Taichi wants an instance
        """Return component k of H_m = Q_m + sum N_mi G_i."""
        lean = self.lean[b, m, 0] * g_1 + self.lean[b, m, 1] * g_2 + self.lean[b, m, 2] * g_3
        return self.moment[s, b, m, k] + lean


# -------------------------------------------------------------------------------------------------
# Geometry of bodies in space, and their facets.

BY_CORNERS: dict[int, type[SpaceElements]] = {4: Tetrahedra, 8: Hexahedra}


@dataclass(frozen=True)
class Solid(Geometry):
    """Geometry of tetrahedra and hexahedra in space."""

    name = "solid"
    dimension = 3

    def depths(self, points: np.ndarray, cells: np.ndarray) -> np.ndarray:
        """Return one (1, 1)."""
        return np.ones((1, 1))

    @staticmethod
    def facet_volume_and_gradient(x, factor, m):
        """Return the volume of the cone from the origin to a facet, and the forces of 1 Pa on its
        nodes: a third of its area on each node of a triangle.

        Facets are triangles or bilinear quadrilaterals, with the outward normal of the material by
        the right-hand rule.
        """
        share = ti.static(SHARES[len(x)])
        volume, gradient = 0.0 * x[0][0], [0.0 * place for place in x]
        for corners in ti.static(TRIANGLES[len(x)]):
            a, b, c = x[corners[0]], x[corners[1]], x[corners[2]]
            volume = volume + share * (m.dot(a, m.cross(c, b)) / 6.0)
            third = share * (m.cross(c - a, b - a) / 6.0)
            for corner in ti.static(corners):
                gradient[corner] = gradient[corner] + third
        return volume, gradient

    def corner_areas(self, x: np.ndarray, facets: np.ndarray) -> np.ndarray:
        """Return the tributary area (k, corners) [m^2] of each node of facets."""
        triangles, share = triangles_of(facets)
        a, b, c = x[triangles].transpose(1, 0, 2)
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return share * _at_corners(facets, area[:, None] / 3.0)[:, :, 0]

    def elements(self, nodes: Nodes, region: Region, bulk_viscosity: float) -> OnePointElements:
        return BY_CORNERS[region.cells.shape[1]](nodes, region, bulk_viscosity)


# Corners of the triangles that facets are cut into, by the number of their corners. A quadrilateral
# is cut along both diagonals and halved: that is the volume under its bilinear surface, and favours
# neither diagonal.
TRIANGLES = {3: ((0, 1, 2),), 4: ((0, 1, 2), (2, 3, 0), (0, 1, 3), (1, 2, 3))}
SHARES = {3: 1.0, 4: 0.5}


def triangles_of(facets: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the triangles (k t, 3) of facets (k, corners), and the weight of each."""
    corners = facets.shape[1]
    return facets[:, TRIANGLES[corners]].reshape(-1, 3), SHARES[corners]


def _at_corners(facets: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the sums (k, corners, i) over the triangles at each node of their values (k t, i)."""
    k, corners = facets.shape
    of_facet = values.reshape(k, len(TRIANGLES[corners]), values.shape[1])
    touches = np.array([[float(c in t) for t in TRIANGLES[corners]] for c in range(corners)])
    return np.einsum("ct,kti->kci", touches, of_facet)
