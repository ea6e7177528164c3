"""Natural modes: which motions have no frequency, what branches do to one, what is refused."""

import dataclasses

import numpy as np
import pytest

from softsim.errors import ModesError
from softsim.materials.laws import NeoHooke
from softsim.materials.material import Material, MaxwellBranch
from softsim.solver import natural_modes as stiffness
from softsim.solver.natural_modes import dynamic_frequency, movable_bodies, natural_modes

MESHES = {
    "plane_strain, thickness: 5 mm":
        "{generator: block, length: 4 mm, height: 3 mm, element_size: 1 mm}",
    "axisymmetric, position: [2 mm, 0 mm]":
        "{generator: block, length: 4 mm, height: 3 mm, element_size: 1 mm}",
    "ring_section, thickness: 5 mm, sector: 80 deg, rings: skin":
        "{generator: pfr_section, inner_diameter: 4 mm, outer_diameter: 8 mm, free_length: 4 mm, "
        "spikes_per_strip: 1, root_thickness: 2 mm, spike_height: 2 mm, element_size: 1 mm}",
    "solid": "{generator: box, length: 3 mm, height: 3 mm, width: 3 mm, element_size: 1 mm}",
}  # fmt: skip
# Of a ring section the two strips also slide along each other: no diameter changes then at first.
RIGID = dict(zip(MESHES, (3, 1, 4, 6), strict=True))

SCENE = """
bodies:
  b: {mesh: MESH, formulation: FORMULATION, material: soft}
materials:
  soft: {law: yeoh, C10: 36 kPa, C20: 5 kPa, C30: 1 kPa, density: 1000 kg/m^3,
         prony: [{g: 0.3, relaxation_time: 1 ms}]}
time: {end: 1 s}
"""


def scene(formulation: str) -> str:
    return SCENE.replace("MESH", MESHES[formulation]).replace("FORMULATION", formulation)


@pytest.fixture
def block(build, fresh_taichi):
    """A plane block that nothing holds."""
    return build(scene(next(iter(MESHES))))


@pytest.mark.parametrize("formulation", MESHES)
def test_a_free_body_moves_as_a_whole_without_frequency(build, fresh_taichi, formulation):
    """Whatever the formulation, forces have a symmetric stiffness between the nodes that are said
    to be coupled, else it would be refused.
    """
    model = build(scene(formulation))
    found = natural_modes(model, model.bodies[0], 3)
    assert found.rigid_motions == RIGID[formulation]
    assert found.stiffness_error < 1e-8
    slowest = np.sqrt(72.0) / (2.0 * np.pi * np.ptp(model.points, axis=0).max())
    assert 0.3 * slowest < found.modes[0].frequency <= found.modes[1].frequency
    for mode in found.modes:
        assert mode.mass_shares[1] < 1e-12  # its centre rests
        assert np.linalg.norm(mode.shape, axis=1).max() == pytest.approx(1.0)


def test_what_is_held_leaves_fewer_motions(block):
    """A block on rollers slides; fixed at one node it turns."""
    roller, pivot = block.is_free.copy(), block.is_free.copy()
    roller[block.bodies[0].node_sets["bottom"], 1] = False
    pivot[0] = False
    for is_free, motions in ((roller, 1), (pivot, 1), (roller & pivot, 0)):
        held = dataclasses.replace(block, is_free=is_free)
        assert natural_modes(held, held.bodies[0], 2).rigid_motions == motions


def test_modes_do_not_know_what_else_the_scene_has(build, fresh_taichi, block):
    """Loads, walls, other bodies and the step are no part of a body's own modes."""
    text = scene(next(iter(MESHES)))
    crowded = build(
        text.replace("  b: {", "  a: {MORE, position: [0 mm, 5 mm]}\n  b: {").replace(
            "MORE", text.split("  b: {")[1].split("}\nmat")[0]
        ) + "loads: {air: {kind: follower_pressure, facets: [b.top], profile: {kind: constant, "
        "value: 1 kPa}}}\nenvironment: {walls: {floor: {kind: plane}}}\n"
        "solver: {bulk_viscosity: 0.1}\n"
    )  # fmt: skip
    alone = natural_modes(block, block.bodies[0], 4).modes
    among = natural_modes(crowded, crowded.bodies[1], 4).modes
    assert [m.frequency for m in among] == pytest.approx([m.frequency for m in alone], rel=1e-8)


