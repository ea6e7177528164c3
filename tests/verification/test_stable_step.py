"""The stable step against the eigenvalues of the real tangent.

The tangent is the central difference of the forces that the kernels compute, a column for each free
component: its error, h^2 f'''/6 + eps f / h with h = 1e-8 m in elements of 1e-3 m, is under 1e-6 of
its largest entry. 2/omega of its largest frequency is the exact limit; the bound must be below it,
by no more than a given factor: at rest 1.03 of the Lanczos iteration and what |sym dev h|^2 <=
|h|^2 gives away; under strain the stiffest directions of the parts no longer are the same.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softsim.solver.stable_step import STEPS, StableStepEstimator, shortfall, stable_step

BLOCK = "{generator: block, length: 3 mm, height: 2 mm, element_size: 1 mm}"
# Two strips with a spike each: ring cells and single ones, 56 nodes; the axis at y = 3 mm.
STRIPS = (
    "{generator: pfr_section, inner_diameter: 4 mm, outer_diameter: 8 mm, free_length: 4 mm, "
    "spikes_per_strip: 1, spike_height: 2 mm, root_thickness: 2 mm, tip_thickness: 1 mm, "
    "element_size: 1 mm}"
)
BOX = "{generator: box, length: 2 mm, height: 2 mm, width: 2 mm, element_size: 1 mm}"
KINDS = {
    "plane_strain": f"mesh: {BLOCK}, formulation: plane_strain, thickness: 5 mm",
    "axisymmetric": f"mesh: {BLOCK}, formulation: axisymmetric, position: [2 mm, 0 mm]",
    "ring_section": f"mesh: {STRIPS}, formulation: ring_section, thickness: 5 mm, sector: 90 deg, "
    "rings: skin, position: [1 mm, 3 mm]",
    "solid": f"mesh: {BOX}, formulation: solid",
}
SCENE = """
bodies: {b: {KIND, material: soft}}
materials:
  soft: {law: yeoh, C10: 36 kPa, C20: 5 kPa, C30: 1 kPa, density: 1000 kg/m^3,
         prony: [{g: 0.3, relaxation_time: 1 ms}]}
