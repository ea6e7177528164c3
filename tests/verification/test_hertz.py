"""A rigid ball pressed on a soft block: Hertz, as a bonded layer and as a half space know it.

Ball of radius R = 5 mm, 50 mN in all, Dragon Skin 10 (E = 213 kPa, nu = 0.475), block 9 mm high on
a rigid base and 20 mm in radius, no friction. Hertz: contact radius a = 0.88 mm, largest pressure
p_0 = 31 kPa, depth 0.155 mm on a half space, 0.144 mm on the bonded layer, which is exact here
(`structural_forms.layer_indentation_force`). Errors, relative to the depth d, to be expected:
    (h / 2a)^2 = 1.3 % at h = 0.2 mm: nodes touch or not, so a is known to half a cell, and the
        depth is stationary in a;
    p_0 h / (2 kappa d) = 1.5 % at h = 0.2 mm: penetration. The contact is a layer of compliance
        h / kappa; of such a layer the complementary energy (h / 2 kappa) int p^2 dA is
        3/8 F p_0 h / kappa for Hertz's pressure, and its slope over F (p_0 goes with F^(1/3)) is
        p_0 h / (2 kappa);
    d / R = 3 %: finite strain, and the ball is no paraboloid (0.2 %);
    side walls at 20 mm: 0.1 %.
So 5 % on the coarse mesh. What is left when the mesh is refined and the contact made stiffer is
finite strain, below d / R.
"""

from dataclasses import dataclass

import numpy as np
import pytest
import structural_forms
from scipy.optimize import brentq

from softsim.compute import fields

RADIUS, HEIGHT, WIDTH, FORCE = 5e-3, 9e-3, 20e-3, 0.05
SHEAR, BULK = 72e3, 1.44e6
E = 9.0 * BULK * SHEAR / (3.0 * BULK + SHEAR)
NU = (3.0 * BULK - 2.0 * SHEAR) / (2.0 * (3.0 * BULK + SHEAR))
A = np.cbrt(0.75 * FORCE * RADIUS * (1.0 - NU**2) / E)
LARGEST_PRESSURE = 1.5 * FORCE / (np.pi * A**2)

SCENE = """
bodies:
  block: {{mesh: {{file: block.inp}}, formulation: {formulation}, material: dragon_skin_10,
          fixed: [base]}}
rigid_bodies:
  ball: {{mass: {mass} g, inertia: 1 kg*mm^2, center: [0 mm, 14 mm], outline: {{radius: 5 mm}},
         supports: [block.top], free: [y]}}
environment: {{gravity: 0 m/s^2}}
loads: {{press: {{kind: rigid_force, acts_on: ball, force: [0 N, -{force} N], ramp: 3 ms}}}}
time: {{end: 3 ms, procedure: static}}
"""
SYMMETRY = """
conditions:
  x: {kind: symmetry, nodes: block.left, normal: x}
  z: {kind: symmetry, nodes: block.back, normal: z}
"""


@pytest.fixture(scope="module")
def depth():
    """How deep the ball goes into the bonded layer [m]."""

    def excess(d):
        return structural_forms.layer_indentation_force(d, RADIUS, HEIGHT, E, NU) - FORCE

    return brentq(excess, 1e-5, 1e-3)


def stations(size: float, extent: float, growth: float, level: int = 0) -> np.ndarray:
    """From 0 to `extent`: cells of `size` up to 1.2 mm, growing from there; halved `level` times,
    so that all of the mesh is refined, not its fine part only.
    """
    fine = round(1.2e-3 / size)
    rest = extent / size - fine
    count = int(np.ceil(np.log1p(rest * (growth - 1.0) / growth) / np.log(growth)))
    ratio = brentq(lambda g: (g ** np.arange(1, count + 1)).sum() - rest, 1.0, growth)
    cells = np.concatenate([np.ones(fine), ratio ** np.arange(1, count + 1)])
    result = size * np.concatenate([[0.0], np.cumsum(cells)])
    for _ in range(level):
        result = np.sort(np.concatenate([result, 0.5 * (result[1:] + result[:-1])]))
    return result


