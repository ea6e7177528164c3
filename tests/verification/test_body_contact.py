"""Contact between deformable bodies in plane strain.

What two bodies do to each other must not depend on symmetry planes, on edges that are flush, on the
facets that the scene names, or on the meshes. All bodies are neo-Hookean quadrilaterals, 10 mm
thick, with C10 = 50 kPa and a bulk modulus of 2 MPa.
"""

import io
from dataclasses import dataclass, replace

import closed_forms
import meshes
import numpy as np
import pytest
from scipy.optimize import brentq

C10, BULK, DEPTH, MM = 50e3, 2e6, 10e-3, 1e-3
SHEAR = 2.0 * C10
NU = (3.0 * BULK - 2.0 * SHEAR) / (2.0 * (3.0 * BULK + SHEAR))
CONTACT_MODULUS = SHEAR / (1.0 - NU)
"""E* of two equal bodies [Pa]: E / (2 (1 - nu^2)) with E = 2 G (1 + nu)."""

SCENE = """
bodies:
{bodies}
materials: {{soft: {{law: neo_hooke, C10: 50 kPa, bulk_modulus: 2 MPa, density: 1000 kg/m^3}}}}
environment: {{gravity: 0 m/s^2}}
contact: {{self_contact: [{touching}], friction_coefficient: 0}}
conditions:
{conditions}
time: {{end: 20 ms, procedure: static, settle: 200 ms}}
output: {{frame_interval: 1 s, fields: [stress], probes: {{
  push: {{kind: reaction, nodes: u.top}}}}}}
"""
BODY = (
    "  {name}: {{mesh: {{file: {name}.inp, length_unit: 1 m}}, formulation: plane_strain, "
    "thickness: 10 mm, material: soft}}\n"
)
PRESS = """
  press: {{kind: prescribed, nodes: u.top, direction: y,
          displacement: {{kind: smooth_step, value: -{depth} mm, duration: 20 ms}}}}
"""
CLAMPED = """
  base: {kind: fixed, nodes: l.bottom}
  sides: {kind: fixed, nodes: u.top, directions: [x]}
"""
ROLLING = """
  base: {kind: fixed, nodes: l.bottom, directions: [y]}
  stop_l: {kind: fixed, nodes: l.up_left, directions: [x]}
  stop_u: {kind: fixed, nodes: u.low_left, directions: [x]}
"""
HALVED = """
  middle_l: {kind: symmetry, nodes: l.left, normal: x}
  middle_u: {kind: symmetry, nodes: u.left, normal: x}
"""


def clamped(depth):
    """Conditions of a lower body that is held at its bottom and an upper one that is pushed down
    by `depth` [mm] at its top.
    """
    return CLAMPED + PRESS.format(depth=depth)


def scene_text(bodies, conditions, touching):
    """A scene of bodies of these names, whose meshes are in files."""
    names = "".join(BODY.format(name=name) for name in bodies)
    return SCENE.format(bodies=names, conditions=conditions, touching=touching)


# Meshes -------------------------------------------------------------------------------------------


def filled(x, y):
    """Quadrilaterals between the columns x and the rows y [mm], both rising.

    Facet sets left, right, bottom, top; node sets low_left, up_left and up_right, a corner each.
    """
    mesh = meshes.joined(
        meshes.grid(
            len(x) - 1, len(y) - 1,
            lambda s, t: (
                MM * np.asarray(x)[np.round(s * (len(x) - 1)).astype(int)],
                MM * np.asarray(y)[np.round(t * (len(y) - 1)).astype(int)],
            ),
        )
    )  # fmt: skip
    left, top = mesh.node_sets["left"], mesh.node_sets["top"]
    corners = {"low_left": left[:1], "up_left": left[-1:], "up_right": top[-1:]}
    return replace(mesh, node_sets=mesh.node_sets | corners)


def rectangle(columns, rows, low, high):
    """Equal quadrilaterals that fill the rectangle from `low` to `high`, (x, y) in mm."""
    (a, b), (c, d) = low, high
    return filled(np.linspace(a, c, columns + 1), np.linspace(b, d, rows + 1))


