"""Every force is minus the gradient of its energy, by central differences, for every formulation.

A central difference of a smooth energy E with step h is off by h^2 E'''/6 + eps E / h; with the
steps below both are under 1e-6 of the largest force.
"""

import numpy as np
import pytest

from softsim.compute import fields

MESHES = {
    "plane_strain": "{generator: block, length: 4 mm, height: 3 mm, element_size: 1 mm}",
    "axisymmetric": "{generator: block, length: 4 mm, height: 3 mm, element_size: 1 mm}",
    "ring_section": "{generator: pfr_section, inner_diameter: 4 mm, outer_diameter: 8 mm, "
    "free_length: 4 mm, spikes_per_strip: 0, element_size: 1 mm}",
    "solid": "{generator: box, length: 3 mm, height: 3 mm, width: 3 mm, element_size: 1 mm}",
}
# Single parts on the rings.
SPIKED = ("bodies.b.mesh.spikes_per_strip=1", "bodies.b.mesh.root_thickness=2 mm",
          "bodies.b.mesh.spike_height=2 mm")  # fmt: skip
THICKNESS = {
    "plane_strain": "thickness: 5 mm",
    "axisymmetric": "",
    "ring_section": "thickness: 5 mm\n    sector: 80 deg\n    rings: skin",
    "solid": "",
}
POSITION = {
    "plane_strain": "[0 mm, 0 mm]",
    "axisymmetric": "[2 mm, 0 mm]",
    "ring_section": "[1 mm, 2 mm]",
    "solid": "[0 mm, 0 mm]",
}
FORMULATIONS = list(MESHES)
# Quadrilaterals or hexahedra in place of triangles or tetrahedra.
QUADS = ("bodies.b.mesh.cells=quad",)


def soft(formulation: str, extra: str = "") -> str:
    """A scene with one soft block off the axis."""
    return f"""
bodies:
  b:
    mesh: {MESHES[formulation]}
    formulation: {formulation}
    position: {POSITION[formulation]}
    {THICKNESS[formulation]}
    material: soft
materials:
  soft: {{law: yeoh, C10: 36 kPa, C20: 5 kPa, C30: 1 kPa, density: 1000 kg/m^3,
         prony: [{{g: 0.3, relaxation_time: 1 ms}}]}}
environment: {{gravity: 0 m/s^2}}
solver: {{bulk_viscosity: 0}}
time: {{end: 1 s}}
{extra}"""


def scattered(model, seed, amplitude):
    """Every node off its place at random."""
    noise = np.random.default_rng(seed).standard_normal(model.points.shape)
    return model.points + amplitude * noise


def alike(model, x):
    """Of a ring section both strips as their mean: there the volume of its elements, whose area is
    a strip's own, is that of frusta between diameters. Others as they are.
    """
    geometry = model.regions[0].geometry
    if geometry.name != "ring_section":
        return x
    axis = 0.5 * (model.points[:, 1].min() + model.points[:, 1].max())
    mirror = x[geometry.opposite] * [1.0, -1.0] + [0.0, 2.0 * axis]
    return 0.5 * (x + mirror)


def freeze_metric(solver):
    """A viscous metric off equilibrium that stays: the branch energy is then a function of
    positions alone. Springs of hourglass modes stay at zero.
    """
    for body in solver.terms.elements:
        metric = dict(zip(body.metric.components, body.points.viscous_metric, strict=True))
        at_rest = {name: fields.read(field) for name, field in metric.items()}
        shear = 0.05 * np.sqrt(at_rest["aa"] * at_rest["bb"])
        fields.write(metric["aa"], 1.1 * at_rest["aa"])
        fields.write(metric["bb"], 0.9 * at_rest["bb"])
        fields.write(metric["ab"], at_rest["ab"] + shear)
        modulus = fields.read(body.points.branch_modulus)[0]
        stress = dict(zip(body.metric.components, body.points.branch_stress, strict=True))
        for name, field in metric.items():
            fields.write(stress[name], modulus * fields.read(field))
        body.points.relaxation.share.fill(0.0)


def forces_at(solver, x):
    """Nodal forces (n, d) with the nodes at x."""
    nodes = solver.terms.nodes
    nodes.velocity.fill(0.0)
    fields.write(nodes.position, np.ascontiguousarray(x[None]))
    solver.find_forces(1e-9)
    return fields.read(nodes.force)[0]


def gradient(energy, x, nodes, step=1e-9):
    """-dE/dx by central differences at `nodes`."""
    result = np.zeros((len(nodes), x.shape[1]))
    for k, a in enumerate(nodes):
        for i in range(x.shape[1]):
            ends = []
            for sign in (1.0, -1.0):
                moved = x.copy()
                moved[a, i] += sign * step
                ends.append(energy(moved))
            result[k, i] = -(ends[0] - ends[1]) / (2.0 * step)
    return result


