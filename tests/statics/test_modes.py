"""Modes about an equilibrium: eliminated unknowns, rigid bodies, friction, damping."""

import numpy as np
import pytest
from scipy.linalg import eigh

from softsim.errors import SceneError
from softsim.run.equilibrium import LoadRange, MotorResponse, Preloaded, scene_with_loads
from softsim.solver.natural_modes import movable_bodies, natural_modes

RUBBER = "materials: {soft: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3 MORE}}"
PRONY = ", prony: [{g: 0.4, relaxation_time: 1 ms}]"

# A beam of quadrilaterals whose end is tied to a rigid body, with a taut cable along it.
BEAM = f"""
bodies:
  beam: {{mesh: {{generator: block, length: 12 mm, height: 2 mm, element_size: 1 mm, cells: quad}},
         formulation: plane_strain, thickness: 5 mm, material: soft, fixed: [left]}}
rigid_bodies:
  head: {{mass: 0.2 g, inertia: 1 g*mm^2, center: [7 mm, 0.5 mm], tied: [beam.right]}}
loads:
  winch: {{kind: pulled_cable, eyelets: [[-5 mm, 0.5 mm], [0 mm, 0.5 mm], [5 mm, 0.5 mm]],
          pull: 0.2 mm, stiffness: 1 N/mm, profile: {{kind: ramp, value: 1, duration: 1 s}}}}
environment: {{gravity: 0 m/s^2}}
{RUBBER}
time: {{end: 1 s}}
"""

TUBE = f"""
bodies:
  tube: {{mesh: {{generator: block, length: 1 mm, height: 5 mm, element_size: 0.5 mm}},
         formulation: axisymmetric, material: soft, position: [4 mm, 0 mm], fixed: [bottom, top]}}
loads:
  liquid: {{kind: added_volume, facets: [tube.left],
           profile: {{kind: smooth_step, value: 40 ul, duration: 1 s}}}}
environment: {{gravity: 0 m/s^2}}
{RUBBER}
time: {{end: 1 s}}
"""

BLOCK = f"""
bodies:
  block: {{mesh: {{generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm}},
          formulation: plane_strain, thickness: 5 mm, material: soft, position: [0 mm, 0.01 mm]}}
environment: {{gravity: 0 m/s^2, walls: {{floor: {{kind: plane}}}}}}
contact: {{friction_coefficient: 0.5}}
conditions: {{press: {{kind: prescribed, nodes: block.top, direction: y,
                     displacement: {{kind: ramp, value: -0.1 mm, duration: 1 s}}}}}}
{RUBBER}
time: {{end: 1 s}}
"""


@pytest.fixture
def loaded_to_the_end(equilibria):
    """Load a scene text up to its end."""

    def made(text: str, *loads: LoadRange) -> Preloaded:
        state = equilibria(text, *loads)
        state.reach(state.end)
        return state

    return made


@pytest.mark.parametrize("text", [BEAM, TUBE], ids=["cable and rigid body", "volume"])
def test_eliminated_unknowns_against_dense_matrices(loaded_to_the_end, text):
    """K + B D^-1 B^T as a dense matrix has the same eigenvalues, mass scaling included."""
    scaling = "solver: {mass_scaling: {within: 1.1 mm, factor: 3}}\n"
    state = loaded_to_the_end(text.replace("MORE", "") + scaling)
    vibrations = state.vibrations("stick")
    assert vibrations.border == 1 and vibrations.error < 1e-6
    bordered, u = vibrations.bordered.toarray(), vibrations.size
    K = bordered[:u, :u] - bordered[:u, u:] @ np.linalg.solve(bordered[u:, u:], bordered[u:, :u])
    L = vibrations.inertia_root.toarray()
    squares = eigh(K, L.T @ L, eigvals_only=True)[:5]
    found = vibrations.modes(5).loaded
    assert [mode.square for mode in found] == pytest.approx(squares, rel=1e-7)
    mass = state.model.mass.sum() + sum(body.mass for body in state.model.rigid_bodies)
    along = vibrations.translation(1)
    fixed = state.model.mass[~state.model.is_free[:, 1]].sum()
    tied = sum(state.model.mass[body.tied].sum() for body in state.model.rigid_bodies)
    assert along @ (L.T @ L) @ along == pytest.approx(mass - fixed + tied, rel=1e-9)