def bulging(x, depths, radius):
    """A block below the origin whose top is an arc of this radius that touches y = 0; columns x and
    rows that lie so deep below the top in the middle, rising from zero [mm].
    """
    mesh = filled(x, -np.asarray(depths)[::-1])
    sag = radius * MM - np.sqrt((radius * MM) ** 2 - mesh.points[:, 0] ** 2)
    height = depths[-1] * MM
    y = mesh.points[:, 1] * (height - sag) / height - sag
    return replace(mesh, points=np.column_stack([mesh.points[:, 0], y]))


def upside_down(mesh):
    """The mirror image in y = 0, with the names of top and bottom swapped."""
    flipped = mesh.node_sets | {"top": mesh.node_sets["bottom"], "bottom": mesh.node_sets["top"]}
    return replace(
        mesh, points=mesh.points * [1.0, -1.0], cells=mesh.cells[:, ::-1], node_sets=flipped
    )


def graded(size, fine, extent, count):
    """Stations from 0 to `extent`: cells of `size` up to `fine`, then `count` that grow evenly."""
    inner = size * np.arange(round(fine / size) + 1)
    k = np.arange(1, count + 1)
    ratio = brentq(lambda g: size * (g**k).sum() - (extent - inner[-1]), 1.0, 10.0)
    return np.concatenate([inner, inner[-1] + size * np.cumsum(ratio**k)])


def mirrored(stations):
    """Stations from -extent to extent."""
    return np.concatenate([-stations[:0:-1], stations])


def strip_and_block(whole):
    """A block of 12 mm by 5 mm and one of 8 mm by 5 mm over a gap of 0.1 mm; `whole` or halves."""
    left, sides = (-1, 2) if whole else (0, 1)
    return {
        "l": rectangle(6 * sides, 3, (6 * left, 0), (6, 5)),
        "u": rectangle(5 * sides, 3, (4 * left, 5.1), (4, 10.1)),
    }


def flush(columns_l, columns_u):
    """Two blocks of 8 mm by 5 mm, one on top of the other, whose faces meet at y = 0."""
    return {
        "l": rectangle(columns_l, 4, (-4, -5), (4, 0)),
        "u": rectangle(columns_u, 4, (-4, 0), (4, 5)),
    }


# Runs ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Pressed:
    """A run: its summary and history; at its end the force [N] on the upper body's top, positions
    (n, 2) [m] and Cauchy stresses (m, 6) [Pa], the lower body's first.
    """

    summary: dict
    history: dict
    force: float
    positions: np.ndarray
    stress: np.ndarray

    def principal_stresses(self):
        """Principal stresses (2, m) in the plane [Pa], the smaller ones first."""
        xx, yy, _, xy = self.stress[:, :4].T
        mean, radius = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
        return np.stack([mean - radius, mean + radius])


@pytest.fixture
def press(kernel_cache, monkeypatch, write_scene, tmp_path):
    """Write the meshes of the bodies, by name, and run a scene of them quietly."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from rich.console import Console

    from softsim.output.fields import read_frames
    from softsim.run import run

    def pressed(bodies, conditions, *overrides, touching="l, u", loads=""):
        for name, mesh in bodies.items():
            mesh.write(tmp_path / f"{name}.inp", "plane_strain")
        scene = write_scene(scene_text(bodies, conditions, touching) + loads)
        out, console = tmp_path / "out", Console(file=io.StringIO())
        results = run(scene, overrides, out, "cpu", console=console)
        assert results.summary["status"] == "done"
        frames = read_frames(out / "results.vtkhdf")
        last = len(frames) - 1
        return Pressed(
            summary=results.summary,
            history=results.history,
            force=-float(results.history["push_y"][-1]),
            positions=frames.points + frames.point_data["displacement"][last][:, :2],
            stress=frames.cell_data["stress"][last],
        )

    return pressed


@dataclass(frozen=True)
class Face:
    """Contact on a row of nodes: places x (k,) [m], normal and tangential forces (k,) [N], widths
    (k,) [m] that belong to the nodes.
    """

    x: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray
    width: np.ndarray

    def square(self, force):
        """Mean of x^2, weighted by a distribution of force [m^2].

        The force on a node is spread over its hat function, which adds h^2 / 6.
        """
        return (force * (self.x**2 - self.width**2 / 6.0)).sum() / force.sum()


@pytest.fixture
def faces(build, start, tmp_path):
    """Press two bodies together; return the contact on the lower and the upper one's face."""
    from softsim.compute import fields
    from softsim.solver.energy import unbalanced_share

    def face(model, body, side, x, force):
        nodes = model.bodies[body].node_sets[side]
        nodes = nodes[np.argsort(x[nodes, 0])]
        place = x[nodes, 0]
        middles = 0.5 * (place[1:] + place[:-1])
        width = np.diff(np.concatenate([place[:1], middles, place[-1:]]))
        return Face(place, np.abs(force[nodes, 1]), np.abs(force[nodes, 0]), width)

    def pressed(bodies, conditions, *overrides, touching="l, u"):
        for name, mesh in bodies.items():
            mesh.write(tmp_path / f"{name}.inp", "plane_strain")
        model = build(scene_text(bodies, conditions, touching), *overrides)
        solver = start(model)
        scenario, limit = solver.scenario(0), model.end_time + 0.1
        while solver.time < model.end_time or unbalanced_share(scenario) > 1e-5:
            solver.advance(256)
            assert solver.time < limit
        # At rest contact holds against the elements, whose slots come first.
        slots = solver.terms.nodes.corner_forces
        owner = np.concatenate(slots._owners)[: solver.terms.self_contacts[0].first_slot]
        force, used = np.zeros_like(model.points), owner >= 0
        for k, component in enumerate(slots.component):
            np.add.at(force[:, k], owner[used], -fields.read(component)[0, : len(owner)][used])
        x = solver.positions()[0]
        return face(model, 0, "top", x, force), face(model, 1, "bottom", x, force)

    return pressed