MOONEY_RIVLIN = "law: mooney_rivlin, C10: 30 kPa, C01: 6 kPa"
OGDEN = "law: ogden, mu: [60 kPa, 10 kPa, 2 kPa], alpha: [1.3, -2.5, 7]"


def made_of(law):
    """What replaces the material by one of this law."""
    more = "density: 1000 kg/m^3, prony: [{g: 0.3, relaxation_time: 1 ms}]"
    return (f"materials.soft={{{law}, {more}}}",)


@pytest.mark.parametrize(
    ("formulation", "overrides"),
    [
        *[(f, ()) for f in FORMULATIONS],
        ("ring_section", SPIKED),
        *[(f, QUADS) for f in FORMULATIONS],
        ("ring_section", SPIKED + QUADS),
        ("plane_strain", made_of(MOONEY_RIVLIN)),
        *[(f, made_of(OGDEN)) for f in ("plane_strain", "solid")],
        pytest.param("axisymmetric", made_of(OGDEN), marks=pytest.mark.slow),
    ],
)
def test_elements(build, start, formulation, overrides):
    """Law, averaged nodal pressure and Maxwell branch together."""
    from softsim.solver.energy import EnergyReader

    solver = start(build(soft(formulation), *overrides))
    reader = EnergyReader(solver)
    freeze_metric(solver)
    x = scattered(solver.models[0], 1, 0.08e-3)

    def energy(at):
        forces_at(solver, at)
        return reader.read().internal

    nodes = [0, 3, 7, 10, 15]
    exact = gradient(energy, x, nodes)
    force = forces_at(solver, x)[nodes]
    assert np.abs(force).max() > 1e-3
    np.testing.assert_allclose(force, exact, atol=1e-6 * np.abs(force).max())


NORMALS = {
    "plane_strain": "[0.3, 1]",
    "axisymmetric": "[0, 1]",
    "ring_section": "[0.3, 1]",
    "solid": "[0.3, 1, 0.2]",
}
POINTS = {
    "plane_strain": "[-2 mm, -1 mm]",
    "axisymmetric": "[0 mm, -1 mm]",
    "ring_section": "[-1 mm, -3 mm]",
    "solid": "[-2 mm, -1 mm]",
}


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_contact_normal_and_sticking(build, start, formulation):
    """Penalty springs, normal and tangential, of nodes that stick."""
    from softsim.solver.energy import EnergyReader

    text = soft(formulation, "contact: {friction_coefficient: 1000, damping_ratio: 0}\n")
    text = text.replace(
        "environment: {gravity: 0 m/s^2}",
        "environment: {gravity: 0 m/s^2, walls: {w: {kind: plane, normal: "
        f"{NORMALS[formulation]}, point: {POINTS[formulation]}}}}}}}",
    )
    model = build(text)
    solver = start(model)
    reader = EnergyReader(solver)
    freeze_metric(solver)
    down = np.zeros(model.dimension)
    down[1] = 2.0e-3
    inside = model.points - down
    forces_at(solver, inside)  # the anchors are set here
    x = inside + scattered(model, 2, 1e-5) - model.points

    def energy(at):
        forces_at(solver, at)
        read = reader.read()
        return read.contact + read.internal

    touching = np.flatnonzero(fields.read(solver.terms.wall_contacts[0].normal_force)[0] > 0.0)
    assert len(touching) > 2
    nodes = model.contact.nodes[touching[:3]]
    exact = gradient(energy, x, nodes)
    force = forces_at(solver, x)[nodes]
    np.testing.assert_allclose(force, exact, atol=1e-6 * np.abs(force).max())


@pytest.mark.parametrize("overrides", [(), QUADS], ids=["simplexes", "quads"])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_follower_pressure_is_the_gradient_of_volume(build, start, formulation, overrides):
    """Pressure on the whole surface: force = -p dV/dx, V the body's own volume by its elements.

    The revolved volume of a cell is exact by Pappus, that of its edges by frustums; they agree.
    """
    load = (
        "loads: {p: {kind: follower_pressure, facets: [b.surface], "
        "profile: {kind: constant, value: 2 kPa}}}\n"
    )
    model = build(soft(formulation, load), *overrides)
    solver = start(model)
    # Compare with the same deformation without pressure: what is left is the pressure.
    freeze_metric(solver)
    x = alike(model, scattered(model, 3, 0.08e-3))
    with_pressure = forces_at(solver, x)
    solver.terms.loads[0].kernel.table.value.fill(0.0)
    force = with_pressure - forces_at(solver, x)
    body = model.regions[0]

    def energy(at):
        return 2000.0 * float(body.geometry.volumes(at, body.cells).sum())

    nodes = model.contact.nodes[:6]
    exact = gradient(energy, x, nodes, step=1e-7)
    np.testing.assert_allclose(force[nodes], exact, atol=1e-9 * np.abs(force).max() + 1e-12)
    inside = -float(body.geometry.volumes(x, body.cells).sum())
    assert model.pressures[0].volume(x) == pytest.approx(inside, rel=1e-12)
    # A closed surface under uniform pressure: no resultant (of what is revolved: along the axis),
    # no moment (of what is not).
    scale = np.abs(force).sum()
    along = [1] if formulation == "axisymmetric" else range(model.dimension)
    assert np.abs(force.sum(axis=0)[along]).max() < 1e-14 * scale
    if formulation != "axisymmetric":
        moment = np.cross(np.pad(x, ((0, 0), (0, 3 - x.shape[1]))),
                          np.pad(force, ((0, 0), (0, 3 - x.shape[1]))))  # fmt: skip
        assert np.abs(moment.sum(axis=0)).max() < 1e-14 * scale * np.abs(x).max()


