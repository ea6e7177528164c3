"""Which models are scenarios of one structure."""

import pytest

from softsim.compute.term import shares_kernels

SCENE = """
bodies:
  b: {mesh: {generator: block, length: 4 mm, height: 2 mm, element_size: 1 mm},
      formulation: plane_strain, thickness: 5 mm, material: dragon_skin_10}
rigid_bodies: {robot: {mass: 1 g, inertia: 1 g*mm^2}}
loads:
  air: {kind: follower_pressure, facets: [b.top], profile: {kind: constant, value: 1 kPa}}
  tail: {kind: tether, acts_on: robot, drag: 1 mN}
  pull: {kind: nodal_force, nodes: b.right, force: [20 mN, 0 mN]}
environment: {walls: {floor: {kind: plane, point: [0 mm, -2 mm]}}}
contact: {friction_coefficient: 0.4}
time: {end: 12 ms}
"""
OF_A_SCENARIO = [
    "contact.friction_coefficient=0.1",
    "environment.walls.floor.point=[0 mm, -3 mm]",
    "environment.inclination=10 deg",
    "environment.gravity=[1 m/s^2, 2 m/s^2]",
    "loads.pull.force=[0 mN, 5 mN]",
    "loads.tail={kind: tether, acts_on: robot, drag: 2 mN, at: [1 mm, 0 mm], weight: 1 mN, "
    "pitch_stiffness: 1 N*mm/rad}",
    "loads.air.profile={kind: cycles, highest: 2 kPa, inflation_rate: 1 kPa/s, deflation_rate: "
    "1 kPa/s, lowest: 0 kPa, count: 2}",
    "time.end=1 s",
    "time.increment=1 us",
    "solver.safety_factor=0.5",
]
OF_THE_STRUCTURE = [
    "bodies.b.mesh.element_size=0.5 mm",
    "bodies.b.thickness=4 mm",
    "bodies.b.material=dragon_skin_20",
    "bodies.b.fixed=[left]",
    "contact.penalty_stiffness=10 kN/m",
    "environment.gravity_profile={kind: ramp, duration: 1 ms}",
    "environment.walls.second={kind: plane, point: [0 mm, -5 mm]}",
    "loads.pull.nodes=b.left",
    "loads.air.facets=[b.bottom]",
    "solver.bulk_viscosity=0.1",
]


@pytest.mark.parametrize("override", OF_A_SCENARIO)
def test_what_each_scenario_has_for_itself(build, override):
    assert build(SCENE).can_share(build(SCENE, override))


@pytest.mark.parametrize("override", OF_THE_STRUCTURE)
def test_what_all_have_in_common(build, override):
    assert not build(SCENE).can_share(build(SCENE, override))


def test_a_static_model_is_alone(build):
    static = build(SCENE, "time.procedure=static")
    assert not static.can_share(static)


class Part:
    """An object whose numbers a kernel reads."""

    def __init__(self, **numbers):
        vars(self).update(numbers)


Part.__module__ = "softsim.part"


@pytest.mark.parametrize(
    ("changed", "serves"),
    [
        ({}, True),
        ({"stiffness": 2.0}, False),
        ({"relaxes": False}, False),
        ({"parts": [Part(count=1), Part(count=3)]}, False),
        ({"parts": [Part(count=1)]}, False),
    ],
)
def test_kernels_serve_objects_of_the_same_numbers(changed, serves):
    def of(**further):
        numbers = {"stiffness": 1.0, "relaxes": True, "parts": [Part(count=1), Part(count=2)]}
        return Part(**(numbers | further))

    assert shares_kernels(of(), of(**changed)) is serves
