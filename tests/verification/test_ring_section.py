"""A ring section whose strips stay mirror images is the revolved body: force for force, volume for
volume, the same cells revolved once about y in a half section and standing for a sector as strips.

Both have one integration point, the centroid, so they differ by round-off only.
"""

import meshes
import numpy as np
import pytest

from softsim.compute import fields

LENGTH, INNER, OUTER = 6e-3, 4e-3, 6e-3
AXIS = 3e-3
SECTOR = 1.3
SCENE = """
bodies:
  b: {mesh: {file: b.inp, length_unit: 1 m}, formulation: %s, material: dragon_skin_10}
environment: {gravity: 0 m/s^2}
loads:
  p: {kind: follower_pressure, facets: [b.inner], profile: {kind: constant, value: 3 kPa}}
output: {probes: {v: {kind: volume, facets: [b.inner]}}}
conditions: {ends: {kind: fixed, nodes: b.ends, directions: [%s]}}
solver: {bulk_viscosity: 0}
time: {end: 1 s}
"""
STRIPS = (
    f"ring_section, thickness: 5 mm, sector: {SECTOR} rad, rings: cells, position: [0 m, {AXIS} m]"
)


def half_section(strips):
    """The upper strip with radius and axis swapped, which turns its cells round."""
    count = len(strips.points) // 2
    upper = strips.cells[(strips.cells < count).all(axis=1)]
    sets = {name: nodes[nodes < count] for name, nodes in strips.node_sets.items()}
    return meshes.SmallMesh(strips.points[:count, ::-1], upper[:, ::-1], sets, strips.surfaces)


@pytest.fixture
def revolved_and_ring(build, tmp_path):
    """Models of the same tube in both formulations."""
    strips = meshes.two_strips(LENGTH, INNER, OUTER, 6, 3)
    ends = np.concatenate([strips.node_sets["left"], strips.node_sets["right"]])
    strips = meshes.SmallMesh(
        strips.points, strips.cells, {**strips.node_sets, "ends": ends}, strips.surfaces
    )
    models = []
    for mesh, formulation, across in (
        (half_section(strips), "axisymmetric", "y"),
        (strips, STRIPS, "x"),
    ):
        mesh.write(tmp_path / "b.inp", formulation.partition(",")[0])
        models.append(build(SCENE % (formulation, across)))
    return models


def matched(revolved, ring):
    """Nodes of the ring section that are the revolved body's nodes, and those opposite them."""
    from scipy.spatial import cKDTree

    strip = revolved.points[:, ::-1] + [0.0, AXIS]
    distance, upper = cKDTree(ring.points).query(strip)
    assert distance.max() < 1e-12
    return upper, ring.regions[0].geometry.opposite[upper]


def blown(revolved):
    """A smooth swelling with a little noise, so that no cell looks like its neighbour."""
    r, z = revolved.points.T
    bulge = 1.5e-3 * np.cos(np.pi * z / LENGTH)
    noise = 0.05e-3 * np.random.default_rng(8).standard_normal(revolved.points.shape)
    return revolved.points + np.stack([bulge * OUTER / r, 0.1 * z], axis=1) + noise


def as_strips(revolved, ring, x):
    """The ring section's nodes (n, 2) where the revolved body's are at x."""
    upper, lower = matched(revolved, ring)
    result = np.empty_like(ring.points)
    result[upper] = x[:, ::-1] + [0.0, AXIS]
    result[lower] = x[:, ::-1] * [1.0, -1.0] + [0.0, AXIS]
    return result


def forces(solver, x):
    """Nodal forces (n, d) [N] of cells and pressure with the nodes at x, nothing relaxed yet."""
    nodes = solver.terms.nodes
    solver.terms.elements[0].points.relaxation.share.fill(0.0)
    nodes.velocity.fill(0.0)
    fields.write(nodes.position, np.ascontiguousarray(x[None]))
    solver.find_forces(1e-9)
    return fields.read(nodes.force)[0]


def test_masses_and_volumes_are_a_sector_of_those_revolved(revolved_and_ring):
    revolved, ring = revolved_and_ring
    upper, lower = matched(revolved, ring)
    share = SECTOR / (2.0 * np.pi)
    np.testing.assert_allclose(ring.mass[upper], share * revolved.mass, rtol=1e-12)
    np.testing.assert_allclose(ring.mass[lower], share * revolved.mass, rtol=1e-12)
    x = blown(revolved)
    strips = as_strips(revolved, ring, x)
    for model_part in ("pressures", "probes"):
        a, b = getattr(revolved, model_part)[0], getattr(ring, model_part)[0]
        facets = [p.members if model_part == "probes" else p.facets for p in (a, b)]
        whole = a.geometry.enclosed_volume(x, facets[0])
        assert whole > np.pi * INNER**2 * LENGTH
        assert b.geometry.enclosed_volume(strips, facets[1]) == pytest.approx(2 * share * whole)


def test_forces_are_a_sector_of_those_revolved(revolved_and_ring, start):
    """On each strip, whatever the state; at rest and blown up by half."""
    revolved, ring = revolved_and_ring
    x = blown(revolved)
    whole = forces(start(revolved), x)
    upper, lower = matched(revolved, ring)
    part = forces(start(ring), as_strips(revolved, ring, x))
    share = SECTOR / (2.0 * np.pi)
    # Round-off: eps times the bulk modulus times the area of a facet that 2 pi go around.
    scale = revolved.regions[0].material.bulk_modulus * 1e-3 * 2.0 * np.pi * OUTER
    assert np.abs(whole).max() > 1e-6 * scale
    np.testing.assert_allclose(part[upper], share * whole[:, ::-1], atol=1e-13 * scale)
    np.testing.assert_allclose(part[lower], part[upper] * [1.0, -1.0], atol=1e-13 * scale)


def test_stable_steps_agree(revolved_and_ring):
    """The revolved body's strips cannot swing alike, the ring section's can: then F_zz has no part
    in the fastest mode, whose square it changes by (side of a cell / diameter)^2 at most.
    """
    from softsim.solver.stable_step import stable_step

    a, b = (stable_step(m, m.points).stable for m in revolved_and_ring)
    assert b == pytest.approx(a, rel=(1e-3 / (2.0 * INNER)) ** 2)