@pytest.mark.parametrize("overrides", [(), QUADS], ids=["simplexes", "quads"])
@pytest.mark.parametrize("formulation", ["plane_strain", "ring_section", "solid"])
def test_rigid_rotation_gives_no_stress(build, start, formulation, overrides):
    """Turned as a whole, the body feels nothing: forces stay at round-off."""
    model = build(soft(formulation), *overrides)
    solver = start(model)
    for angle in (0.3, np.pi / 2, 2.5):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.eye(model.dimension)
        turn[:2, :2] = [[c, -s], [s, c]]
        if model.dimension == 3:  # about a slanted axis
            tilt = np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
            turn = tilt @ turn @ tilt.T
        turned = model.points @ turn.T
        # Round-off: eps times the stress scale (bulk modulus) times a facet's area.
        scale = model.regions[0].material.bulk_modulus * 1e-3 * 5e-3
        assert np.abs(forces_at(solver, turned)).max() < 1e-13 * scale


def test_a_ring_that_moves_as_a_whole_feels_nothing(build, start):
    """Neither force nor pressure depends on where the axis is; and each ring's forces across the
    axis add up to nothing, whatever its state: what pulls one side pulls the other as much, on one
    line. Turned as a whole, blown up as it is, its forces turn with it.
    """
    load = (
        "loads: {p: {kind: follower_pressure, facets: [b.chamber], "
        "profile: {kind: constant, value: 2 kPa}}}\n"
    )
    model = build(soft("ring_section", load), *SPIKED)
    solver = start(model)
    freeze_metric(solver)
    shift = [3e-3, -20e-3]
    at_rest, moved = forces_at(solver, model.points), forces_at(solver, model.points + shift)
    # Round-off: eps times the bulk modulus times a facet's area, as for a rigid rotation.
    scale = model.regions[0].material.bulk_modulus * 1e-3 * 5e-3
    np.testing.assert_allclose(moved, at_rest, atol=1e-13 * scale)
    x = scattered(model, 5, 0.08e-3)
    force = forces_at(solver, x)
    assert np.abs(force).max() > 1e-3
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * np.abs(force).sum()
    moment = x[:, 0] @ force[:, 1] - x[:, 1] @ force[:, 0]
    assert abs(moment) < 1e-13 * np.abs(force).sum() * np.abs(x).max()
    np.testing.assert_allclose(
        forces_at(solver, x + shift), force, atol=1e-12 * np.abs(force).sum()
    )
    for angle in (0.7, np.pi / 2, np.pi):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, s], [-s, c]])
        np.testing.assert_allclose(
            forces_at(solver, x @ turn + shift), force @ turn, atol=1e-12 * np.abs(force).sum()
        )


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_patch(build, start, formulation):
    """A linear displacement field on a distorted mesh: uniform stress, no force inside.

    Of a ring the field u_r = a r, u_axis = c axis, which strains it uniformly; shear would not.
    """
    text = soft(formulation).replace("element_size: 1 mm", "element_size: 0.7 mm")
    model = build(text)
    gradients = {
        "plane_strain": np.array([[0.2, 0.3], [-0.1, 0.1]]),
        "axisymmetric": np.diag([0.2, -0.1]),
        "ring_section": np.diag([-0.1, 0.2]),
        "solid": np.array([[0.2, 0.3, 0.1], [-0.1, 0.1, 0.05], [0.0, -0.2, -0.1]]),
    }
    surface = model.bodies[0].node_sets["surface"]
    inside = np.setdiff1d(np.arange(len(model.points)), surface)
    assert len(inside) >= 6
    solver = start(model)
    force = forces_at(solver, model.points @ (np.eye(model.dimension) + gradients[formulation]).T)
    assert np.abs(force[inside]).max() < 1e-12 * np.abs(force).max()
