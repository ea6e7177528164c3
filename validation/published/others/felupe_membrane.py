"""Membrane M1 of `spa_membranes`, computed by FElupe: force on its cap.

Both programs take the scene membrane_lift.yaml: a disc of 2 mm, clamped at its rim, whose cap
follows four measured heights and pressures, with the constants that `spa_membranes` found. Both use
square axisymmetric elements of 1 and of 0.5 mm with one pressure each. FElupe integrates the shear
at four points, softsim at one, with a stiffness against hourglass modes. Needs
`pip install -e '.[test]'`; takes half a minute.
"""

from typing import Any

import felupe as fem
import numpy as np
from felupe.constitution.tensortrax import Hyperelastic
from felupe.constitution.tensortrax.models.hyperelastic import yeoh
from rich.console import Console
from rich.table import Table

from softsim.report.style import BLUE, GREEN, INK, drawing
from softsim.units import parse
from validation.cases import Case, outcomes_by_name, run_cases
from validation.published.others import OUT
from validation.published.spa_membranes import CONSTANTS, FITTED

TEXTS = CONSTANTS["fitted to M1"][:2]
C10, C20 = (parse(text, "Pa") for text in TEXTS)
BULK_MODULUS = 40.0 * C10  # Pa, 20 times the initial shear modulus, as in softsim
WEIGHT = FITTED[1]  # N, which the cap carried in the experiment
SIZES = (1.0, 0.5)  # mm
COLOURS = {"FElupe": GREEN, "softsim": BLUE}
STEPS = 12  # of Newton's method between two heights


def case(size: float) -> Case:
    """Return softsim's run with elements of `size` [mm]."""
    constants = "C10: {}, C20: {}".format(*TEXTS)
    silicone = f"{{law: yeoh, {constants}, C30: 0 kPa, density: 1070 kg/m^3}}"
    overrides = (f"materials.silicone={silicone}", f"bodies.membrane.mesh.element_size={size} mm")
    return Case(f"{size:g} mm", "membrane_lift.yaml", overrides)


SCENE: Any = case(SIZES[0]).loaded.scene
MEMBRANE = SCENE.bodies["membrane"]
RADIUS, THICKNESS = MEMBRANE.mesh.length, MEMBRANE.mesh.height  # m
CAP_RADIUS = MEMBRANE.sets["cap"].box[1][0]  # m
HEIGHTS, PRESSURES = (  # m, Pa
    np.array(profile.points)[1:, 1]
    for profile in (SCENE.conditions["lifted"].displacement, SCENE.loads["air"].profile)
)


def cap_forces(size: float) -> np.ndarray:
    """Return the force of FElupe's membrane on its cap (4,) [N], upwards; `size` [m]."""
    cells = (round(THICKNESS / size) + 1, round(RADIUS / size) + 1)
    mesh = fem.Rectangle(a=(0.0, 0.0), b=(THICKNESS, RADIUS), n=cells)  # x: the axis, y: the radius
    displacement = fem.FieldAxisymmetric(fem.RegionQuad(mesh), dim=2)
    field = fem.FieldContainer([displacement])
    cap = np.isclose(mesh.x, THICKNESS) & (mesh.y < CAP_RADIUS + 1e-6)
    boundaries = {
        "clamp": fem.Boundary(displacement, fy=RADIUS),
        "axis": fem.Boundary(displacement, fy=0.0, skip=(True, False)),
        "glued": fem.Boundary(displacement, mask=cap, skip=(True, False)),
        "lifted": fem.Boundary(displacement, mask=cap, skip=(False, True)),
    }
    held, free = fem.dof.partition(field, boundaries)
    silicone = Hyperelastic(yeoh, C10=C10, C20=C20, C30=0.0)
    membrane = fem.SolidBodyNearlyIncompressible(silicone, field, bulk=BULK_MODULUS)
    lower_face = fem.RegionQuadBoundary(
        mesh, only_surface=True, mask=np.isclose(mesh.x, 0.0), ensure_3d=True
    )
    air = fem.SolidBodyPressure(fem.FieldContainer([fem.FieldAxisymmetric(lower_face, dim=2)]))
    times = np.arange(len(HEIGHTS) + 1.0)
    prescribed = fem.dof.apply(field, boundaries)
    forces = []
    for time in np.linspace(0.0, len(HEIGHTS), STEPS * len(HEIGHTS) + 1)[1:]:
        air.update(np.interp(time, times, [0.0, *PRESSURES]))
        prescribed[boundaries["lifted"].dof] = np.interp(time, times, [0.0, *HEIGHTS])
        solution = fem.newtonraphson(
            x0=field, items=[membrane, air], dof0=held, dof1=free, ext0=prescribed[held], verbose=0
        )
        field = solution.x
        if np.isclose(time % 1.0, 0.0):
            forces.append(-fem.tools.force(field, solution.fun, boundaries["lifted"])[0])
    return np.array(forces)


def main() -> None:
    """Compute the forces with both programs, print and draw them."""
    console = Console()
    cases = [case(size) for size in SIZES]
    outcomes = outcomes_by_name(cases, run_cases(cases, OUT, 1, console))
    headings = [f"{program}, {size:g} mm [N]" for size in SIZES for program in COLOURS]
    table = Table("height [mm]", *headings, "softsim over FElupe [%]")
    columns = []
    for size in SIZES:
        history = outcomes[case(size).name].history
        columns += [
            cap_forces(1e-3 * size),
            -np.interp(PRESSURES, history["pressure"], history["lift_y"]),
        ]
    for height, *forces in zip(HEIGHTS, *columns, strict=True):
        difference = 100.0 * (forces[-1] / forces[-2] - 1.0)
        table.add_row(f"{1e3 * height:g}", *(f"{f:.3f}" for f in forces), f"{difference:+.2f}")
    console.print(table)
    path = OUT / "felupe_membrane.png"
    with drawing(path, 2.8) as figure:
        axes = figure.subplots()
        axes.axhline(WEIGHT, color=INK, linewidth=0.7, linestyle=":", label="measured")
        for forces, (name, colour) in zip(columns[-2:], COLOURS.items(), strict=True):
            axes.plot(1e3 * HEIGHTS, forces, "o-", color=colour, linewidth=1.2, label=name)
        axes.set(xlabel="height of the cap [mm]", ylabel="force on the cap [N]")
        axes.legend()
    console.print(f"figure {path}")


if __name__ == "__main__":
    main()