def test_modes_at_rest_are_those_of_the_body(loaded_to_the_end, restart):
    """A beam without load has the frequencies (of the relaxed material) and effective masses of
    `natural_modes`. With Maxwell branches its frequencies are up to 1.5 % lower: here branches
    stiffen shear alone, in `natural_modes` the resistance to compression as well.
    """
    text = BEAM.split("rigid_bodies")[0] + RUBBER.replace("MORE", PRONY) + "\ntime: {end: 1 s}\n"
    state = loaded_to_the_end(text + "environment: {gravity: 0 m/s^2}\n")
    found = state.vibrations("stick").modes(4)
    restart()
    model = state._viscoelastic
    [body] = movable_bodies(model)
    expected = natural_modes(model, body, 4)
    assert (found.held_count, found.rigid_motions) == (expected.held_count, 0)
    for mode, alone in zip(found.loaded, expected.modes, strict=True):
        assert mode.frequency == pytest.approx(alone.frequency, rel=1e-5)
        assert mode.mass_shares == pytest.approx(alone.mass_shares, abs=1e-6)
        assert 0.985 * alone.dynamic_frequency < mode.dynamic_frequency
        assert mode.dynamic_frequency < 1.0001 * alone.dynamic_frequency


def test_a_branch_damps_shear_as_a_single_spring(loaded_to_the_end):
    """Waves across a guided rod are pure shear: s = omega^2 and the damping ratio are those of one
    degree of freedom with the modulus mu (1 + m i omega tau / (1 + i omega tau)).
    """
    text = f"""
bodies:
  rod: {{mesh: {{generator: block, length: 20 mm, height: 1 mm, element_size: 1 mm, cells: quad}},
        formulation: plane_strain, thickness: 1 mm, material: soft, fixed: [left]}}
conditions: {{guide: {{kind: fixed, nodes: rod.all, directions: [x]}}}}
environment: {{gravity: 0 m/s^2}}
{RUBBER.replace("MORE", PRONY)}
time: {{end: 1 s}}
"""
    mode = loaded_to_the_end(text).vibrations("stick").modes(1).loaded[0]
    tau, m, s0 = 1e-3, 0.4 / 0.6, mode.square
    [s] = [r for r in np.roots([tau**2, 1.0 - s0 * tau**2 * (1.0 + m), -s0]) if r > 0.0]
    assert (2.0 * np.pi * mode.dynamic_frequency) ** 2 == pytest.approx(s, rel=1e-6)
    turned = 1j * np.sqrt(s) * tau
    growth = m * turned / (1.0 + turned)
    assert mode.damping_ratio == pytest.approx(0.5 * growth.imag / (1.0 + growth.real), rel=1e-6)


def test_a_block_on_the_floor_sticks_or_slides(loaded_to_the_end):
    state = loaded_to_the_end(BLOCK.replace("MORE", ""))
    stuck = state.vibrations("stick").modes(3)
    assert stuck.contact.touching == 5 and stuck.rigid_motions == 0
    said = stuck.contact.in_words()
    assert "5 of 12 points touch" in said and "stick and stay" in said
    sliding = state.vibrations("slip").modes(3)
    assert sliding.rigid_motions == 1
    assert "slide without friction" in sliding.contact.in_words()
    again = state.vibrations("stick").modes(3)  # the friction of the run is back
    assert [m.square for m in again.loaded] == pytest.approx([m.square for m in stuck.loaded])


def test_loads_are_read_from_options():
    assert LoadRange.read("air=0..23 kPa", "--over") == LoadRange(
        "air", 0.0, 23.0, "kPa", LoadRange.read("air=0..23 kPa", "--over").origin
    )
    one = LoadRange.read("push = 0.5", "--load")
    assert (one.low, one.high, one.unit) == (0.5, 0.5, "")
    suction = LoadRange.read("air=-2 kPa..-8 kPa", "--over")
    assert (suction.low, suction.high) == (-2.0, -8.0)
    assert suction.fraction_of_time(-8.0) == 1.0
    for wrong, said in {
        "air": "is not a load with its value",
        "air=1 Pa..2 kPa": "has two units",
        "air=5..1 kPa": "does not lead away from zero",
        "air=0..0 kPa": "is no load",
        "=3 kPa": "is not a load with its value",
    }.items():
        with pytest.raises(SceneError, match=said):
            LoadRange.read(wrong, "--over")


def test_a_response_names_each_interval_in_which_contact_changes():
    frequencies, changes = np.linspace(10.0, 80.0, 8), np.array([0, 2, 3, 0, 0, 1, 0, 4])
    [warning] = MotorResponse("m", 20.0, frequencies, np.ones(8), {}, {}, changes).warnings()
    assert warning.startswith("from 20 to 30 Hz, at 60 Hz, at 80 Hz (4 of 8 frequencies)")
    assert "at up to 4 points" in warning
    assert MotorResponse("m", 20.0, frequencies, np.ones(8), {}, {}, 0 * changes).warnings() == []


def test_a_load_that_is_not_there(write_scene):
    scene = write_scene(TUBE.replace("MORE", ""))
    with pytest.raises(SceneError, match="there is no load 'liquids'") as error:
        scene_with_loads(scene, [], [LoadRange.read("liquids=3 ul", "--load")])
    assert "liquid" in error.value.hint and "--load liquids=3 ul" in str(error.value)