environment: {gravity: 0 m/s^2}
loads: {p: {kind: follower_pressure, facets: [b.FACETS], profile: {kind: constant, value: 0 Pa}}}
solver: {bulk_viscosity: 0}
time: {end: 1 s}
"""
QUADS = ("bodies.b.mesh.cells=quad",)
# Nothing but rings, whose wall is four times as thick as the radius of their hole.
NARROW = ("bodies.b.mesh.inner_diameter=1.6 mm", "bodies.b.mesh.spikes_per_strip=0")
# What the pressure acts on: in a ring section only rings enclose anything.
FACETS = dict.fromkeys(KINDS, "surface") | {"ring_section": "chamber"}
# Every node of a body that has moved far down is inside the floor.
FLOOR = (
    "environment.walls={floor: {kind: plane, point: [0 mm, -50 mm]}}",
    "contact={friction_coefficient: 1e6, damping_ratio: 0}",
)


@pytest.fixture
def limits(build, fresh_taichi):
    """The exact stable step and the bound [s] with the nodes at x, the metric of the Maxwell branch
    unrelaxed (as at rest) or relaxed to the present strain.
    """
    from softsim.compute import backend, fields
    from softsim.elements.one_point import padded
    from softsim.solver.explicit import ExplicitSolver

    def start(formulation, *overrides):
        text = SCENE.replace("KIND", KINDS[formulation]).replace("FACETS", FACETS[formulation])
        model = build(text, *overrides)
        solver = ExplicitSolver([model])
        solver.begin(1e-9)
        step, body = StableStepEstimator(model), model.regions[0]
        points = solver.terms.elements[0].points
        for elements in solver.terms.elements:
            if elements.points.branch_count:
                elements.points.relaxation.share.fill(0.0)  # the metric stays

        def forces(x):
            nodes = solver.terms.nodes
            fields.write(nodes.position, x[None])
            solver.find_forces(1e-9)
            return fields.read(nodes.force)[0]

        def relax(x):
            F = body.deformation(x)
            C_bar = np.linalg.det(F)[:, None, None] ** (-2 / 3) * (F.transpose(0, 2, 1) @ F)
            A = np.linalg.inv(C_bar)
            d = body.points.shape[1]
            inverse = np.linalg.inv(solver.terms.elements[0].rest_edges(body))
            plane = inverse.transpose(0, 2, 1) @ A[:, :d, :d] @ inverse
            modulus = fields.read(points.branch_modulus)[0]
            for name, field in zip(points.metric.components, points.branch_stress, strict=True):
                if name == "zz":
                    values = A[:, 2, 2]
                else:
                    i, j = ("abc".index(letter) for letter in name)
                    values = plane[:, i, j]
                fields.write(field, modulus * padded(values).reshape(1, -1, backend.lanes()))

        def exact_and_bound(x, relaxed=False):
            if relaxed:
                relax(x)
            forces(x)  # the anchors of friction are set here
            size, h = x.size, 1e-8
            K = np.zeros((size, size))
            for c in range(size):
                ends = []
                for sign in (1.0, -1.0):
                    moved = x.copy()
                    moved.flat[c] += sign * h
                    ends.append(forces(moved).ravel())
                K[:, c] = (ends[1] - ends[0]) / (2.0 * h)
            root = 1.0 / np.sqrt(np.repeat(model.mass, x.shape[1]))
            D = root[:, None] * K * root
            omega_squared = np.linalg.eigvalsh(0.5 * (D + D.T))[-1]
            return 2.0 / np.sqrt(omega_squared), step.at(x).value

        return model, solver, exact_and_bound

    return start


UPPER = {
    "plane_strain": "{plane: {point: [0 mm, 1 mm], normal: [0, 1]}}",
    "ring_section": "{plane: {point: [0 mm, 6 mm], normal: [0, 1]}}",
    "solid": "{plane: {point: [0 mm, 1 mm, 0 mm], normal: [0, 1, 0]}}",
}
HARD = "{law: neo_hooke, C10: 100 kPa, bulk_modulus: 9 MPa, density: 1500 kg/m^3}"


@pytest.mark.parametrize("formulation", list(UPPER))
def test_of_two_regions(limits, formulation):
    """A node where they meet has two averaged pressures, each with a stiffness of its own; at rest
    and sheared.
    """
    model, _, exact_and_bound = limits(
        formulation, f"materials.hard={HARD}", "bodies.b.regions={upper: {material: hard}}",
        f"bodies.b.sets={{upper: {UPPER[formulation]}}}",
    )  # fmt: skip
    assert len(model.regions) == 2
    for x in (model.points, model.points @ np.transpose(STRAINS[formulation]["sheared"])):
        exact, bound = exact_and_bound(x)
        assert 0.6 * exact < bound < exact


STRAINS = {
    "plane_strain": {
        "stretched": [[1.8, 0.0], [0.0, 1 / 1.8]],
        "squeezed": [[0.9, 0.0], [0.0, 0.9]],
        "sheared": [[1.0, 0.8], [0.0, 1.0]],
    },
    "axisymmetric": {
        "stretched": [[1.8, 0.0], [0.0, 1 / 1.8**2]],  # the radius: a skin that is blown up
        "squeezed": [[0.93, 0.0], [0.0, 0.93]],
        "sheared": [[1.0, 0.0], [0.8, 1.0]],
    },
    "ring_section": {
        # Blown up. J of rings is that of single parts times F_yy: these are 1.18 and 0.85.
        "stretched": [[1.4**-1.5, 0.0], [0.0, 1.4]],
        "squeezed": [[0.93, 0.0], [0.0, 0.93]],
        "sheared": [[1.0, 0.8], [0.0, 1.0]],
    },
    "solid": {
        "stretched": np.diag([1.8, 1.8, 1 / 1.8**2]),
        "squeezed": 0.93 * np.eye(3),
        "sheared": [[1.0, 0.8, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    },
}


# Laws of the same shear modulus at rest.
YEOH = "law: yeoh, C10: 36 kPa, C20: 5 kPa, C30: 1 kPa"
MOONEY_RIVLIN = "law: mooney_rivlin, C10: 30 kPa, C01: 6 kPa"
OGDEN = "law: ogden, mu: [60 kPa, 10 kPa, 2 kPa], alpha: [1.3, -2.5, 7]"


def made_of(law):
    """What replaces the material by one of this law."""
    more = "density: 1000 kg/m^3, prony: [{g: 0.3, relaxation_time: 1 ms}]"
    return (f"materials.soft={{{law}, {more}}}",)


@pytest.mark.parametrize(
    ("formulation", "overrides"),
    [
        *[(formulation, ()) for formulation in KINDS],
        *[(formulation, QUADS) for formulation in KINDS],
        ("plane_strain", made_of(MOONEY_RIVLIN)),
        ("solid", made_of(OGDEN)),
        pytest.param("axisymmetric", made_of(OGDEN), marks=pytest.mark.slow),
    ],
)
def test_under_strain(limits, record_verification, formulation, overrides):
    """At rest, under uniform strain with the Maxwell branch fresh and relaxed, and under a pressure
    of a quarter of the shear modulus all around, in equilibrium: initial stress and the load's own
    stiffness, which the bound leaves out, are in the tangent.
    """
    model, solver, exact_and_bound = limits(formulation, *overrides)
    places = {"at rest": model.points}
    for name, F in STRAINS[formulation].items():
        places[name] = model.points @ np.transpose(F)
    J = 1.0 - 18e3 / model.regions[0].material.bulk_modulus
    places["pressed"] = model.points * J ** (1.0 / (2 if formulation == "plane_strain" else 3))
    for name, x in places.items():
        solver.terms.loads[0].kernel.table.value.fill(18e3 if name == "pressed" else 0.0)
        exact, bound = exact_and_bound(x)
        law = type(model.regions[0].material.law).__name__
        cells = "quads" if overrides == QUADS else law
        record_verification(f"stable step [s], {formulation}, {cells}, {name}", exact, bound)
        assert bound < exact
        assert bound > exact / (1.1 if name == "at rest" else 1.35)
    exact, bound = exact_and_bound(places["stretched"], relaxed=True)
    assert exact / 1.35 < bound < exact


SOFTENING = "mullins: {r: 1.5, m: 1 kPa, beta: 0.2}"


@pytest.mark.parametrize(
    ("formulation", "law"), [("plane_strain", OGDEN), ("solid", YEOH)], ids=["ogden", "yeoh"]
)
def test_of_a_material_that_softens(limits, record_verification, formulation, law):
    """Compare the bound with the exact step at the beginning of unloading and after much unloading.

    The largest energy densities are written into the solver. The bound holds for all of them, so it
    is far below the exact step after much unloading.
    """
    from softsim.compute import fields

    model, solver, exact_and_bound = limits(formulation, *made_of(f"{law}, {SOFTENING}"))
    peak = solver.terms.elements[0].points.softening.peak
    for name, F in STRAINS[formulation].items():
        x = model.points @ np.transpose(F)
        fields.write(peak, 0.0)
        virgin = exact_and_bound(x)[0]
        for times, gap in ((1.0 + 1e-4, 1.5), (3.0, 3.0)):
            fields.write(peak, 0.0)
            solver.find_forces(1e-9)
            fields.write(peak, times * fields.read(peak))
            exact, bound = exact_and_bound(x)
            if times < 2.0 and name == "stretched":
                assert exact < virgin
            if times > 2.0 and name != "squeezed":
                assert exact > virgin
            record_verification(
                f"stable step [s], softening, {formulation}, {name}, {times:.3g} W", exact, bound
            )
            assert exact / gap < bound < exact


@pytest.mark.parametrize("formulation", ["plane_strain", "solid"])
def test_in_contact(limits, record_verification, formulation):
    """Every node of the surface sticks to a floor; of the boxes' 27 nodes all but one."""
    model, _, exact_and_bound = limits(formulation, *FLOOR)
    exact, bound = exact_and_bound(model.points - 60e-3 * np.eye(model.dimension)[1])
    record_verification(f"stable step [s], {formulation}, in contact", exact, bound)
    assert exact < 0.9 * exact_and_bound(model.points)[0]  # contact is in the tangent
    assert exact / 1.35 < bound < exact


