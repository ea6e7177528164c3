"""Forces of deformable surfaces on each other: gradient, momenta, joints, who touches whom."""

import numpy as np
import pytest
from surface_rig import PLANE, SPACE, SurfaceRig, crumpled, pressed_together

from softsim.builder.contact import plane_strain_modulus
from softsim.compute import fields

THICKNESS = 5e-3
FRICTIONLESS = ("contact.friction_coefficient=0", "contact.damping_ratio=0")
DEPTH = 50e-6


GLUE = (
    "contact.adhesion={glue: {work_of_adhesion: 0.1 J/m^2, range: 80 um, shear_strength: 1 kPa, "
    "between: [lower, upper]}}"
)
END = "bodies.upper.position=[0.45 mm, 2.5 mm]"  # a facet of the lower one ends 0.05 mm beyond it


@pytest.mark.parametrize(
    ("text", "more", "depth"),
    [
        (PLANE, (), DEPTH),
        (SPACE, (), DEPTH),
        (PLANE, (GLUE,), 2e-6),
        (PLANE, (GLUE, END), -40e-6),
        (SPACE, (GLUE,), -40e-6),
    ],
    ids=["plane", "space", "plane, adhering", "plane, attracted", "space, attracted"],
)
def test_forces_of_nodes_on_facets_edges_and_corners(build, fresh_taichi, text, more, depth):
    """They are the gradient of the energy; with friction and dashpots at work, while everything
    moves at random, they have no resultant and no moment.

    Central differences are off by the square of their step over the depth, here 1e-4 at most.
    """
    model = build(text, *FRICTIONLESS, *more)
    rig = SurfaceRig(model)
    x, step = crumpled(model, depth), 5e-9
    forces = rig.place(x)
    pressed = np.flatnonzero(forces.any(axis=1))
    assert len(pressed) >= 8
    for a in pressed[:: max(1, len(pressed) // 10)]:
        for i in range(model.dimension):
            energies = []
            for sign in (1.0, -1.0):
                moved = x.copy()
                moved[a, i] += sign * step
                rig.place(moved)
                energies.append(rig.energy())
            expected = -(energies[0] - energies[1]) / (2.0 * step)
            assert forces[a, i] == pytest.approx(expected, abs=1e-4 * np.abs(forces).max())

    rig.contact.friction_coefficient.fill(0.4)
    rig.contact.penalty.c_n.fill(1e-3)
    forces = rig.place(x, np.random.default_rng(4).standard_normal(x.shape), dt=5e-6)
    rubbing = np.abs(fields.read(rig.contact.stretch)).max()
    assert rubbing > 1e-6 if depth > 0.0 else rubbing < 1e-15
    lift = np.zeros((len(x), 3 - model.dimension))
    moments = np.cross(np.hstack([x, lift]), np.hstack([forces, lift]))
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-13 * np.abs(forces).sum())
    np.testing.assert_allclose(moments.sum(axis=0), 0.0, atol=1e-13 * np.abs(moments).sum())


def test_a_body_that_slides_onto_an_adhering_surface(build, fresh_taichi):
    """It is attracted there, with the stress times its face; the potential counts as dissipated.

    Of its own points, which slid; those of the lower body, with the other half of the area, are put
    into contact anew.
    """
    model = build(
        PLANE.replace("position: [0.3 mm, 2.5 mm]", "position: [-1.6 mm, 2.5 mm]")
        .replace("formulation: plane_strain, thickness: 5 mm, material: soft}",
                 "formulation: plane_strain, thickness: 5 mm, material: soft, sets: {sticky: "
                 "{box: [[-1 um, 1.99 mm], [5 mm, 2.01 mm]]}}}", 1),
        *FRICTIONLESS,
        "bodies.upper.mesh.length=2 mm",
        "contact.self_contact=[]",
        "contact.pairs=[{between: [lower.top, upper.bottom]}]",
        "contact.adhesion={glue: {work_of_adhesion: 0.1 J/m^2, range: 80 um, "
        "between: [lower.sticky, upper.bottom]}}",
    )  # fmt: skip
    rig = SurfaceRig(model)
    upper, x = model.bodies[1].nodes, pressed_together(model, 1e-6)
    pressed = rig.place(x)[upper, 1].sum()
    assert rig.energy() > 0.0  # springs alone
    x[upper, 0] += 3.2e-3
    held = rig.place(x)[upper, 1].sum()
    [adhesion] = rig.contact.adhesion
    attraction = fields.read(adhesion.attraction)[0].sum()
    stress = attraction / (2e-3 * THICKNESS)
    assert 0.9 * 2.0 * 0.1 / 80e-6 < stress < 2.0 * 0.1 / 80e-6
    assert held == pytest.approx(pressed - attraction, rel=1e-6)
    potential = attraction * (0.5 * 80e-6 + 1e-6)
    dissipated = fields.read(rig.contact.damping_dissipation)[0].sum()
    assert dissipated == pytest.approx(0.5 * potential, rel=1e-6)


def test_the_springs_press_with_k_g(build, fresh_taichi):
    """On the 6 mm of the upper block, half of it from its points, half from those of the lower one
    below it: a tenth of E / (1 - nu^2) over one hundredth of the facets' 1 mm.
    """
    model = build(PLANE, *FRICTIONLESS, "contact.allowed_penetration=0.01")
    rig = SurfaceRig(model)
    forces = rig.place(pressed_together(model, DEPTH))
    modulus = plane_strain_modulus(model.bodies[0].regions[0].material)
    k_n = 0.1 * modulus / (0.01 * 1e-3) * 6e-3 * THICKNESS
    on_upper = forces[model.bodies[1].nodes].sum(axis=0)
    np.testing.assert_allclose(on_upper, [0.0, k_n * DEPTH], rtol=1e-9, atol=1e-12)
    assert rig.energy() == pytest.approx(0.5 * k_n * DEPTH**2, rel=1e-9)


def test_the_force_is_continuous_over_a_joint(build, fresh_taichi):
    """A corner of the upper block slides over a hollow of the lower one: with the normal turning
    about the node at its bottom, the force k (x - y) changes by no more than k times the step.
    """
    model = build(PLANE, *FRICTIONLESS)
    rig = SurfaceRig(model)
    lower, upper = model.bodies
    hollow = np.argmin(np.abs(lower.points - [1e-3, 2e-3]).sum(axis=1))
    corner = upper.first_node + np.argmin(upper.points.sum(axis=1))
    point = np.searchsorted(model.self_contact.nodes, corner)
    found, facets, step = [], set(), 0.5e-6
    for shift in step * np.arange(-20, 20):
        x = model.points.copy()
        x[hollow, 1] -= 0.1e-3  # both facets lean by 0.1, and meet over 10 um at this depth
        x[corner] = x[hollow] + [shift, -DEPTH]
        rig.place(x)
        found.append(fields.read(rig.contact.on_point)[0, point])
        facets.add(int(rig.facets[point]))
    k_n = fields.read(rig.contact.fraction)[0, point] * model.self_contact.penalty.k_n[point]
    assert len(facets) == 2
    assert np.linalg.norm(found, axis=1).min() > 0.95 * k_n * DEPTH
    assert np.linalg.norm(np.diff(found, axis=0), axis=1).max() < 1.001 * k_n * step


def test_a_turning_pair_does_not_rub(build, fresh_taichi):
    """Pressed together and turned as one: no sliding, so friction's springs stay as they are."""
    model = build(PLANE)
    rig = SurfaceRig(model)
    x = pressed_together(model, DEPTH)
    rig.place(x)
    spin, dt = 300.0, 1e-6
    turning = spin * np.stack([-x[:, 1], x[:, 0]], axis=1)
    rig.place(x, turning, dt)
    assert (rig.facets >= 0).sum() == (7 + 6) + (6 + 6)
    slid = np.abs(fields.read(rig.contact.stretch)).max()
    assert slid < 1e-12 * np.abs(turning).max() * dt


SPIKES = """
bodies:
  robot: {mesh: {generator: pfr_section, element_size: 0.6 mm}, formulation: ring_section,
          thickness: 7 mm, sector: 90 deg, rings: skin, material: dragon_skin_10, fixed: [knots]}
contact: {self_contact: [robot]}
time: {end: 1 s}
"""


def test_spikes_of_one_body_touch_each_other(build, fresh_taichi):
    """At rest nothing touches: not what is next to it, not the other side of skin and spikes; nor
    when the skin is half as thick. A spike a little inside the next one is pushed back by it.
    """
    model = build(SPIKES)
    rig = SurfaceRig(model)
    x = model.points.copy()
    assert not rig.place(x).any()
    thin = x.copy()
    skin = np.abs(x[:, 1]) < 8.5e-3
    thin[skin, 1] = np.sign(x[skin, 1]) * (0.5 * np.abs(x[skin, 1]) + 0.5 * 8.5e-3)
    assert not rig.place(thin).any()

    moved, struck = (model.bodies[0].node_sets[row] for row in ("j2", "j3"))
    moved, struck = (row[x[row, 1] > 0.0] for row in (moved, struck))
    high = moved[x[moved, 1] > 10.5e-3]
    forces = np.zeros_like(x)
    while not forces.any():
        x[high, 0] -= 50e-6
        forces = rig.place(x)
    assert set(np.flatnonzero(forces.any(axis=1))) <= {*moved, *struck}
    assert forces[moved].sum(axis=0)[0] > 0.0 > forces[struck].sum(axis=0)[0]
