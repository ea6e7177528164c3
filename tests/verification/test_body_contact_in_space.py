"""Contact between deformable bodies in space, on meshes that match and on others.

All bodies are neo-Hooke's, C10 = 50 kPa, bulk modulus 2 MPa; without friction unless stated.
"""

import io
from dataclasses import dataclass

import numpy as np
import pytest
import structural_forms
from meshes import SmallMesh
from rich.console import Console
from scipy.optimize import brentq

from softsim.compute import fields
from softsim.output.fields import read_frames
from softsim.robots.block import block as mesh_of_block
from softsim.robots.block import box as mesh_of_box

SHEAR, BULK = 100e3, 2e6
SETTINGS = """
materials: {soft: {law: neo_hooke, C10: 50 kPa, bulk_modulus: 2 MPa, density: 1000 kg/m^3}}
environment: {gravity: 0 m/s^2}
"""


def box(name, sides, size, position, cells="quad", velocity=(0, 0, 0)):
    """Return the line of a box: sides (x, y, z), size of the elements, position [mm]; velocity."""
    length, height, width = sides
    return (
        f"  {name}: {{mesh: {{generator: box, length: {length} mm, height: {height} mm, "
        f"width: {width} mm, element_size: {size} mm, cells: {cells}}}, formulation: solid, "
        f"material: soft, position: [{', '.join(f'{c} mm' for c in position)}], "
        f"initial_velocity: [{', '.join(f'{v} m/s' for v in velocity)}]}}\n"
    )


def from_file(name, formulation, height=0.0, mirror=False):
    """Return the line of a body from NAME.inp at a height [m], upside down if mirrored."""
    turned = f", position: [0 m, {height} m]" + ", mirror: y" * mirror
    return (
        f"  {name}: {{mesh: {{file: {name}.inp, length_unit: 1 m}}, formulation: {formulation}, "
        f"material: soft{turned}}}\n"
    )


def held(sets, directions):
    """Return the lines that hold node sets in a direction each."""
    return "".join(
        f"  {nodes.replace('.', '_')}_{d}: {{kind: fixed, nodes: {nodes}, directions: [{d}]}}\n"
        for nodes in sets
        for d in directions
    )


def mirrored(side, normal):
    """Return the lines that make a side of both bodies, l and u, a plane of symmetry."""
    return "".join(
        f"  {b}_{side}: {{kind: symmetry, nodes: {b}.{side}, normal: {normal}}}\n" for b in "lu"
    )


def pushed(bodies, push, surfaces, conditions="", base="l.bottom", top="u.top", allowed=0.01):
    """Return a static scene in which the node set `base` stays at its height, and `top` moves down
    by `push` [mm]. allowed: contact.allowed_penetration.
    """
    return f"""
bodies:
{bodies}{SETTINGS}
contact: {{self_contact: {surfaces}, friction_coefficient: 0, allowed_penetration: {allowed}}}
conditions:
  base: {{kind: fixed, nodes: {base}, directions: [y]}}
  push: {{kind: prescribed, nodes: {top}, direction: y,
         displacement: {{kind: smooth_step, value: -{push} mm, duration: 10 ms}}}}
{conditions}
time: {{end: 10 ms, procedure: static, settle: 300 ms}}
solver: {{equilibrium_tolerance: 3e-5}}
output: {{frame_interval: 1 s, history_interval: 0.1 ms, fields: [stress],
         probes: {{push: {{kind: reaction, nodes: {top}}},
                   top: {{kind: displacement, nodes: {top}}}}}}}
"""


@dataclass(frozen=True)
class Pressed:
    """Two bodies at the end of a static run.

    force: what presses them together [N]. rest, places: (n, d) [m], nodes at rest and now.
    cells: (m, corners). stress: (m, 6), Cauchy's [Pa]. contact_energy: over the push, (rows, 2),
    [m] and [J]. summary: that of the run.
    """

    force: float
    rest: np.ndarray
    places: np.ndarray
    cells: np.ndarray
    stress: np.ndarray
    contact_energy: np.ndarray
    summary: dict


