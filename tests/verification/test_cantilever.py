"""Bending: first frequency and sag of a cantilever, n elements through its height.

A linear element cannot bend: interpolated at the nodes of elements of size a = h/n, pure bending
stores more energy than it should, by a share e of order 1/n^2 that `bending_excess` computes from
the mesh alone. Finite elements find the least energy, so their bending stiffness is at most 1 + e
times that of the beam, and their first frequency at most sqrt(1 + e) times. A clamp that holds the
height too stops the root from swelling and narrowing: it shortens the beam by less than h/10
(Saint-Venant), which is END below.

Quadrilaterals and hexahedra store the exact energy of bending, one of them through the height as
many: what is left is the end, and the mode's shape between nodes, below 1 %.
"""

import dataclasses
import io

import numpy as np
import pytest
import structural_forms
from rich.console import Console

from softsim.compute import fields
from softsim.solver.natural_modes import natural_modes

HEIGHT, DENSITY, SHEAR_MODULUS = 1e-3, 1000.0, 72e3
KAPPA = 20.0 * SHEAR_MODULUS
BETA = 1.8751040687  # first root of cosh(b) cos(b) = -1
END = 0.1

BEAM = """
bodies:
  beam: {mesh: MESH, formulation: FORMULATION, material: rubber, fixed: [left]}
materials: {rubber: {law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}}
environment: {gravity: 0 m/s^2}
solver: {bulk_viscosity: 0}
time: {end: 1 s}
"""


def beam(formulation, length, elements):
    """The scene of a beam 1 mm high (and wide, in space) with so many elements through it."""
    sizes = f"length: {1e3 * length} mm, height: 1 mm, element_size: {1.0 / elements} mm"
    if formulation == "solid":
        mesh, more = f"{{generator: box, width: 1 mm, {sizes}}}", "solid"
    else:
        mesh, more = f"{{generator: block, {sizes}}}", "plane_strain, thickness: 1 mm"
    return BEAM.replace("MESH", mesh).replace("FORMULATION", more)


def moduli(kappa):
    """Young's modulus and Poisson's ratio of small strain."""
    E = 9.0 * kappa * SHEAR_MODULUS / (3.0 * kappa + SHEAR_MODULUS)
    return E, E / (2.0 * SHEAR_MODULUS) - 1.0


def plane_moduli(kappa):
    """As `moduli`, of a section that cannot strain across its depth."""
    E, nu = moduli(kappa)
    return E / (1.0 - nu**2), nu / (1.0 - nu)


def bending_excess(points, cells, kappa):
    """Energy of pure bending interpolated at the nodes, with averaged nodal pressure, over that of
    the beam, less one.
    """
    dimension = points.shape[1]
    E, nu = plane_moduli(kappa) if dimension == 2 else moduli(kappa)
    X = points - 0.5 * (points.min(axis=0) + points.max(axis=0))
    x, y = X[:, 0], X[:, 1]
    u = np.zeros_like(X)
    u[:, 0], u[:, 1] = -x * y, 0.5 * (x * x + nu * y * y)
    if dimension == 3:
        u[:, 1] -= 0.5 * nu * X[:, 2] ** 2
        u[:, 2] = nu * y * X[:, 2]
    edges = X[cells[:, 1:]] - X[cells[:, :1]]
    volume = np.abs(np.linalg.det(edges)) / (2.0 if dimension == 2 else 6.0)
    gradient = np.linalg.solve(edges, u[cells[:, 1:]] - u[cells[:, :1]])
    strain = 0.5 * (gradient + gradient.transpose(0, 2, 1))
    dilation = np.trace(strain, axis1=1, axis2=2)
    distortion = (strain**2).sum(axis=(1, 2)) - dilation**2 / 3.0
    nodal, swollen = np.zeros(len(points)), np.zeros(len(points))
    np.add.at(nodal, cells, volume[:, None] / cells.shape[1])
    np.add.at(swollen, cells, (volume * dilation)[:, None] / cells.shape[1])
    energy = SHEAR_MODULUS * volume @ distortion + 0.5 * kappa * (swollen**2 / nodal).sum()
    return energy / (0.5 * E * HEIGHT**2 / 12.0 * volume.sum()) - 1.0