# Planes of symmetry, flush edges, open surfaces ---------------------------------------------------


def test_symmetry_and_open_surfaces(press, record_verification):
    """A block on a wider one. Half of the force acts on a half model, whose faces at x = 0 lie in a
    plane of symmetry, and all of it where only the faces that meet are named, within 0.5 %.
    """
    bodies = strip_and_block(whole=True)
    whole = press(bodies, clamped(1.1)).force
    named = press(bodies, clamped(1.1), touching="l.top, u.bottom").force
    half = press(strip_and_block(whole=False), clamped(1.1) + HALVED).force
    record_verification("half model against whole, plane: force [N]", whole, 2.0 * half)
    record_verification("open surfaces against whole, plane: force [N]", whole, named)
    assert 2.0 * half == pytest.approx(whole, rel=0.005)
    assert named == pytest.approx(whole, rel=0.005)


def slip_and_depth(bodies, positions):
    """Return the largest distance of the corners of two flush faces along x, and the largest depth
    of vertices and middles of facets in the other body; both over the smaller facets' length.
    """
    lower, upper = bodies.values()
    below = positions[: len(lower.points)][lower.node_sets["top"]]
    above = positions[len(lower.points) :][upper.node_sets["bottom"]]
    size = 8e-3 / (max(len(below), len(above)) - 1)
    depth = 0.0
    for points, face, sign in ((above, below, -1.0), (below, above, 1.0)):
        points = np.concatenate([points, 0.5 * (points[1:] + points[:-1])])
        points = points[(points[:, 0] >= face[0, 0]) & (points[:, 0] <= face[-1, 0])]
        depth = max(depth, (sign * (points[:, 1] - np.interp(points[:, 0], *face.T))).max())
    return np.abs(below[[0, -1], 0] - above[[0, -1], 0]).max() / size, depth / size


@pytest.mark.parametrize("columns", [(4, 4), (5, 4)])
def test_flush_blocks_are_as_stiff_as_one(press, record_verification, columns):
    """Pressed by 10 % face to face: the force of one block of both heights within 1 %, also where
    only the faces that meet are named.
    """
    bodies = flush(*columns)
    pair = press(bodies, clamped(1.0))
    # By symmetry each half of one block is as stiff as one of the two: they are springs in a row.
    compliance = 0.0
    for count in columns:
        one = {"u": rectangle(count, 8, (-4, -5), (4, 5))}
        compliance += 0.5 / press(one, clamped(1.0).replace("l.", "u."), touching="").force
    name = "{} on {}".format(*columns)
    record_verification(f"flush blocks, {name}: force [N]", 1.0 / compliance, pair.force)
    slip, depth = slip_and_depth(bodies, pair.positions)
    record_verification(f"flush blocks, {name}: slip of corners / element", 0.0, slip)
    record_verification(f"flush blocks, {name}: penetration / element", 0.0, depth)
    assert pair.force == pytest.approx(1.0 / compliance, rel=0.01)
    assert slip < 0.01
    assert depth < 0.01
    named = press(bodies, clamped(1.0), touching="l.top, u.bottom")
    record_verification(f"flush blocks, {name}, open: force [N]", pair.force, named.force)
    assert named.force == pytest.approx(pair.force, rel=0.005)