@pytest.fixture
def run(kernel_cache, monkeypatch, write_scene, tmp_path):
    """Run a scene text quietly on the CPU."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run as run_scene

    def quiet(text, *settings):
        console = Console(file=io.StringIO())
        results = run_scene(write_scene(text), settings, tmp_path / "out", "cpu", console=console)
        assert results.summary["status"] == "done"
        return results

    return quiet


@pytest.fixture
def press(run):
    """Run a scene of `pushed` to its end."""

    def pressed(text):
        results = run(text)
        frames = read_frames(results.folder / "results.vtkhdf")
        way = -results.history["top_y"]
        moved = frames.point_data["displacement"][-1][:, : frames.points.shape[1]]
        return Pressed(
            force=-float(results.history["push_y"][-1]),
            rest=frames.points,
            places=frames.points + moved,
            cells=frames.cells,
            stress=frames.cell_data["stress"][-1],
            contact_energy=np.column_stack([way, results.history["contact_energy"]]),
            summary=results.summary,
        )

    return pressed


@pytest.mark.parametrize("cells", ["quad", pytest.param("simplex", marks=pytest.mark.slow)])
def test_half_a_model_presses_like_the_whole(press, record_verification, cells):
    """10 x 4 x 12 mm under 6 x 4 x 8 mm, pushed by 1 mm, and half of both: the force of two halves
    is the whole one's within 0.5 %. The half has the whole one's mesh up to its plane of symmetry.
    """
    ends = held(("l.bottom", "u.top"), "xz")
    found = []
    for parts, conditions in ((2, ends), (1, ends + mirrored("front", "z"))):
        lower = box("l", (10, 4, 6 * parts), 2, (-5, 0, -6), cells)
        upper = box("u", (6, 4, 4 * parts), 1.5, (-3, 4, -4), cells)
        found.append(press(pushed(lower + upper, 1, "[l, u]", conditions)))
    whole, half = found
    case = f"bodies in space, {cells}, half a model"
    record_verification(f"{case}: force [N]", whole.force, 2.0 * half.force)
    depths = [found.summary["largest_body_penetration"] for found in (whole, half)]
    record_verification(f"{case}: penetration over size", *depths)
    assert 2.0 * half.force == pytest.approx(whole.force, rel=0.005)
    assert max(depths) < 0.1  # below the edges of the upper one, where the pressure is highest


def uniaxial_stress(stretch):
    """Return the axial force over the area at rest [Pa] of a bar that is free to widen."""

    def stresses(across):
        J = stretch * across**2
        b = np.array([stretch**2, across**2])
        return SHEAR * J ** (-5 / 3) * (b - (b[0] + 2 * b[1]) / 3) + BULK * (J - 1)

    across = brentq(lambda w: stresses(w)[1], 0.9, 1.2, xtol=1e-14)
    return stresses(across)[0] * across**2


# Elements of the lower and of the upper box [mm], cells, surfaces, and the limit of the stress's
# largest deviation from its mean, as it is now where that is above PATCH.
PATCH = 0.02
FLUSH = {
    "4 on 4": (4, 4, "quad", "[l, u]", PATCH),
    "3 on 4": (4, 3, "quad", "[l, u]", 0.025),
    "3 on 4, tetrahedra": (4, 3, "simplex", "[l, u]", 0.04),
    "3 on 4, open surfaces": (4, 3, "quad", "[l.top, u.bottom]", 0.025),
}


@pytest.mark.parametrize("case", FLUSH)
def test_flush_boxes_press_like_one(press, record_verification, case):
    """Two boxes of one footprint, face to face, shortened by 10 % in all: the force is that of one
    box within 1 %, and the stress is the same everywhere within 2 % (the contact patch test).

    They are free to widen, so that their edges stay flush; x = 0 and z = 0 are symmetry planes. The
    penetration d takes the share d / 1.7 mm of the shortening away: 2.6 % with the 1 % of an
    element that is allowed by default, 0.8 % with the 0.3 % here.
    """
    lower, upper, cells, surfaces, limit = FLUSH[case]
    bodies = box("l", (12, 8, 12), lower, (0, 0, 0), cells)
    bodies += box("u", (12, 9, 12), upper, (0, 8, 0), cells)
    symmetry = mirrored("left", "x") + mirrored("back", "z")
    found = press(pushed(bodies, 1.7, surfaces, symmetry, allowed=0.003))
    exact = -uniaxial_stress(0.9) * 12e-3**2
    vertical = found.stress[:, 1]
    off = np.abs(vertical / vertical.mean() - 1.0).max()
    name = f"bodies in space, flush, {case}"
    record_verification(f"{name}: force [N]", exact, found.force)
    record_verification(f"{name}: stress off its mean", 0.0, off)
    record_verification(
        f"{name}: penetration over size", 0.0, found.summary["largest_body_penetration"]
    )
    assert found.force == pytest.approx(exact, rel=0.01)
    assert off < limit
    if off >= PATCH:
        pytest.xfail(f"coarse facets sample fine ones too thinly: stress {100 * off:.2g} % off")


# Two balls: radii, thickness of their caps on the axis and their width, and how far they approach.
RADII, THICKNESS, WIDTH, APPROACH = (60e-3, 80e-3), 9e-3, 16e-3, 0.075e-3
SIZES = (0.4e-3, 0.32e-3)  # of the elements where they touch
CAP_CELLS = 12  # across a cap, and through it


def graded(size, extent, count):
    """Return stations from 0 to `extent`, the first two `size` apart, with growing distances."""
    k = np.arange(count + 1) / count
    growth = brentq(lambda g: extent * np.sinh(g / count) / np.sinh(g) - size, 1e-3, 20.0)
    return extent * np.sinh(growth * k) / np.sinh(growth)


def write_cap(path, radius, size):
    """Write half the section of a ball's cap on a flat base, graded towards its top on the axis."""
    across, down = graded(size, WIDTH, CAP_CELLS), graded(size, THICKNESS, CAP_CELLS)
    grid = mesh_of_block(CAP_CELLS, CAP_CELLS, 1.0, "quad")
    i, j = np.round(grid.points + np.array([CAP_CELLS / 2, 0])).astype(int).T
    top = THICKNESS - radius + np.sqrt(radius**2 - across[i] ** 2)
    points = np.column_stack([across[i], top * (1.0 - down[CAP_CELLS - j] / THICKNESS)])
    sets = {"base": np.flatnonzero(j == 0), "top": np.flatnonzero(j == CAP_CELLS)}
    SmallMesh(points, grid.cells, sets, ("top",)).write(path, "axisymmetric")