def test_a_branch_stiffens_by_its_storage_modulus():
    """One branch of m times the law's modulus: s = omega^2 solves
    s = s0 (1 + m s tau^2 / (1 + s tau^2)), a quadratic equation.
    """
    mu, m, tau, frequency = 72e3, 0.8, 1e-3, 190.0
    soft = Material("soft", NeoHooke(0.5 * mu), 20.0 * mu, 1000.0)
    lossy = dataclasses.replace(soft, branches=(MaxwellBranch(m * mu, tau),))
    s0 = (2.0 * np.pi * frequency) ** 2
    [s] = [r for r in np.roots([tau**2, 1.0 - s0 * tau**2 * (1.0 + m), -s0]) if r > 0.0]
    exact = np.sqrt(s) / (2.0 * np.pi)
    assert dynamic_frequency(frequency, np.ones(1), [lossy]) == pytest.approx(exact, rel=1e-9)
    assert dynamic_frequency(frequency, np.ones(1), [soft]) == pytest.approx(frequency, rel=1e-9)
    shared = dynamic_frequency(frequency, np.array([0.25, 0.75]), [lossy, soft])
    grown = lossy.storage_modulus(shared) / mu
    assert (shared / frequency) ** 2 == pytest.approx(0.25 * grown + 0.75, rel=1e-9)


def test_more_modes_than_motions_are_refused(block):
    ways = block.is_free.sum() - 3
    with pytest.raises(ModesError, match=f"{ways} modes of body 'b' .* {ways} degrees of freedom"):
        natural_modes(block, block.bodies[0], ways)


def test_a_body_that_is_held_everywhere_is_none_that_moves(block):
    assert movable_bodies(block) == list(block.bodies)
    held = dataclasses.replace(block, is_free=np.zeros_like(block.is_free))
    with pytest.raises(ModesError, match="there are no natural modes"):
        movable_bodies(held)


def test_a_region_that_is_held_everywhere_adds_nothing(build, fresh_taichi):
    """Of a strip the upper row is a region; where that is held, the other swings on it."""
    above = "sets: {above: {plane: {point: [0 mm, 2 mm], normal: [0, 1]}}}, "
    text = scene(next(iter(MESHES))).replace("material: soft}", f"material: soft, {above}MORE}}")
    one = build(text.replace("MORE", "fixed: [above]"))
    two = build(
        text.replace("MORE", "fixed: [above], regions: {above: {material: dragon_skin_30}}")
    )
    whole, parted = (natural_modes(m, m.bodies[0], 2).modes for m in (one, two))
    assert len(two.regions) == 2
    for alone, on_region in zip(whole, parted, strict=True):
        assert on_region.frequency == pytest.approx(alone.frequency, rel=0.1)


def test_a_body_that_is_too_large_is_refused(block, monkeypatch):
    monkeypatch.setattr(stiffness, "MOST_ENTRIES", 100)
    with pytest.raises(ModesError, match="body 'b' is too large for natural frequencies"):
        natural_modes(block, block.bodies[0], 1)


def test_forces_beyond_the_neighbourhood_are_found_out(block, monkeypatch):
    """An element whose forces reach further than `coupled_pairs` knows would give wrong modes."""
    near = stiffness.incidence

    def fewer(nodes, node_count):
        return near(nodes[::2], node_count)

    monkeypatch.setattr(stiffness, "incidence", fewer)
    with pytest.raises(ModesError, match="at rest is not symmetric"):
        natural_modes(block, block.bodies[0], 1)