def first_frequency(model, start, length, guess):
    """From the time [Hz] at which the motion, which starts as the first mode, comes to rest: a
    quarter of the period. A thousandth of the length at most: linear.
    """
    X = model.points
    s = BETA * (X[:, 0] - X[:, 0].min()) / length
    y = X[:, 1] - X[:, 1].mean()
    root = (np.cosh(BETA) + np.cos(BETA)) / (np.sinh(BETA) + np.sin(BETA))
    shape = 0.5 * (np.cosh(s) - np.cos(s) - root * (np.sinh(s) - np.sin(s)))
    slope = 0.5 * BETA * (np.sinh(s) + np.sin(s) - root * (np.cosh(s) - np.cos(s)))
    velocity = np.zeros_like(X)
    velocity[:, 0], velocity[:, 1] = -y * slope / length, shape
    velocity *= 1e-3 * length * 2.0 * np.pi * guess * model.is_free
    solver = start(dataclasses.replace(model, velocity=velocity))

    def speed():
        """Share of the mode in the velocity of half a step later, weighted by mass."""
        return (model.mass * shape) @ fields.read(solver.terms.nodes.velocity)[0, :, 1]

    time, before, now = 0.0, 0.0, speed()
    while now > 0.0:
        assert solver.time < 1.0 / guess
        time, before = solver.time, now
        solver.advance(64)
        now = speed()
    rest = time + (solver.time - time) * before / (before - now) + 0.5 * solver.time_increment
    return 0.25 / rest


@pytest.mark.slow
def test_frequency_in_plane_strain(build, start, record_verification):
    """20 x 1 mm: Timoshenko's frequency with E/(1 - nu^2), to order 2 in the element size.

    Off by the excess of the mesh, by the end (twice END h/L = 1 %), by the step ((omega dt)^2/24)
    and by the beam theory ((h/L)^4), the last two far below 0.1 %. With four triangles through
    the height that is up to 9.3 %, with eight 2.7 %; extrapolated, the end is left.
    """
    length = 20e-3
    E, nu = plane_moduli(KAPPA)
    exact = structural_forms.timoshenko_frequency(
        length, HEIGHT, E, SHEAR_MODULUS, DENSITY, structural_forms.rectangle_shear_coefficient(nu)
    )
    end = 2.0 * END * HEIGHT / length
    found = {}
    for n in (2, 4, 8):
        model = build(beam("plane_strain", length, n))
        excess = bending_excess(model.points, model.bodies[0].cells, KAPPA)
        found[n] = first_frequency(model, start, length, exact)
        assert exact * (1.0 - end) < found[n] < exact * (np.sqrt(1.0 + excess) + end)
    order = np.log2((found[2] - found[4]) / (found[4] - found[8]))
    for n in (4, 8):
        case = f"cantilever frequency [Hz], plane strain, {n} triangles high"
        record_verification(case, exact, found[n], order)
    extrapolated = found[8] + (found[8] - found[4]) / 3.0
    record_verification("cantilever frequency [Hz], plane strain, limit", exact, extrapolated)
    assert found[8] == pytest.approx(exact, rel=0.03)
    assert extrapolated == pytest.approx(exact, rel=end)
    assert 1.5 < order < 2.5


@pytest.mark.parametrize(
    ("formulation", "length", "count"),
    [
        ("plane_strain", 20e-3, 1),
        pytest.param("plane_strain", 20e-3, 2, marks=pytest.mark.slow),
        pytest.param("plane_strain", 20e-3, 4, marks=pytest.mark.slow),
        pytest.param("solid", 10e-3, 1, marks=pytest.mark.slow),
        pytest.param("solid", 10e-3, 2, marks=pytest.mark.slow),
    ],
)
def test_frequency_of_quadrilaterals(build, start, record_verification, formulation, length, count):
    """One, two, four through the height: `test_frequency_in_plane_strain` without its excess."""
    E, nu = (plane_moduli if formulation == "plane_strain" else moduli)(KAPPA)
    exact = structural_forms.timoshenko_frequency(
        length, HEIGHT, E, SHEAR_MODULUS, DENSITY, structural_forms.rectangle_shear_coefficient(nu)
    )
    model = build(beam(formulation, length, count), "bodies.beam.mesh.cells=quad")
    assert len(model.bodies[0].cells) == count**model.dimension * round(length / HEIGHT)
    found = first_frequency(model, start, length, exact)
    case = f"cantilever frequency [Hz], {formulation}, {count} quad high"
    record_verification(case, exact, found)
    assert found == pytest.approx(exact, rel=2.0 * END * HEIGHT / length + 0.01)


