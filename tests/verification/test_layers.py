"""Layers on bodies: forces against energies, strips and membranes that are pulled, a beam with one
stiff side, the stable step.
"""

import numpy as np
import pytest

from softsim.compute import fields

SOFT = "{law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}"
E_MODULUS, NU, THICKNESS, DENSITY = 20e6, 0.25, 0.1e-3, 800.0
PAPER = (f"thickness: {THICKNESS} m, youngs_modulus: {E_MODULUS} Pa, poisson_ratio: {NU}, "
         f"density: {DENSITY} kg/m^3")  # fmt: skip
DEPTH = 3e-3


def block(kind, cells="simplex"):
    """A scene of a block, 6 mm long and 3 mm high, with paper below."""
    mesh, formulation = {
        "plane": ("generator: block", f"plane_strain, thickness: {DEPTH} m"),
        "axial": ("generator: block", "axisymmetric, position: [4 mm, 0 mm]"),
        "space": ("generator: box, width: 3 mm", "solid"),
    }[kind]
    return f"""
bodies:
  b: {{mesh: {{{mesh}, length: 6 mm, height: 3 mm, element_size: 1.5 mm, cells: {cells}}},
      formulation: {formulation}, material: soft}}
layers: {{paper: {{facets: b.bottom, {PAPER}}}}}
materials: {{soft: {SOFT}}}
environment: {{gravity: 0 m/s^2}}
solver: {{bulk_viscosity: 0}}
time: {{end: 1 s}}
"""


def deform(solver, x):
    """Find forces with the nodes at rest at x (n, d) [m]."""
    nodes = solver.terms.nodes
    nodes.velocity.fill(0.0)
    fields.write(nodes.position, np.ascontiguousarray(x[None]))
    solver.find_forces(1e-9)


def layer_forces(build, start, kind, cells, F):
    """Forces (n, d) [N] of the layer alone under a uniform deformation F, and the model."""
    model = build(block(kind, cells))
    solver = start(model)
    deform(solver, model.points @ F.T)
    forces, facets = np.zeros_like(model.points), model.structures[0].facets
    first = solver.terms.structures[0].first_slot
    for k, component in enumerate(solver.terms.nodes.corner_forces.component):
        slots = fields.read(component)[0, first : first + facets.size]
        np.add.at(forces[:, k], facets.ravel(), slots)
    return forces, model


@pytest.mark.parametrize("kind", ["plane", "axial", "space"])
def test_forces_are_slopes_of_the_energy(build, start, kind):
    """Of a block that is deformed at random, along random directions; the layer holds a good part
    of the energy.
    """
    from softsim.solver.energy import EnergyReader

    model = build(block(kind))
    solver, layer = start(model), model.structures[0]
    reader, rng = EnergyReader(solver), np.random.default_rng(3)
    x = model.points + 0.15e-3 * rng.uniform(-1.0, 1.0, model.points.shape)

    def energy(x):
        deform(solver, x)
        return reader.read().internal

    whole = energy(x)
    forces = fields.read(solver.terms.nodes.force)[0]
    S = layer.stress(x)
    first, second = layer.lame
    trace = np.trace(S, axis1=1, axis2=2)
    squares = np.einsum("mpq,mpq->m", S, S)
    # S : E of the law solved for E.
    stored = (squares - first / (2.0 * first + 2.0 * second) * trace**2) / (4.0 * second)
    assert layer.volumes @ stored > 0.4 * whole
    for _ in range(3):
        way, step = rng.uniform(-1.0, 1.0, x.shape), 1e-9
        slope = (energy(x + step * way) - energy(x - step * way)) / (2.0 * step)
        assert slope == pytest.approx(-(forces * way).sum(), rel=1e-6)


def test_a_strip_is_pulled(build, start, record_verification):
    """In plane strain with the stretch l: E_Y t b / (1 - nu^2) (l^2 - 1) / 2 l."""
    stretch = 1.05
    forces, model = layer_forces(build, start, "plane", "simplex", np.diag([stretch, 0.97]))
    pull = -forces[model.bodies[0].node_sets["right"], 0].sum()
    area = THICKNESS * DEPTH
    exact = E_MODULUS * area / (1.0 - NU**2) * 0.5 * (stretch**2 - 1.0) * stretch
    record_verification("layer, strip in plane strain: force [N]", exact, pull)
    assert pull == pytest.approx(exact, rel=1e-10)
    bottom = model.bodies[0].node_sets["bottom"]
    inner = np.setdiff1d(np.arange(len(forces)), bottom)
    assert np.abs(forces[inner]).max() < 1e-9 * exact


def test_a_tube_is_widened(build, start, record_verification):
    """Revolved and widened by h without being stretched along: outwards in all
    E_Y / (1 - nu^2) (h^2 - 1) / 2 h V / R, V / R = 2 pi t L of a flat ring of any radius.
    """
    h = 1.04
    forces, _ = layer_forces(build, start, "axial", "simplex", np.diag([h, 1.0]))
    # A ring from 1 to 7 mm: along the radius it is stretched alike, by S_rr = S_zz.
    stress = E_MODULUS / (1.0 - NU) * 0.5 * (h**2 - 1.0)
    rim = stress * h * THICKNESS * 2.0 * np.pi * 7e-3  # what pulls at its outer rim
    inner = stress * h * THICKNESS * 2.0 * np.pi * 1e-3
    total = forces[:, 0].sum()
    around = stress * h * THICKNESS * 2.0 * np.pi * 6e-3
    record_verification("layer, widened ring: radial force [N]", -around, total)
    assert total == pytest.approx(-around, rel=1e-10)
    assert rim - inner == pytest.approx(around, rel=1e-12)  # they balance it