@pytest.mark.parametrize("overrides", [(), QUADS], ids=["simplexes", "quads"])
@pytest.mark.parametrize("formulation", list(KINDS))
def test_any_strain(limits, formulation, overrides):
    """Nodes off their places at random, after a random uniform strain: no element looks alike."""
    model, _, exact_and_bound = limits(formulation, *overrides)
    d = model.dimension

    @settings(max_examples=4, derandomize=True, database=None)
    @given(
        stretch=st.floats(0.7, 1.6),
        shear=st.floats(-0.5, 0.5),
        scatter=st.floats(0.0, 0.08e-3),
        seed=st.integers(0, 99),
    )
    def check(stretch, shear, scatter, seed):
        F = np.eye(d)
        F[0, 0], F[1, 1] = (stretch, 1.0 / stretch)
        F[1, 0] = shear
        if formulation == "axisymmetric":
            F[1, 1] /= stretch  # a ring of another radius
        if formulation == "ring_section":
            F[1, 1] = stretch ** (-2.0 / 3.0)  # between what single parts and rings yield to
        x = model.points @ F.T
        x = x + scatter * np.random.default_rng(seed).standard_normal(x.shape)
        exact, bound = exact_and_bound(x)
        assert exact / 1.6 < bound < exact

    check()


def test_rings_that_are_pressed_from_one_side(limits, record_verification):
    """Strips whose stiffness differs: one pushed outward and thinned, the other as it was; both
    moved far across the axis. What couples opposite sides cannot be told from one side.
    """
    model, _, exact_and_bound = limits("ring_section")
    x = model.points + np.array([0.0, 20e-3])
    upper = model.points[:, 1] > 3e-3
    at_rest, _ = exact_and_bound(model.points)
    assert exact_and_bound(x)[0] == pytest.approx(at_rest, rel=1e-5)  # moved as a whole
    x[upper, 1] += 0.5e-3 - 0.2 * (model.points[upper, 1] - 5e-3)
    exact, bound = exact_and_bound(x)
    record_verification("stable step [s], ring_section, one strip pushed", exact, bound)
    assert exact / 1.35 < bound < exact
    assert exact / 1.35 < exact_and_bound(x, relaxed=True)[1] < exact_and_bound(x, relaxed=True)[0]