def test_ball_on_ball(press, tmp_path, record_verification):
    """Balls of 60 and 80 mm that approach by 0.075 mm, as caps 9 mm thick on rigid bases: Hertz's
    force on bonded layers, contact radius a = 1.6 mm, largest pressure p_0 = 5.7 kPa. To be
    expected: (h / 2a)^2 = 1.6 % of the approach at h = 0.4 mm, as points touch or not; penetration
    p_0 / k, half of it felt, 0.4 %; 1.5 times these of the force; sides at 16 mm.
    """
    for name, radius, size in zip("lu", RADII, SIZES, strict=True):
        write_cap(tmp_path / f"{name}.inp", radius, size)
    bodies = from_file("l", "axisymmetric")
    bodies += from_file("u", "axisymmetric", 2 * THICKNESS, mirror=True)
    ends = held(("l.base", "u.base"), "x")
    scene = pushed(bodies, 1e3 * APPROACH, "[l.top, u.top]", ends, "l.base", "u.base")
    force = press(scene).force
    E = 9 * BULK * SHEAR / (3 * BULK + SHEAR)
    nu = (3 * BULK - 2 * SHEAR) / (2 * (3 * BULK + SHEAR))
    # Each of two bodies of one material moves as under a rigid ball of twice the common radius.
    radius = 2 / (1 / RADII[0] + 1 / RADII[1])
    exact = structural_forms.layer_indentation_force(APPROACH / 2, radius, THICKNESS, E, nu)
    record_verification("bodies, axisymmetric, ball on ball: force [N]", exact, force)
    assert force == pytest.approx(exact, rel=0.03)


