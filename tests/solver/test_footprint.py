"""Memory of the fields: the count from the model against the fields that are really there."""

from dataclasses import dataclass

import numpy as np
import pytest

from softsim.errors import DeviceError
from softsim.machine import Memory
from softsim.solver.footprint import BESIDE, footprint, refuse_too_large, scenarios_that_fit

SECTION = """
bodies:
  skin: {mesh: {generator: pfr_section, element_size: 0.5 mm}, formulation: plane_strain,
         thickness: 7 mm, material: dragon_skin_10}
rigid_bodies:
  frame: {mass: 8.8 g, inertia: 1 kg*mm^2, tied: [skin.knots],
          outline: {length: 33 mm, height: 15 mm},
          supports: [skin.chamber_top, skin.chamber_bottom]}
environment: {walls: {pipe: {kind: pipe, diameter: 36 mm}}}
loads:
  air: {kind: follower_pressure, facets: [skin.chamber_top, skin.chamber_bottom],
        reacts_on: frame, profile: {kind: constant, value: 1 kPa}}
time: {end: 1 s}
"""
RINGS = SECTION.replace("plane_strain,", "ring_section, sector: 90 deg, rings: skin,")
SPIKES = SECTION.replace("time:", "contact: {self_contact: [skin]}\ntime:")
RING = """
bodies:
  ring: {mesh: {generator: pfr_meridian, element_size: 0.2 mm}, formulation: axisymmetric,
         material: ecoflex_00_30, fixed: [ends]}
time: {end: 1 s}
"""
SOLID = """
bodies:
  skin: {mesh: {generator: pfr_solid, rows: 0, element_size: 1 mm}, formulation: solid,
         material: dragon_skin_10, fixed: [knots]}
environment: {walls: {pipe: {kind: pipe, diameter: 36 mm}}}
time: {end: 1 s}
"""
GROUND = SECTION.replace(
    "{kind: pipe, diameter: 36 mm}",
    "{kind: polyline, points: [[-40 mm, -20 mm], [40 mm, -18 mm]], spacing: 0.5 mm}",
)


@pytest.mark.parametrize(
    "text",
    [SECTION, SPIKES, RINGS, RING, SOLID, GROUND],
    ids=["plane", "spikes that touch", "rings", "revolved", "space", "ground"],
)
def test_the_count_is_that_of_the_fields(build, cpu, text):
    """Within a tenth, shared and own part alike: those of one scenario and of three."""
    from softsim.solver.explicit import ExplicitSolver

    model = build(text)
    one, three = (bytes_of_fields(ExplicitSolver([model] * n).terms) for n in (1, 3))
    each = (three - one) / 2
    size = footprint(model)
    assert size.each == pytest.approx(each, rel=0.1)
    assert size.shared == pytest.approx(one - each, rel=0.1)


def bytes_of_fields(thing) -> int:
    """Bytes of all Taichi fields that can be reached from an object of softsim's."""
    import taichi as ti

    seen, waiting, total = set(), [thing], 0
    while waiting:
        one = waiting.pop()
        if id(one) in seen:
            continue
        seen.add(id(one))
        if isinstance(one, ti.Field):
            numbers = int(np.prod(one.shape)) * getattr(one, "n", 1) * getattr(one, "m", 1)
            total += numbers * {ti.i32: 4, ti.f64: 8}[one.dtype]
        elif isinstance(one, list | tuple):
            waiting += one
        elif isinstance(one, dict):
            waiting += one.values()
        elif type(one).__module__.startswith("softsim") and hasattr(one, "__dict__"):
            waiting += vars(one).values()
    return total


@dataclass(frozen=True)
class Card:
    """A graphics card with a given free memory."""

    free: int
    name: str = "card"

    @property
    def memory(self) -> Memory:
        return Memory(self.free, 2 * self.free)


def test_what_fits_is_let_through_and_one_byte_less_is_not(build):
    model = build(SECTION)
    need = int(footprint(model).of(1) + BESIDE["cuda"][0])
    refuse_too_large(model, "cuda", Card(need))
    with pytest.raises(DeviceError, match="are free on card"):
        refuse_too_large(model, "cuda", Card(need - 1))


def test_as_many_scenarios_fit_as_there_is_memory_for(build):
    model = build(SECTION)
    need = int(footprint(model).of(10) + BESIDE["cuda"][0])
    assert scenarios_that_fit(model, "cuda", Card(need)) == 10
    assert scenarios_that_fit(model, "cuda", Card(need - 1)) == 9
    assert scenarios_that_fit(model, "cuda", None) is None


def test_the_elements_named_as_fitting(build):
    """In half of the memory that grows with its elements, half of them are said to fit."""
    model = build(SECTION)
    fixed, an_element = BESIDE["cpu"]
    growing = footprint(model).of(1) + an_element * model.element_count
    card = Card(int(0.5 * growing + fixed))
    with pytest.raises(DeviceError) as caught:
        refuse_too_large(model, "cpu", card)
    # Rounded down, of a count whose half is a whole number or not.
    half = model.element_count // 2
    assert any(f"at most {n:,} elements" in caught.value.hint for n in (half - 1, half))
    assert "--device cpu" not in caught.value.hint
    with pytest.raises(DeviceError, match="or --device cpu"):
        refuse_too_large(model, "cuda", card)


def test_a_device_that_does_not_tell_refuses_nothing(build):
    refuse_too_large(build(SECTION), "cuda", None)