@pytest.mark.parametrize("columns", [(5, 4), (8, 4), (4, 8)])
def test_patch(press, record_verification, columns):
    """Pressed by 10 %, free to widen: uniform stress within 2 %, and the closed form's force."""
    bodies = flush(*columns)
    pair = press(bodies, ROLLING + PRESS.format(depth=1.0))
    nominal = closed_forms.nearly_incompressible_pure_shear(0.9, (C10,), BULK).stress
    slip, depth = slip_and_depth(bodies, pair.positions)
    low, high = pair.principal_stresses()
    mean = low.mean()
    name = "contact patch, {} on {}".format(*columns)
    record_verification(f"{name}: force [N]", -nominal * 8e-3 * DEPTH, pair.force)
    record_verification(f"{name}: deviation of stress", 0.0, np.abs(low / mean - 1.0).max())
    record_verification(f"{name}: lateral stress", 0.0, np.abs(high / mean).max())
    record_verification(f"{name}: penetration / element", 0.0, depth)
    assert pair.force == pytest.approx(-nominal * 8e-3 * DEPTH, rel=0.01)
    np.testing.assert_allclose(low, mean, rtol=0.02)
    np.testing.assert_allclose(high, 0.0, atol=0.02 * abs(mean))
    assert slip < 0.01
    assert depth < 0.01


@pytest.mark.parametrize("columns", [(5, 4), (8, 4)])
def test_patch_aslant(press, record_verification, columns):
    """The same between pressures of 40 kPa, both bodies turned by 30 degrees about a corner that
    stays where it is. What holds the bodies goes where uniform stress puts it: it bears nothing.
    """
    pressure, c, s = 40e3, np.cos(np.pi / 6.0), np.sin(np.pi / 6.0)
    corner, turn = np.array([4e-3, 0.0]), np.array([[c, s], [-s, c]])
    bodies = {
        name: replace(mesh, points=(mesh.points + corner) @ turn)
        for name, mesh in flush(*columns).items()
    }

    def state(stretch):
        return closed_forms.nearly_incompressible_pure_shear(stretch, (C10,), BULK)

    def excess(stretch):
        return state(stretch).stress / state(stretch).lateral_stretch + pressure

    widening = 8.0 * (state(brentq(excess, 0.8, 1.0)).lateral_stretch - 1.0)
    conditions = f"""
  stop_l: {{kind: fixed, nodes: l.up_left}}
  stop_u: {{kind: fixed, nodes: u.low_left, directions: [x]}}
  turn: {{kind: prescribed, nodes: l.up_right, direction: y,
         displacement: {{kind: smooth_step, value: {widening * s} mm, duration: 20 ms}}}}
"""
    squeeze = f"""
loads:
  squeeze: {{kind: follower_pressure, facets: [l.bottom, u.top],
            profile: {{kind: smooth_step, value: {pressure} Pa, duration: 20 ms}}}}
"""
    low, high = press(bodies, conditions, loads=squeeze).principal_stresses() / -pressure
    name = "contact patch aslant, {} on {}".format(*columns)
    record_verification(f"{name}: deviation of stress", 0.0, np.abs(low - 1.0).max())
    record_verification(f"{name}: lateral stress", 0.0, np.abs(high).max())
    np.testing.assert_allclose(low, 1.0, rtol=0.02)
    np.testing.assert_allclose(high, 0.0, atol=0.02)


# Curved bodies ------------------------------------------------------------------------------------

RADIUS = 20.0  # [mm]


def cylinders(columns_l, columns_u):
    """Two equal blocks whose faces are arcs of RADIUS."""
    depths = graded(0.2, 0.6, 10.0, 7)
    return {
        "l": bulging(columns_l, depths, RADIUS),
        "u": upside_down(bulging(columns_u, depths, RADIUS)),
    }


