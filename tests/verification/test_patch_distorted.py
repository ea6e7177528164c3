"""Elements on irregular meshes: a linear field, rigid rotation, and forces that turn with the body.

Squares and cubes of four cells a side, the inner nodes moved by a quarter of a cell's side in
random directions. All these properties hold exactly: only round-off is left. In F it is some
eps x/h, times the bulk modulus in a stress, times a facet's area in a force, from some twenty
elements around a node: 100 eps kappa A, with eps = 2.2e-16.
"""

import meshes
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from softsim.compute import fields

FORMULATIONS = ["plane_strain", "axisymmetric", "solid"]
# Triangles and tetrahedra, or quadrilaterals and hexahedra.
WHOLE = pytest.mark.parametrize("whole", [False, True], ids=["simplexes", "quads"])
SIDE, COUNT, DEPTH = 4e-3, 4, 5e-3  # [m], cells, [m]
C10, C20, C30, KAPPA = 36e3, 5e3, 1e3, 1.5e6  # [Pa]
ROUND_OFF = 100.0 * np.finfo(float).eps


def scene(formulation):
    return f"""
bodies:
  b:
    mesh: {{file: block.inp, length_unit: 1 m}}
    formulation: {formulation}
    {f"thickness: {DEPTH} m" if formulation == "plane_strain" else ""}
    material: soft
materials:
  soft: {{law: yeoh, C10: {C10} Pa, C20: {C20} Pa, C30: {C30} Pa, bulk_modulus: {KAPPA} Pa,
         density: 1000 kg/m^3}}
environment: {{gravity: 0 m/s^2}}
solver: {{bulk_viscosity: 0}}
time: {{end: 1 s}}
"""


@pytest.fixture
def block(build, start, tmp_path):
    """Model, solver and mesh of an irregular block; revolved it touches the axis."""

    def built(formulation, whole):
        dimension = 3 if formulation == "solid" else 2
        mesh = meshes.irregular_block(SIDE, COUNT, dimension, shift=0.25, seed=11, whole=whole)
        mesh.write(tmp_path / "block.inp", formulation)
        model = build(scene(formulation))
        np.testing.assert_array_equal(model.points, mesh.points)
        return model, start(model), mesh

    return built


def forces_at(solver, x):
    """Nodal forces (n, d) [N] with the nodes at rest at x."""
    nodes = solver.terms.nodes
    nodes.velocity.fill(0.0)
    fields.write(nodes.position, np.ascontiguousarray(x[None]))
    solver.find_forces(1e-9)
    return fields.read(nodes.force)[0]


def facet_area(formulation):
    """Of a cell's side, revolved at the rim [m^2]."""
    h = SIDE / COUNT
    return h * {"plane_strain": DEPTH, "axisymmetric": 2.0 * np.pi * SIDE, "solid": h}[formulation]


def first_piola(F):
    """P (3, 3) [Pa] of Yeoh's solid from W(I1_bar) + (kappa/2)(J - 1)^2."""
    J, inverse = np.linalg.det(F), np.linalg.inv(F).T
    I1 = np.sum(F**2)
    k = J ** (-2.0 / 3.0) * I1 - 3.0
    slope = C10 + 2.0 * C20 * k + 3.0 * C30 * k**2
    return (
        2.0 * slope * J ** (-2.0 / 3.0) * (F - I1 / 3.0 * inverse) + KAPPA * (J - 1.0) * J * inverse
    )


def surface_forces(mesh, formulation, P):
    """What a uniform stress P does to each node (n, d) [N]: -P N integrated over the boundary."""
    facets = mesh.boundary()
    corners = mesh.points[facets]
    if formulation == "solid" and facets.shape[1] == 4:  # half of each of the four triangles
        cut = np.array([[0, 1, 2], [2, 3, 0], [0, 1, 3], [1, 2, 3]])
        facets, corners = facets[:, cut].reshape(-1, 3), corners[:, cut].reshape(-1, 3, 3)
        normals = -0.25 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        shares = np.full(facets.shape, 1.0 / 3.0)
    elif formulation == "solid":
        normals = -0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        shares = np.full(facets.shape, 1.0 / 3.0)
    else:
        along = corners[:, 1] - corners[:, 0]
        normals = np.stack([along[:, 1], -along[:, 0]], axis=1)
        if formulation == "plane_strain":
            shares = np.full(facets.shape, 0.5 * DEPTH)
        else:  # the integral of N_a 2 pi r along the facet, over its length
            radius = corners[:, :, 0]
            shares = np.pi / 3.0 * (radius + radius.sum(axis=1, keepdims=True))
    force = np.zeros_like(mesh.points)
    d = mesh.points.shape[1]
    traction = normals @ P[:d, :d].T
    np.add.at(force, facets, -shares[:, :, None] * traction[:, None])
    return force