def write_inp(path, points, cells, kind, sets):
    """An ABAQUS input file in mm."""
    lines = ["*NODE"]
    lines += [f"{k}, " + ", ".join(f"{1e3 * c:.12g}" for c in p) for k, p in enumerate(points, 1)]
    lines.append(f"*ELEMENT, TYPE={kind}")
    lines += [f"{k}, " + ", ".join(str(a + 1) for a in cell) for k, cell in enumerate(cells, 1)]
    for name, nodes in sets.items():
        lines += [f"*NSET, NSET={name}", *(f"{a + 1}," for a in nodes)]
    path.write_text("\n".join(lines) + "\n")


def write_rings(path, radii, depths, cells):
    """A half section, graded towards the top of the axis; `cells`: simplex or quad."""
    from softsim.robots.block import block

    columns, rows = len(radii) - 1, len(depths) - 1
    grid = block(columns, rows, 1.0, cells)
    i, j = np.round(grid.points + np.array([columns / 2, 0.0])).astype(int).T
    points = np.column_stack([radii[i], HEIGHT - depths[rows - j]])
    sets = {"top": np.flatnonzero(j == rows), "base": np.flatnonzero(j == 0)}
    write_inp(path, points, grid.cells, f"CAX{grid.cells.shape[1]}", sets)


def write_quarter(path, sides, depths, cells):
    """A quarter of a square block in space, graded towards the top of its inner edge; `cells` as
    above.
    """
    from softsim.robots.block import box

    columns, rows = len(sides) - 1, len(depths) - 1
    grid = box(columns, columns, rows, 1.0, cells)
    i, j, k = np.round(grid.points).astype(int).T
    points = np.column_stack([sides[i], HEIGHT - depths[rows - j], sides[k]])
    sets = {"top": j == rows, "base": j == 0, "left": i == 0, "back": k == 0}
    sets = {name: np.flatnonzero(chosen) for name, chosen in sets.items()}
    write_inp(path, points, grid.cells, f"C3D{grid.cells.shape[1]}", sets)


@dataclass(frozen=True)
class Pressed:
    """Depth of the ball [m], normal forces' mean penetration [m], their vertical sum [N], radius of
    the outermost node that touches [m].
    """

    depth: float
    penetration: float
    force: float
    contact_radius: float


def pressed(solver) -> Pressed:
    """Go on until forces balance, and look."""
    from softsim.solver.energy import unbalanced_share

    model, scenario = solver.models[0], solver.scenario(0)
    limit = solver.time + 0.1
    solver.advance(256)
    while solver.time < model.end_time or unbalanced_share(scenario) > model.relaxation.tolerance:
        solver.advance(256)
        assert solver.time < limit
    contact = solver.terms.supports[0]
    N = fields.read(contact.normal_force)[0]
    centre = fields.read(solver.terms.rigid_bodies.centre)[0, 0]
    arms = solver.positions()[0][model.outlines[0].support.nodes] - centre
    gaps = np.linalg.norm(arms, axis=1) - RADIUS
    return Pressed(
        depth=HEIGHT + RADIUS - centre[1],
        penetration=-float(N @ gaps / N.sum()),
        force=-float(fields.read(contact.force)[0][:, 1].sum()),
        contact_radius=float(np.linalg.norm(np.delete(arms, 1, axis=1), axis=1)[N > 0.0].max()),
    )


@pytest.fixture
def axisymmetric(build, start, tmp_path):
    """Press the ball into rings of `size` at the contact, halved `level` times: with the automatic
    penalty stiffness, and then with twice as much.
    """

    def press(size, growth, level=0, cells="simplex"):
        spacing = (stations(size, extent, growth, level) for extent in (WIDTH, HEIGHT))
        write_rings(tmp_path / "block.inp", *spacing, cells)
        scene = SCENE.format(formulation="axisymmetric", mass=0.05, force=FORCE)
        solver = start(build(scene), share=0.8)  # stable for both
        soft = pressed(solver)
        stiffness = solver.terms.supports[0].penalty.k_n
        fields.write(stiffness, 2.0 * fields.read(stiffness))
        return soft, pressed(solver)

    return press


@pytest.fixture
def quarter(build, start, tmp_path):
    """The same in space, a quarter of it with a quarter of the force."""

    def press(size, growth, cells):
        spacing = (stations(size, extent, growth) for extent in (WIDTH, HEIGHT))
        write_quarter(tmp_path / "block.inp", *spacing, cells)
        scene = SCENE.format(formulation="solid", mass=0.0125, force=FORCE / 4.0)
        return pressed(start(build(scene + SYMMETRY)))

    return press