@pytest.mark.parametrize("sizes", [pytest.param((0.2, 0.2), marks=pytest.mark.slow), (0.2, 0.25)])
def test_hertz(faces, record_verification, sizes):
    """Half models of two cylinders: half width of contact and largest pressure that belong to their
    force P per length (Johnson 1985, section 4.2): a^2 = 4 P R* / (pi E*), p_0 = 2 P / (pi a).

    From the nodal forces: the mean of x^2 over Hertz's pressure is a^2 / 4, and its square is a
    straight line over x^2 that starts at p_0^2. The bodies are eight half widths wide and ten high,
    and the largest strain, about p_0 / E*, is 5 %.
    """
    columns = [graded(size, 1.5, 8.0, 6) for size in sizes]
    for name, face in zip("lu", faces(cylinders(*columns), clamped(0.17) + HALVED), strict=True):
        load = 2.0 * face.normal.sum() / DEPTH
        a = np.sqrt(4.0 * load * 0.5 * RADIUS * MM / (np.pi * CONTACT_MODULUS))
        largest = 2.0 * load / (np.pi * a)
        pressure = face.normal / (face.width * DEPTH)
        inner = face.x < 0.8 * a
        fitted = np.polyfit(face.x[inner] ** 2, pressure[inner] ** 2, 1)[1]
        found_a, found_p = 2.0 * np.sqrt(face.square(face.normal)), np.sqrt(fitted)
        case = f"Hertz, {sizes[0]} on {sizes[1]} mm, {name}"
        record_verification(f"{case}: half width [m]", a, found_a)
        record_verification(f"{case}: largest pressure [Pa]", largest, found_p)
        assert found_a == pytest.approx(a, rel=0.03)
        assert found_p == pytest.approx(largest, rel=0.04)


@pytest.mark.slow
def test_cattaneo_mindlin(faces, record_verification):
    """Pressed, then sheared by Q = 0.6 mu P: the middle sticks (Johnson 1985, section 7.2).

    With the half widths a of contact and c of sticking, (c/a)^2 = 1 - Q / (mu P), tangential
    traction is that of sliding all over minus that of sliding on the inner part, so that
        int q x^2 dx / (mu int p x^2 dx) = 1 - (c/a)^4.
    """
    mu, columns = 0.3, mirrored(graded(0.2, 1.5, 8.0, 6))
    conditions = """
  base: {kind: fixed, nodes: l.bottom}
  shear: {kind: prescribed, nodes: u.top, direction: x, displacement:
          {kind: table, points: [[0 ms, 0 mm], [20 ms, 0 mm], [50 ms, 0.08 mm]]}}
"""
    pair = faces(
        cylinders(columns, columns), conditions + PRESS.format(depth=0.17),
        f"contact.friction_coefficient={mu}", "time.end=50 ms",
    )  # fmt: skip
    for name, face in zip("lu", pair, strict=True):
        P, Q = face.normal.sum(), face.tangential.sum()
        face = replace(face, x=face.x - (face.normal * face.x).sum() / P)
        sticking = np.sqrt(1.0 - Q / (mu * P))
        moments = face.square(face.tangential) * Q / (face.square(face.normal) * mu * P)
        case = f"Cattaneo and Mindlin, {name}"
        record_verification(f"{case}: second moment", 1.0 - sticking**4, moments)
        assert 0.5 < Q / (mu * P) < 0.7
        assert moments == pytest.approx(1.0 - sticking**4, rel=0.03)


# Motion -------------------------------------------------------------------------------------------


def sliding(duration):
    """Meshes and conditions of a block that is held 0.2 mm too low and slides off another at a
    constant speed within `duration` [ms]: for a quarter of it over the middle of the face, then
    over the edge.
    """
    bodies = {
        "l": rectangle(13, 3, (-8, 0), (5, 3)),
        "u": rectangle(6, 3, (-6.5, 3), (-0.5, 6)),
    }
    conditions = f"""
  base: {{kind: fixed, nodes: l.bottom}}
  lower: {{kind: prescribed, nodes: u.top, direction: y,
          displacement: {{kind: smooth_step, value: -0.2 mm, duration: {duration / 6} ms}}}}
  slide: {{kind: prescribed, nodes: u.top, direction: x,
          displacement: {{kind: ramp, value: 12 mm, duration: {duration} ms}}}}
"""
    return bodies, conditions


