"""A block on walls along polylines: on a slope as on a plane; across corners energy is kept."""

import numpy as np

SLOPE = np.radians(35.0)
UP = np.array([np.cos(SLOPE), np.sin(SLOPE)])
BLOCK = f"""
bodies:
  block: {{mesh: {{generator: block, length: 10 mm, height: 6 mm, element_size: 2 mm}},
          formulation: plane_strain, thickness: 10 mm, material: dragon_skin_30,
          rotation: 35 deg}}
environment:
  walls: {{slope: {{kind: plane, normal: [{-UP[1]}, {UP[0]}]}}}}
contact: {{friction_coefficient: 0.5}}
time: {{end: 1 s}}
"""


def ground(*points):
    """Override: instead of the plane a polyline through points (x, y) [mm]."""
    listed = ", ".join(f"[{x:.17g} mm, {y:.17g} mm]" for x, y in points)
    return f"environment.walls.slope={{kind: polyline, points: [{listed}]}}"


def settle(solver, until, count=500):
    while solver.time < until:
        solver.advance(count)


def test_a_block_slides_down_a_polyline_as_down_a_plane(build, start, record_verification):
    """Without friction to round-off, 1e-17 m an increment. With friction round-off grows tenfold
    each ms, as nodes stick and slip by turns: for 10 ms still next to nothing, then as a whole.
    Its limit has no memory here: round-off decides with which increment nodes that start on the
    surface begin to touch, and with that the age of their contact.
    The polyline ends below the block, and goes on straight from there.
    """
    spans = ((0.01, 1e-14, 1e-12), (0.1, 1e-14, 1e-4))
    moved = []  # with each wall, at the end of each span
    for wall in ([], [ground(-1.0 * UP, 30.0 * UP)]):
        coulomb = ("contact.friction_memory=0 s", *wall)
        models = [build(BLOCK, f"contact.friction_coefficient={mu}", *coulomb) for mu in (0, 0.5)]
        solver = start(*models)
        moved.append([])
        for until, *_ in spans:
            settle(solver, until, 50)
            moved[-1].append(solver.positions() - models[0].points)
    for (_, slippery, rough), plane, line in zip(spans, *moved, strict=True):
        assert np.abs(line - plane)[0].max() < slippery
        assert np.abs(line - plane)[1].max() < rough
    ways = [-float((by[1] @ UP).mean()) for by in (plane, line)]
    assert ways[0] > 7e-3
    record_verification("slides down a polyline [m]", *ways)


def test_the_books_close_across_corners(build, start):
    """Down the slope into a valley and over a hump, 0.3 mm high."""
    from softsim.solver.energy import EnergyBalance, EnergyReader

    x, y = -7.0 * UP
    valley = [(x - 30.0, y), (x - 11.0, y), (x - 9.5, y + 0.3), (x - 8.0, y), (x, y)]
    model = build(BLOCK, ground(*valley, 20.0 * UP), "contact.friction_coefficient=0.1")
    # A chattering contact lasts a few increments and is booked to first order: a smaller step.
    solver = start(model, share=0.3)
    reader = EnergyReader(solver)
    balance = EnergyBalance.starting(reader.read(), model)
    largest = 0.0
    while solver.time < 0.15:
        solver.advance(500)
        largest = max(largest, balance.error(reader.read()))
    assert solver.positions()[0][:, 0].min() < 1e-3 * (x - 12.0)  # its front is far over the hump
    assert largest < 0.01
