"""A block under prescribed displacement with free sides, at rest, against the closed form.

The field is homogeneous, so linear elements hold it exactly on any mesh, here on an irregular one,
and what is left is the distance from equilibrium. The run ends when the unbalanced force, a root
sum of squares, is below 1e-5 of the inner forces; the few sides that it can add up on give a
tolerance of 1e-4 of the reaction.
"""

import io

import closed_forms
import meshes
import numpy as np
import pytest

TOLERANCE = 1e-4
SIDE, DEPTH = 3e-3, 2e-3  # [m]
KAPPA = 20.0 * 72e3
"""What is taken where none is given: 20 mu0."""
LAWS = {
    "yeoh": ("C10: 36 kPa, C20: 5 kPa, C30: 1 kPa", ((36e3, 5e3, 1e3), KAPPA)),
    "neo_hooke": ("C10: 36 kPa", ((36e3,), KAPPA)),
    "mooney_rivlin": (
        "C10: 30 kPa, C01: 6 kPa",
        (((60e3, 12e3), (2.0, -2.0)), KAPPA, closed_forms.ogden_cauchy_stress),
    ),
    "ogden": (
        "mu: [60 kPa, 10 kPa, 2 kPa], alpha: [1.3, -2.5, 7]",
        (((60e3, 10e3, 2e3), (1.3, -2.5, 7.0)), KAPPA, closed_forms.ogden_cauchy_stress),
    ),
}
"""Name -> constants in a scene, and what a closed form takes beside the stretch."""
EXACT = {
    "uniaxial": closed_forms.nearly_incompressible_uniaxial,
    "equibiaxial": closed_forms.nearly_incompressible_equibiaxial,
    "pure shear": closed_forms.nearly_incompressible_pure_shear,
}
# Area [m^2] of the side that is pulled; revolved, the cylinder's end and its mantle.
AREA = {
    ("solid", "right"): SIDE**2,
    ("plane_strain", "right"): SIDE * DEPTH,
    ("axisymmetric", "top"): np.pi * SIDE**2,
    ("axisymmetric", "right"): 2.0 * np.pi * SIDE**2,
}
AXIS = {"left": "x", "right": "x", "bottom": "y", "top": "y", "back": "z", "front": "z"}
# Formulation, mode, sides on planes of symmetry, sides that are pulled (the others are free), law,
# stretch.
BLOCK, SQUARE = ("left", "bottom", "back"), ("left", "bottom")
# Every law once, every formulation once.
FAST = [
    ("solid", "uniaxial", BLOCK, ("right",), "yeoh", 2.0),
    ("plane_strain", "pure shear", SQUARE, ("right",), "neo_hooke", 2.0),
    ("axisymmetric", "equibiaxial", ("bottom",), ("right",), "mooney_rivlin", 1.7),
    ("solid", "uniaxial", BLOCK, ("right",), "ogden", 2.0),
]
SLOW = [
    ("axisymmetric", "uniaxial", ("bottom",), ("top",), "neo_hooke", 2.0),
    ("axisymmetric", "equibiaxial", ("bottom",), ("right",), "yeoh", 1.7),
    ("solid", "equibiaxial", BLOCK, ("right", "top"), "yeoh", 1.7),
    ("solid", "uniaxial", BLOCK, ("right",), "yeoh", 0.6),
    ("solid", "uniaxial", BLOCK, ("right",), "neo_hooke", 2.0),
    ("solid", "pure shear", (*BLOCK, "front"), ("right",), "yeoh", 2.0),
    ("plane_strain", "pure shear", SQUARE, ("right",), "yeoh", 2.0),
    ("plane_strain", "pure shear", SQUARE, ("right",), "ogden", 2.0),
    ("solid", "equibiaxial", BLOCK, ("right", "top"), "mooney_rivlin", 1.7),
    ("axisymmetric", "uniaxial", ("bottom",), ("top",), "yeoh", 2.0),
]
CASES = FAST + [pytest.param(*case, marks=pytest.mark.slow) for case in SLOW]


def scene(formulation, symmetric, pulled, law, stretch):
    """The block of `block.inp`, drawn out in ten periods of its slowest mode: 4 L / sqrt(E / rho)
    is 0.8 ms.
    """
    travel = f"{{kind: ramp, value: {(stretch - 1.0) * SIDE:.17g} m, duration: 8 ms}}"
    conditions = [
        f"  {side}: {{kind: symmetry, nodes: b.{side}, normal: {AXIS[side]}}}" for side in symmetric
    ] + [
        f"  {side}: {{kind: prescribed, nodes: b.{side}, direction: {AXIS[side]}, "
        f"displacement: {travel}}}"
        for side in pulled
    ]
    return f"""
bodies:
  b:
    mesh: {{file: block.inp, length_unit: 1 m}}
    formulation: {formulation}
    {f"thickness: {DEPTH} m" if formulation == "plane_strain" else ""}
    material: soft
materials:
  soft: {{law: {law}, {LAWS[law][0]}, density: 1000 kg/m^3}}
environment: {{gravity: 0 m/s^2}}
conditions:
{chr(10).join(conditions)}
output: {{probes: {{hold: {{kind: reaction, nodes: b.{pulled[0]}}}}}}}
time: {{end: 10 ms, procedure: static}}
solver: {{equilibrium_tolerance: 1e-5}}
"""


@pytest.fixture
def run_text(write_scene, tmp_path, kernel_cache, monkeypatch):
    """Run a scene text to its end, quietly."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)

    def run_scene(text):
        from rich.console import Console

        from softsim.run import run

        quiet = Console(file=io.StringIO())
        return run(write_scene(text), out=tmp_path / "run", device="cpu", console=quiet)

    return run_scene


@pytest.mark.parametrize(("formulation", "mode", "symmetric", "pulled", "law", "stretch"), CASES)
def test_homogeneous_tension(
    run_text, tmp_path, record_verification, formulation, mode, symmetric, pulled, law, stretch
):
    dimension = 3 if formulation == "solid" else 2
    mesh = meshes.irregular_block(SIDE, 3, dimension, shift=0.25, seed=3, whole=False)
    mesh.write(tmp_path / "block.inp", formulation)
    results = run_text(scene(formulation, symmetric, pulled, law, stretch))
    force = results.summary["probes"][f"hold_{AXIS[pulled[0]]}"]
    stress = force / AREA[formulation, pulled[0]]
    exact = EXACT[mode](stretch, *LAWS[law][1]).stress
    record_verification(f"{mode}, {formulation}, {law}, stretch {stretch:g} [Pa]", exact, stress)
    assert stress == pytest.approx(exact, rel=TOLERANCE)