@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_energy_of_a_block_that_slides_off_an_edge(press, record_verification, mu):
    """At 0.5 m/s: the balance within 0.5 %."""
    found = press(
        *sliding(24.0), "time.procedure=dynamic", "time.end=24 ms", "time.settle=null",
        "output.history_interval=0.05 ms", f"contact.friction_coefficient={mu}",
        "bodies.u.initial_velocity=[0.5 m/s, 0 m/s]",
    )  # fmt: skip
    record_verification(f"sliding off, mu {mu}: energy", 0.0, found.summary["energy_error"])
    assert found.summary["energy_error"] < 0.005


def test_force_of_a_block_that_slides_off_an_edge(press, record_verification):
    """Slowly, without friction: within a fortieth of an element the force changes by no more than
    5 % of what it is on the middle of the face. Where the last corners pass each other, half an
    element before the end and later, by no more than half of a facet's load there: what two corners
    bear falls to zero with the logarithm of their overlap only, which no element resolves.
    """
    found = press(
        *sliding(96.0), "time.end=96 ms", "output.history_interval=0.2 ms",
        "environment.gravity=9.81 m/s^2", "bodies.u.initial_velocity=[0.125 m/s, 0 m/s]",
    )  # fmt: skip
    time, force = found.history["time"], -found.history["push_y"]
    steady = force[(time > 24e-3) & (time < 40e-3)].mean()
    jumps, row = np.abs(np.diff(force)) / steady, time[1:]
    on_edge = jumps[(row > 20e-3) & (row < 88e-3)].max()
    at_the_end = jumps[(row >= 88e-3) & (row < 96e-3)].max()
    record_verification("sliding off: largest jump of force", 0.0, on_edge)
    record_verification("sliding off: jump as the last corners pass", 0.0, at_the_end)
    assert on_edge < 0.05
    assert at_the_end < 1.0 / 12.0


def test_a_stack_rests(press, record_verification):
    """Three flush blocks on a slope of 24 degrees, close to the friction angle of 26.6 degrees: in
    0.3 s none of them drifts by a millionth of an element.
    """
    bodies = {
        "l": rectangle(4, 2, (-4, 0), (4, 4)),
        "m": rectangle(5, 2, (-4, 4), (4, 8)),
        "u": rectangle(4, 2, (-4, 8), (4, 12)),
    }
    probes = ", ".join(f"{name}: {{kind: displacement, nodes: {name}.top}}" for name in bodies)
    found = press(
        bodies, "  base: {kind: fixed, nodes: l.bottom}\n",
        "time.procedure=dynamic", "time.end=0.3 s", "time.settle=2 s",
        "environment.gravity=9.81 m/s^2", "environment.inclination=24 deg",
        "contact.friction_coefficient=0.5",
        f"output.probes={{{probes}, push: {{kind: reaction, nodes: l.bottom}}}}",
        touching="l, m, u",
    )  # fmt: skip
    for name in bodies:
        path = np.column_stack([found.history[f"{name}_{axis}"] for axis in "xy"])
        drift = np.linalg.norm(path - path[0], axis=1).max()
        record_verification(f"stack at rest, {name}: drift [m]", 0.0, drift)
        assert drift < 2e-9


@pytest.mark.slow
def test_ironing(press, record_verification):
    """A round block pressed into a flat one, eight of whose elements it touches, and drawn along:
    the tangential force oscillates by less than 10 % of its mean, from lowest to highest.
    """
    bodies = {
        "l": rectangle(44, 8, (-4, -2), (7, 0)),
        "u": upside_down(bulging(np.linspace(-2.4, 2.4, 16), np.linspace(0.0, 2.5, 9), 3.0)),
    }
    conditions = """
  base: {kind: fixed, nodes: l.bottom}
  slide: {kind: prescribed, nodes: u.top, direction: x, displacement:
          {kind: table, points: [[0 ms, 0 mm], [20 ms, 0 mm], [80 ms, 3 mm]]}}
"""
    found = press(
        bodies, conditions + PRESS.format(depth=0.25), "time.end=80 ms",
        "output.history_interval=0.5 ms", "contact.friction_coefficient=0.3",
    )  # fmt: skip
    time = found.history["time"]
    steady = (time > 50e-3) & (time <= 80e-3)
    for name, column in (("normal", "push_y"), ("tangential", "push_x")):
        force = found.history[column][steady]
        oscillation = np.ptp(force) / np.abs(force.mean())
        record_verification(f"ironing: oscillation of the {name} force", 0.0, oscillation)
        assert oscillation < 0.1