def test_natural_frequency(build, start, record_verification):
    """What swings in the solver swings at the mode's frequency, up to (omega dt)^2 and the square
    of the amplitude; the second mode is 6.27 times as fast in a slender beam, and less in this one.
    """
    length = 20e-3
    model = build(beam("plane_strain", length, 4))
    first, second = natural_modes(model, model.bodies[0], 2).modes
    swinging = first_frequency(model, start, length, first.frequency)
    record_verification("natural frequency [Hz] of a swinging beam", swinging, first.frequency)
    assert first.frequency == pytest.approx(swinging, rel=1e-3)
    assert 6.0 < second.frequency / first.frequency < 6.27
    assert first.dynamic_frequency == pytest.approx(first.frequency, rel=1e-9)  # no branches


@pytest.mark.slow
def test_frequency_in_space(build, start, record_verification):
    """10 x 1 x 1 mm, coarse: two and four bricks of six tetrahedra through it.

    As in the plane, with E for E/(1 - nu^2); the end is 2 %.
    """
    length = 10e-3
    E, nu = moduli(KAPPA)
    exact = structural_forms.timoshenko_frequency(
        length, HEIGHT, E, SHEAR_MODULUS, DENSITY, structural_forms.rectangle_shear_coefficient(nu)
    )
    end = 2.0 * END * HEIGHT / length
    found, bounds = [], []
    for n in (2, 4):
        model = build(beam("solid", length, n))
        excess = bending_excess(model.points, model.bodies[0].cells, KAPPA)
        bounds.append(np.sqrt(1.0 + excess) - 1.0)
        found.append(first_frequency(model, start, length, exact))
        assert exact * (1.0 - end) < found[-1] < exact * (1.0 + bounds[-1] + end)
    errors = np.array(found) / exact - 1.0
    order = np.log2(errors[0] / errors[1])
    record_verification("cantilever frequency [Hz], solid, 4 bricks high", exact, found[1], order)
    assert errors[1] < 0.5 * errors[0]  # two bricks are far from the order to come


@pytest.mark.slow
@pytest.mark.parametrize(("cells", "counts"), [("simplex", (2, 4)), ("quad", (1, 2, 4))])
def test_sag(cells, counts, write_scene, tmp_path, kernel_cache, monkeypatch, record_verification):
    """20 x 1 mm under its own weight, nu = 0.4: the tip drops by two fifths of the length.

    The elastica is neither sheared nor clamped at its height: shear adds (4/12) E/(k G) (h/L)^2 of
    the drop, half a percent, the end takes away 4 END h/L = 2 % of it at most, the excess of the
    mesh is one of stiffness. The material hardens by the square of the strain, 0.05^2.
    """
    from softsim.builder import build_model
    from softsim.run import run
    from softsim.scene.loading import load_scene

    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    length = 20e-3
    kappa = 2.0 * SHEAR_MODULUS * 1.4 / (3.0 * (1.0 - 2.0 * 0.4))
    E, nu = plane_moduli(kappa)
    stiffness = E * HEIGHT**3 / 12.0  # of a metre of thickness, as the weight
    weight = DENSITY * 9.81 * HEIGHT
    exact = structural_forms.elastica_sag(length, stiffness, weight).drop
    assert 0.3 * length < exact < 0.6 * length
    slender = (HEIGHT / length) ** 2
    shear = E / (3.0 * structural_forms.rectangle_shear_coefficient(nu) * SHEAR_MODULUS) * slender
    end = 4.0 * END * HEIGHT / length

    # The tolerance is a share of the inner forces, which in bending are far above the outer.
    settings = ["environment.gravity=9.81 m/s^2", "time.procedure=static", "time.end=100 ms",
                "solver.equilibrium_tolerance=1e-6", "solver.bulk_viscosity=0.06"]  # fmt: skip
    errors = []
    for n in counts:
        text = beam("plane_strain", length, n).replace("kg/m^3}", "kg/m^3, poisson_ratio: 0.4}")
        text += "output: {probes: {tip: {kind: displacement, nodes: beam.right}}}\n"
        loaded = load_scene(write_scene(text), [*settings, f"bodies.beam.mesh.cells={cells}"])
        console = Console(file=io.StringIO())
        results = run(loaded, out=tmp_path / f"out{n}", device="cpu", console=console)
        drop = -results.summary["probes"]["tip_y"]
        model = build_model(loaded)
        excess = 0.0
        if cells == "simplex":
            excess = bending_excess(model.points, model.bodies[0].cells, kappa)
        stiffest = structural_forms.elastica_sag(length, (1.0 + excess) * stiffness, weight).drop
        assert stiffest - end * exact < drop < (1.0 + shear) * exact
        record_verification(f"cantilever sag [m], {n} {cells} high", exact, drop)
        errors.append(drop / exact - 1.0)
    if cells == "simplex":
        assert 1.5 < np.log2(errors[0] / errors[1]) < 2.5