@pytest.mark.parametrize("cells", ["simplex", pytest.param("quad", marks=pytest.mark.slow)])
def test_a_membrane_is_pulled_and_sheared(build, start, record_verification, cells):
    """In space, with E = (C - 1) / 2 in its plane: on its side x the forces F S e_x t b, on that
    of z F S e_z t L.
    """
    F = np.array([[1.04, 0.0, 0.03], [0.0, 0.95, 0.0], [0.01, 0.0, 0.98]])
    forces, model = layer_forces(build, start, "space", cells, F)
    G = F[:, [0, 2]]
    strain = 0.5 * (G.T @ G - np.eye(2))
    S = E_MODULUS / (1.0 + NU) * (strain + NU / (1.0 - NU) * np.trace(strain) * np.eye(2))
    sets = model.bodies[0].node_sets
    x, z = model.points[:, 0], model.points[:, 2]
    # Corners belong to two sides, a node of the inside to none: moments tell the stress.
    area = 6e-3 * 3e-3 * THICKNESS
    stress = -np.einsum("ni,nj->ij", forces, np.stack([x, z], axis=1)) / area
    record_verification(f"layer, membrane of {cells}: S_xx [Pa]", S[0, 0], (np.linalg.pinv(G)
                        @ stress)[0, 0])  # fmt: skip
    np.testing.assert_allclose(stress, G @ S, rtol=0.0, atol=1e-9 * np.abs(S).max())
    inner = np.setdiff1d(sets["bottom"], np.concatenate(
        [sets[side] for side in ("left", "right", "back", "front")]))  # fmt: skip
    assert np.abs(forces[inner]).max() < 1e-9 * np.abs(forces).max()


def test_mass_of_a_layer(build):
    layer = build(block("plane"))
    added = layer.mass - build(block("plane").replace("layers:", "layout: ~ #")).mass
    assert added.sum() == pytest.approx(DENSITY * THICKNESS * DEPTH * 6e-3, rel=1e-12)
    assert layer.structures[0].masses.sum() == pytest.approx(added.sum(), rel=1e-12)
    bottom = layer.bodies[0].node_sets["bottom"]
    assert np.setdiff1d(np.flatnonzero(added > 1e-15), bottom).size == 0


def test_a_beam_with_a_stiff_side_bends_as_a_bimorph(build, fresh_taichi, record_verification):
    """A beam, E_B h, with a layer k = E_Y t on one side, both over 1 - nu^2: about the neutral axis
    it bends with E_B h^3 / 12 + E_B h k / (E_B h + k) h^2 / 4; held at its root it swings at
    1.8751^2 / 2 pi L^2 sqrt(EI / m'). The paper strip of 20 MPa makes it 1.8 times as fast.
    """
    from softsim.solver.natural_modes import natural_modes

    L, H = 40e-3, 1e-3
    scene = f"""
bodies:
  b: {{mesh: {{generator: block, length: {L} m, height: {H} m, element_size: 0.25 mm, cells: quad}},
      formulation: plane_strain, thickness: {DEPTH} m, material: soft, fixed: [left]}}
layers: {{paper: {{facets: b.bottom, {PAPER}}}}}
materials: {{soft: {{law: neo_hooke, C10: 36 kPa, bulk_modulus: 100 MPa, density: 1000 kg/m^3}}}}
time: {{end: 1 s}}
"""
    found, bare = (
        natural_modes(model, model.bodies[0], 1).modes[0].frequency
        for model in (build(scene), build(scene.replace("layers:", "layout: ~ #")))
    )

    def closed_form(k, mass):
        beam = 4.0 * 72e3 * H  # 3 mu / (1 - 1/4)
        bending = beam * H**2 / 12.0 + beam * k / (beam + k) * H**2 / 4.0
        return 1.875104**2 / (2.0 * np.pi * L**2) * np.sqrt(bending / mass)

    k = E_MODULUS * THICKNESS / (1.0 - NU**2)
    stiff = closed_form(k, 1000.0 * H + DENSITY * THICKNESS)
    record_verification("layer, bimorph: first mode [Hz]", stiff, found)
    assert bare == pytest.approx(closed_form(0.0, 1000.0 * H), rel=0.01)
    assert found == pytest.approx(stiff, rel=0.02)
    assert found > 1.5 * bare


@pytest.mark.parametrize("kind", ["plane", "space"])
def test_the_stable_step_bounds_a_layer(build, start, kind):
    """The largest omega with the layer's own stiffness is below 2 / dt, and no less than half of
    it; free after a blow it keeps its energy.
    """
    from softsim.solver.energy import EnergyReader
    from softsim.solver.natural_modes import inertia_root, rest_stiffness, structure_stiffness
    from softsim.solver.stable_step import stable_step

    model = build(block(kind))
    (body,) = model.bodies
    found = stable_step(model, model.points)
    solver = start(model, share=0.5)
    rng = np.random.default_rng(5)
    fields.write(solver.terms.nodes.velocity, rng.uniform(-0.02, 0.02, (1, *model.points.shape)))
    reader = EnergyReader(solver)
    before = reader.read()
    solver.advance(2000)
    energies = reader.read()
    assert energies.internal > 0.2 * before.kinetic
    assert energies.balance == pytest.approx(before.balance, rel=0.15)
    K = rest_stiffness(model, body, body.regions[0]).matrix + structure_stiffness(model, body)
    _, inverse_root = inertia_root(model, body)
    matrix = (inverse_root.T @ K @ inverse_root).toarray()
    omega = np.sqrt(np.linalg.eigvalsh(matrix).max())
    assert omega < 2.0 / found.stable < 2.0 * omega
    assert found.limit == "layer 'paper'"