# u = (F - 1) X; revolved, shear would not be uniform.
FIELDS = {
    "plane_strain": np.array([[1.2, 0.3, 0.0], [-0.1, 1.1, 0.0], [0.0, 0.0, 1.0]]),
    "axisymmetric": np.diag([1.2, 0.9, 1.2]),
    "solid": np.array([[1.2, 0.3, 0.1], [-0.1, 1.1, 0.05], [0.0, -0.2, 0.9]]),
}


@WHOLE
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_patch(block, formulation, whole):
    """A linear field: every element has the exact stress, and what the nodes feel is that stress on
    the boundary, nothing inside.
    """
    from softsim.elements.geometry import measure_elements

    model, solver, mesh = block(formulation, whole)
    F = FIELDS[formulation]
    J, d = np.linalg.det(F), model.dimension
    x = model.points @ F[:d, :d].T
    found = measure_elements(model.regions[0], x)
    P = first_piola(F)
    sigma = P @ F.T / J
    deviator = sigma - np.trace(sigma) / 3.0 * np.eye(3)
    np.testing.assert_allclose(found.J, J, rtol=1e-13)
    np.testing.assert_allclose(found.von_mises, np.sqrt(1.5 * np.sum(deviator**2)), rtol=1e-12)
    np.testing.assert_allclose(found.nodal_pressure, -np.trace(sigma) / 3.0, rtol=1e-12)
    force = forces_at(solver, x)
    exact = surface_forces(mesh, formulation, P)
    assert np.abs(exact).max() > 0.1 * C10 * facet_area(formulation)
    np.testing.assert_allclose(
        force, exact, rtol=0.0, atol=ROUND_OFF * KAPPA * facet_area(formulation)
    )


@WHOLE
@pytest.mark.parametrize("formulation", ["plane_strain", "solid"])
def test_turned_by_a_right_angle(block, formulation, whole):
    """No stress, no force; in space about (1, 2, 2)/3."""
    model, solver, _ = block(formulation, whole)
    axis = [0.0, 0.0, 1.0] if model.dimension == 2 else np.array([1.0, 2.0, 2.0]) / 3.0
    Q = Rotation.from_rotvec(0.5 * np.pi * np.array(axis)).as_matrix()
    turned = model.points @ Q[: model.dimension, : model.dimension].T
    assert np.abs(turned - model.points).max() > 0.9 * SIDE
    force = forces_at(solver, turned)
    assert np.abs(force).max() < ROUND_OFF * KAPPA * facet_area(formulation)


def numbers(largest):
    return st.floats(-largest, largest, allow_subnormal=False)


@WHOLE
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_objectivity(block, formulation, whole):
    """Deformed, scattered, then turned by Q and moved: forces f become Q f.

    A ring cannot turn, only move along its axis: its forces stay.
    """
    model, solver, _ = block(formulation, whole)
    d = model.dimension
    turns = 0.0 if formulation == "axisymmetric" else np.pi
    along = np.array([0.0, 1.0] if formulation == "axisymmetric" else [1.0] * d)
    direction = [0.0, 0.0, 1.0] if d == 2 else [1.0, 1.0, 1.0]
    scatter = 0.03 * SIDE / COUNT

    @settings(derandomize=True, max_examples=60)
    @given(
        gradient=st.tuples(*[numbers(0.15)] * (d * d)),
        rotation=st.tuples(*[numbers(turns)] * 3),
        shift=st.tuples(*[numbers(SIDE)] * d),
        seed=st.integers(0, 1000),
    )
    def holds(gradient, rotation, shift, seed):
        F = np.eye(d) + np.reshape(gradient, (d, d))
        if formulation == "axisymmetric":
            F[0, 1] = 0.0  # the axis stays straight
        noise = np.random.default_rng(seed).standard_normal(model.points.shape)
        x = model.points @ F.T + scatter * noise
        if formulation == "axisymmetric":
            x = np.where(model.is_free, x, model.points)
        Q = Rotation.from_rotvec(np.multiply(direction, rotation)).as_matrix()[:d, :d]
        force = forces_at(solver, x)
        turned = forces_at(solver, x @ Q.T + along * shift)
        scale = KAPPA * facet_area(formulation)
        assert np.abs(force).max() > 1e-6 * scale
        assert np.abs(turned - force @ Q.T).max() < 2.0 * ROUND_OFF * scale  # of either

    holds()