def momenta(solver):
    """Linear and angular momentum about the origin (6,), at half steps as the scheme keeps them."""
    mass, x = solver.models[0].mass, solver.positions()[0]
    v = fields.read(solver.terms.nodes.velocity)[0]
    return np.array([*(mass @ v), *(mass @ np.cross(x, v))])


@pytest.mark.parametrize("cells", ["quad", "simplex"])
def test_colliding_bodies_keep_their_momenta(build, start, record_verification, cells):
    """A box flies into another off its middle, rubs, and flies off turning: momentum and angular
    momentum stay to round-off. The energy balance closes within 0.5 % with half of the usual step;
    with the whole one it is off by four times as much, 0.7 %.
    """
    from softsim.solver.energy import EnergyBalance, EnergyReader

    velocity = (2, -3, 1)
    bodies = box("l", (4, 2, 4), 1, (-2, -2, -2), cells)
    bodies += box("u", (3, 2, 3), 1, (-1.8, 0.2, -1.3), cells, velocity)
    model = build(
        f"bodies:\n{bodies}{SETTINGS}"
        "contact: {self_contact: [l, u], friction_coefficient: 0.3}\ntime: {end: 1 s}\n"
    )
    solver = start(model, share=0.45)
    reader = EnergyReader(solver)
    balance = EnergyBalance.starting(reader.read(), model)
    before, errors, touched = momenta(solver), [], []
    while solver.time < 2e-3:
        solver.advance(10)
        energies = reader.read()
        errors.append(balance.error(energies))
        touched.append(energies.contact > 0.0)
    change = momenta(solver) - before
    scale = np.abs(model.mass[:, None] * model.velocity).sum() * np.repeat([1.0, 4e-3], 3)
    name = f"bodies in space, {cells}, collision"
    record_verification(f"{name}: change of momenta", 0.0, np.abs(change / scale).max())
    record_verification(f"{name}: energy error", 0.0, max(errors))
    assert any(touched)
    assert not touched[-1]
    np.testing.assert_array_less(np.abs(change), 1e-12 * scale)
    assert max(errors) < 0.005


SLIDING = """
contact: {self_contact: [l, u], friction_coefficient: 0}
conditions:
  base: {kind: fixed, nodes: l.bottom}
  down: {kind: prescribed, nodes: u.top, direction: y,
         displacement: {kind: smooth_step, value: -0.2 mm, duration: 5 ms}}
  along: {kind: prescribed, nodes: u.top, direction: x, displacement: {kind: table,
          points: [[0 s, 0 mm], [6 ms, 0 mm], [8 ms, 0.12 mm], [37 ms, 3.6 mm]]}}
  across: {kind: fixed, nodes: u.top, directions: [z]}
time: {end: 37 ms}
output: {frame_interval: 1 s, history_interval: 0.25 ms,
         probes: {push: {kind: reaction, nodes: u.top}}}
"""


JUMP, KNOWN_JUMPS = 0.15, {"quad": 0.2, "simplex": 0.25}
"""Largest change of the force over its largest value: wanted, and known."""


