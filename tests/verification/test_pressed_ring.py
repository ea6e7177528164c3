"""A ring between two plates, pressed to four fifths of its height: the force of the elastica.

A quarter of a ring of mean radius R = 10 mm and thickness h = 0.5 mm, in plane strain, under a
plate that comes down. Its middle line, natural curvature 1 / R, touches at one point as long as it
is convex there; `structural_forms.pressed_ring_force` has the force. What the elastica leaves out
is of the order (h/R)^2: shear and hoop compression make a ring softer by 2.5 (h/R)^2 of its
stiffness (Roark, Formulas for Stress and Strain, table 9.2, case 1), 0.6 %. Strains are below h/R.
Quadrilaterals bend exactly, but a chord of the angle a for an arc of the middle line makes the ring
smaller by a^2 / 24, its force, which goes with R^-2 at a given share of the height, larger by less
than a^2 / 8: 0.03 % with 32 chords. With the contact's penetration, below a hundredth of h, of the
2 mm that the plate moves, 1 % is allowed.
"""

import io

import meshes
import pytest
import structural_forms
from rich.console import Console

RADIUS, THICKNESS, DEPTH, PRESS = 10e-3, 0.5e-3, 10e-3, 2e-3
INNER, OUTER = RADIUS - 0.5 * THICKNESS, RADIUS + 0.5 * THICKNESS
SHEAR_MODULUS = 72e3
KAPPA = 20.0 * SHEAR_MODULUS

SCENE = f"""
bodies:
  ring: {{mesh: {{file: ring.inp, length_unit: 1 m}}, formulation: plane_strain,
         thickness: {DEPTH} m, material: rubber}}
materials: {{rubber: {{law: neo_hooke, C10: {0.5 * SHEAR_MODULUS} Pa, density: 1000 kg/m^3}}}}
environment:
  gravity: 0 m/s^2
  walls: {{plate: {{kind: plane, point: [0 m, {OUTER} m], normal: [0, -1]}}}}
contact: {{friction_coefficient: 0}}
conditions:
  x0: {{kind: symmetry, nodes: ring.x0, normal: x}}
  y0: {{kind: symmetry, nodes: ring.y0, normal: y}}
  press: {{kind: wall_motion, wall: plate, direction: y,
          displacement: {{kind: smooth_step, value: -{PRESS} m, duration: 200 ms}}}}
output: {{history_interval: 1 ms}}
time: {{end: 200 ms, procedure: static}}
"""


@pytest.mark.parametrize(
    ("around", "across"), [(32, 1), pytest.param(32, 2, marks=pytest.mark.slow)]
)
def test_pressed_ring(
    around, across, write_scene, tmp_path, kernel_cache, monkeypatch, record_verification
):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run

    mesh = meshes.joined(meshes.quarter_ring(INNER, OUTER, around, across))
    mesh.write(tmp_path / "ring.inp", "plane_strain")
    console = Console(file=io.StringIO())
    history = run(write_scene(SCENE), out=tmp_path / "out", device="cpu", console=console).history
    # Half of the force, on the half that is modelled.
    found = -2.0 * history["wall_force_y"][-1]

    plane_modulus = 4.0 * SHEAR_MODULUS * (KAPPA + SHEAR_MODULUS / 3.0)
    plane_modulus /= KAPPA + 4.0 / 3.0 * SHEAR_MODULUS
    stiffness = plane_modulus * DEPTH * THICKNESS**3 / 12.0
    exact = structural_forms.pressed_ring_force(RADIUS, stiffness, 2.0 * (RADIUS - PRESS))
    case = f"ring between plates [N], {across} quadrilaterals thick"
    record_verification(case, exact, found)
    assert found == pytest.approx(exact, rel=0.01)
