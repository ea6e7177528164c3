"""Bodies on walls that went through a grid of distances, against the same walls as formulas.

A box in the bore of a pipe from an STL file, its dimensions as in test_walls_in_space: it lies on
two edges, where the normals are tilted by beta, cos beta = 0.8. The bore's facets touch the circle
in their middles and leave it by R (pi / N)^2 / 2 at most; the grid is off by spacing^2 / (8 R); the
height changes by what both take together, over cos beta.
"""

import meshio
import numpy as np
import pytest
from present_row import wall_contact


def settle(solver, until, count=500):
    while solver.time < until:
        solver.advance(count)


def pipe_bore(radius, length, around):
    """The hollow of a pipe about x, from x = -length / 2, closed by flat ends: points, triangles.
    The middles of its facets are as far from the axis as `radius` says.
    """
    angle = 2.0 * np.pi * np.arange(around) / around
    reach = radius / np.cos(np.pi / around)
    ring = np.stack([np.zeros(around), reach * np.cos(angle), reach * np.sin(angle)], axis=1)
    half = np.array([0.5 * length, 0.0, 0.0])
    points = np.vstack([ring - half, ring + half, [-half, half]])
    one = np.arange(around)
    other = (one + 1) % around
    sides = [[one, other, other + around], [one, other + around, one + around]]
    ends = [
        [other, one, 0 * one + 2 * around],
        [one + around, other + around, one * 0 + 2 * around + 1],
    ]
    return points, np.concatenate([np.stack(t, axis=1) for t in sides + ends])


RADIUS, AROUND, SPACING = 5.0, 90, 0.25  # mm
WEDGE = 0.8
BOX = f"""
bodies:
  box: {{mesh: {{generator: box, length: 12 mm, height: 3 mm, width: 6 mm, element_size: 3 mm}},
        formulation: solid, material: rubber, position: [-6 mm, -3.99 mm, -3 mm]}}
materials:
  rubber: {{law: neo_hooke, C10: 100 kPa, density: 1000 kg/m^3,
           prony: [{{g: 0.5, relaxation_time: 1 ms}}]}}
environment: {{walls: {{pipe: {{kind: pipe, diameter: {2.0 * RADIUS} mm}}}}}}
contact: {{friction_coefficient: 0, damping_ratio: 0.3}}
time: {{end: 1 s}}
"""
WEIGHT = 1000.0 * 12e-3 * 3e-3 * 6e-3 * 9.81


def test_a_box_rests_in_a_pipe_from_an_stl_as_in_a_pipe(
    build, start, tmp_path, record_verification
):

    points, triangles = pipe_bore(RADIUS, 16.0, AROUND)
    meshio.write(tmp_path / "bore.stl", meshio.Mesh(points, [("triangle", triangles)]), binary=True)
    bore = f"{{kind: surface, file: bore.stl, free_side: inside, spacing: {SPACING} mm}}"
    heights, normals = [], []
    for overrides in ([], [f"environment.walls.pipe={bore}"]):
        model = build(BOX, *overrides)
        solver = start(model)
        settle(solver, 0.1)
        solver.clear_impulses(0)
        began = solver.time
        settle(solver, 0.15)
        grip = wall_contact(solver.scenario(0))
        heights.append(solver.scenario(0).centre_of_mass()[1])
        normals.append(grip.normal_impulse / (solver.time - began))
    sagitta = RADIUS * (np.pi / AROUND) ** 2 / 2.0
    rounding = SPACING**2 / (8.0 * (RADIUS - np.sqrt(2.0) * SPACING))
    assert abs(heights[1] - heights[0]) < 1e-3 * (sagitta + rounding) / WEDGE
    # The normal is that of a facet or between two: off by their angle, and by half a cell's share
    # of the radius.
    tilt = np.pi / AROUND + 0.5 * SPACING / RADIUS
    assert normals[0] == pytest.approx(WEIGHT / WEDGE, rel=1e-3)
    assert normals[1] == pytest.approx(WEIGHT / WEDGE, rel=tilt * 0.6 / WEDGE)
    record_verification("box in a pipe from an STL: height [m]", heights[0], heights[1])
    record_verification("box in a pipe from an STL: normal force [N]", normals[0], normals[1])