@pytest.mark.parametrize("cells", ["quad", pytest.param("simplex", marks=pytest.mark.slow)])
def test_a_box_slides_off_an_edge(run, record_verification, cells):
    """A box pressed on another is moved over its edge until they part: the energy balance closes
    within 0.5 %, and the force falls without a jump (it was 25 % with nodes against facets).
    """
    bodies = box("l", (6, 3, 6), 1, (-3, -3, -3), cells)
    bodies += box("u", (4, 2, 4), 0.8, (0, 0, -2), cells)
    results = run(f"bodies:\n{bodies}{SETTINGS}{SLIDING}")
    push, t = -results.history["push_y"], results.history["time"]
    error = results.summary["energy_error"]
    jump = np.abs(np.diff(push[t > 5e-3])).max() / push.max()
    name = f"bodies in space, {cells}, sliding off"
    record_verification(f"{name}: energy error", 0.0, error)
    record_verification(f"{name}: largest change of the force in 0.03 mm", 0.0, jump)
    assert np.abs(push[-8:]).max() < 0.2 * push.max()
    assert error < 0.005
    assert jump < KNOWN_JUMPS[cells]
    if jump > JUMP:
        # With rows four times as dense hexahedra change it by 10 %, not 17: it swings as they part.
        pytest.xfail(f"the force swings as they part, by {100 * jump:.2g} % within 0.03 mm")


SIDE, CELL = 4e-3, 1e-3  # of the beams' square section, and of their elements


def write_beam(path, along, shift):
    """Write a beam with a square section along x or z, one edge of it lowest, at y = 0.

    shift: along it [m]. Sets: edge, and away, the nodes on the axis and above.
    """
    mesh = mesh_of_box(2 * SIDE, SIDE, SIDE, CELL, "quad")
    x, y, z = (mesh.points - [SIDE - shift, 0.0, 0.0]).T
    y, z = (y + z) / np.sqrt(2), (z - y) / np.sqrt(2)
    sets = {"edge": np.flatnonzero(y == 0.0), "away": np.flatnonzero(y > SIDE / np.sqrt(2) - 1e-9)}
    points = np.column_stack([x, y, z] if along == "x" else [z, y, -x])
    SmallMesh(points, mesh.cells, sets).write(path, "solid")


# Where the edges cross, in elements from a node of each: depth at which their contact begins.
CROSSINGS = {(0.5, 0.0): 0.0, (0.25, 0.25): 0.25, (0.5, 0.5): 0.40}


@pytest.mark.parametrize(
    "shifts",
    [*(pytest.param(s, marks=pytest.mark.slow) for s in list(CROSSINGS)[:-1]), (0.5, 0.5)],
)
def test_beams_that_cross_do_not_pass_through(press, record_verification, tmp_path, shifts):
    """Two beams, each with an edge towards the other, are pressed together by an element's size.

    Points touch facets, and edges do not touch edges: where no node is at the crossing, the edges
    sink into each other by up to 0.4 elements before centroids of facets touch, then they hold.
    """
    write_beam(tmp_path / "l.inp", "z", shifts[0] * CELL)
    write_beam(tmp_path / "u.inp", "x", shifts[1] * CELL)
    bodies = from_file("l", "solid", mirror=True) + from_file("u", "solid")
    ends = held(("l.away", "u.away"), "xz")
    found = press(pushed(bodies, 1e3 * CELL, "[l, u]", ends, "l.away", "u.away"))
    way, energy = found.contact_energy.T
    begin = way[energy > 1e-6 * energy[-1]][0] / CELL
    lower, upper = np.split(np.flatnonzero(found.rest[:, 1] == 0.0), 2)
    at_lower, at_upper = found.places[lower], found.places[upper]
    order, sequence = np.argsort(at_lower[:, 2]), np.argsort(at_upper[:, 0])
    sunk = np.interp(0.0, *at_lower[order][:, [2, 1]].T)
    sunk = (sunk - np.interp(0.0, *at_upper[sequence][:, :2].T)) / CELL
    name = f"bodies in space, edges that cross, {shifts}"
    record_verification(f"{name}: depth without contact, in elements", CROSSINGS[shifts], begin)
    record_verification(f"{name}: depth, pressed by an element", 0.0, sunk)
    record_verification(f"{name}: force [N]", 0.0, found.force)
    assert begin == pytest.approx(CROSSINGS[shifts], abs=0.03)
    assert sunk < 0.55