@pytest.mark.parametrize("angle", [0.0, 45.0, 90.0])
def test_rings_that_have_turned(limits, record_verification, angle):
    """Blown up, in disorder and under pressure, with the axis in any direction: the exact limit is
    the same, and so is the bound but for what Lanczos' iteration from another start may lack.
    """
    model, solver, exact_and_bound = limits("ring_section")
    solver.terms.loads[0].kernel.table.value.fill(2e3)
    noise = np.random.default_rng(7).standard_normal(model.points.shape)
    x = model.points * [1.0 / 1.2, 1.2] + 0.05e-3 * noise
    as_it_was, before = exact_and_bound(x)
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    exact, bound = exact_and_bound(x @ np.array([[c, s], [-s, c]]))
    record_verification(f"stable step [s], ring_section, turned by {angle:g} deg", exact, bound)
    assert exact == pytest.approx(as_it_was, rel=1e-6)
    assert exact / 1.35 < bound < exact
    assert bound == pytest.approx(before, rel=0.5 * shortfall(x.size, STEPS))


def test_rings_with_a_narrow_hole(limits, record_verification):
    """F_zz is as large a part of the strain as the section's own, and in half of all modes opposite
    sides move alike, so that it has no part.
    """
    model, _, exact_and_bound = limits("ring_section", *NARROW)
    exact, bound = exact_and_bound(model.points)
    record_verification("stable step [s], ring_section, a narrow hole", exact, bound)
    assert exact / 1.1 < bound < exact


def test_one_model_many_configurations(build):
    """An object that is kept answers as one made anew: nothing depends on what it saw before."""
    model = build(SCENE.replace("KIND", KINDS["plane_strain"]).replace("FACETS", "surface"))
    step, x = StableStepEstimator(model), model.points * 1.1
    step.at(model.points)
    assert step.at(x).value == stable_step(model, x).value