@pytest.mark.parametrize("cells", [pytest.param("simplex", marks=pytest.mark.slow), "quad"])
def test_axisymmetric(depth, axisymmetric, record_verification, cells):
    """Depth within 5 %, contact radius within a cell, and what the penalty adds, at h = 0.2 mm."""
    size = 0.2e-3
    found, stiff = axisymmetric(size, 1.4, cells=cells)
    # Forces balance within the tolerance of the static procedure.
    assert found.force == pytest.approx(FORCE, rel=1e-4)
    assert found.depth == pytest.approx(depth, rel=0.05)
    assert abs(found.contact_radius - A) < size
    # Twice the stiffness takes half of the penalty's share away, to first order. A layer of
    # compliance h / kappa penetrates by 3/4 p_0 h / kappa, averaged over the force, known to half a
    # cell of the contact radius; the share cannot be larger than the penetration.
    layer = LARGEST_PRESSURE * size / BULK
    share = 2.0 * (found.depth - stiff.depth)
    assert found.penetration == pytest.approx(0.75 * layer, rel=size / (2.0 * A))
    assert stiff.penetration == pytest.approx(0.5 * found.penetration, rel=size / (2.0 * A))
    assert 0.0 < share < found.penetration
    name = f"Hertz, rings 0.2 mm, {cells}"
    record_verification(f"{name}: depth [m]", depth, found.depth)
    record_verification(f"{name}: penalty's share of it", layer / 2.0, share)


@pytest.mark.slow
@pytest.mark.parametrize("cells", ["simplex", "quad"])
def test_axisymmetric_against_space(depth, axisymmetric, quarter, record_verification, cells):
    """Rings and a quarter in space on the same stations, h = 0.3 mm: each knows the contact radius
    to half a cell, so they agree within (h / 2a)^2 = 2.9 %; both within 5 % of the exact depth.
    """
    size = 0.3e-3
    (rings, _), space = axisymmetric(size, 1.8, cells=cells), quarter(size, 1.8, cells)
    assert space.force == pytest.approx(FORCE / 4.0, rel=1e-4)
    assert space.depth == pytest.approx(rings.depth, rel=(size / (2.0 * A)) ** 2)
    assert space.depth == pytest.approx(depth, rel=0.05)
    assert rings.depth == pytest.approx(depth, rel=0.05)
    assert abs(space.contact_radius - A) < np.sqrt(2.0) * size
    record_verification(f"Hertz, in space 0.3 mm, {cells}: depth [m]", depth, space.depth)
    record_verification(f"Hertz, space against rings, {cells} [m]", rings.depth, space.depth)


@pytest.mark.slow
def test_axisymmetric_converges(depth, axisymmetric, record_verification):
    """Three nested meshes, 0.2 to 0.05 mm: penetration falls with h, the depth under a rigid
    contact (extrapolated from two stiffnesses) settles faster than h, on the layer's within d / R.
    """
    levels = [axisymmetric(0.2e-3, 1.4, level) for level in range(3)]
    penetration = np.array([soft.penetration for soft, _ in levels])
    rigid = np.array([2.0 * stiff.depth - soft.depth for soft, stiff in levels])
    for level, (soft, _) in enumerate(levels):
        size = 0.2e-3 / 2**level
        layer = 0.75 * LARGEST_PRESSURE * size / BULK
        assert soft.penetration == pytest.approx(layer, rel=size / (2.0 * A))
        assert soft.depth == pytest.approx(depth, rel=0.05)
    orders = np.log2(penetration[:-1] / penetration[1:])
    np.testing.assert_allclose(orders, 1.0, atol=0.15)
    steps = np.abs(np.diff(rigid))
    assert steps[1] < 0.5 * steps[0]
    assert rigid[-1] == pytest.approx(depth, rel=depth / RADIUS)
    finest = levels[-1][0]
    record_verification("Hertz, rings 0.05 mm: depth [m]", depth, finest.depth)
    record_verification("Hertz, rings 0.05 mm, rigid contact: depth [m]", depth, rigid[-1])
    record_verification(
        "Hertz, rings 0.05 mm: mean penetration [m]",
        0.75 * LARGEST_PRESSURE * 0.05e-3 / BULK, finest.penetration, float(orders[-1]),
    )  # fmt: skip
