"""Memory of the fields: the dry count against the fields that are really there."""

from dataclasses import dataclass

import numpy as np
import pytest

from softsim.compute.machine import Memory
from softsim.errors import DeviceError
from softsim.solver.explicit import BASE_MEMORY, field_bytes, refuse_too_large, scenarios_that_fit

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
    "{kind: polyline, points: [[-40 mm, -20 mm], [40 mm, -18 mm]]}",
)


@pytest.mark.parametrize(
    "text",
    [SECTION, SPIKES, RINGS, RING, SOLID, GROUND],
    ids=["plane", "spikes that touch", "rings", "revolved", "space", "ground"],
)
def test_the_count_is_that_of_the_fields(build, fresh_taichi, text):
    """To the byte, of one scenario and of three."""
    from softsim.solver.explicit import ExplicitSolver

    model = build(text)
    for n in (1, 3):
        assert field_bytes(model, n) == bytes_of_fields(ExplicitSolver([model] * n).terms)


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
    model, size = build(SECTION), 10_000_000
    need = int(size + BASE_MEMORY["cuda"][0])
    refuse_too_large(model, size, "cuda", Card(need))
    with pytest.raises(DeviceError, match="are free on card"):
        refuse_too_large(model, size, "cuda", Card(need - 1))


def test_as_many_scenarios_fit_as_there_is_memory_for(build, fresh_taichi):
    model = build(SECTION)
    need = int(field_bytes(model, 10) + BASE_MEMORY["cuda"][0])
    assert scenarios_that_fit(model, "cuda", Card(need)) == 10
    assert scenarios_that_fit(model, "cuda", Card(need - 1)) == 9
    assert scenarios_that_fit(model, "cuda", None) is None


def test_the_elements_named_as_fitting(build):
    """In half of the memory that grows with its elements, half of them are said to fit."""
    model, size = build(SECTION), 10_000_000
    fixed, an_element = BASE_MEMORY["cpu"]
    card = Card(int(0.5 * (size + an_element * model.element_count) + fixed))
    with pytest.raises(DeviceError) as caught:
        refuse_too_large(model, size, "cpu", card)
    # Rounded down, of a count whose half is a whole number or not.
    half = model.element_count // 2
    assert any(f"at most {n:,} elements" in caught.value.hint for n in (half - 1, half))
    assert "--device cpu" not in caught.value.hint
    with pytest.raises(DeviceError, match="or --device cpu"):
        refuse_too_large(model, size, "cuda", card)


def test_a_device_that_does_not_tell_refuses_nothing(build):
    refuse_too_large(build(SECTION), 10**18, "cuda", None)


def test_a_solver_that_does_not_fit_is_refused_before_it_takes_memory(
    build, fresh_taichi, monkeypatch
):
    from softsim.solver import explicit

    model = build(SECTION)
    monkeypatch.setattr(explicit, "memory_of", lambda device: Card(100))
    with pytest.raises(DeviceError, match="are free on card"):
        explicit.ExplicitSolver([model])


def test_what_cannot_fit_leaves_an_earlier_run_alone(fresh_taichi, tmp_path, monkeypatch):
    from softsim.run import run
    from softsim.solver import explicit as memory

    (tmp_path / "large.yaml").write_text(SECTION)
    earlier = tmp_path / "large" / "summary.json"
    earlier.parent.mkdir()
    earlier.write_text("of an earlier run")
    monkeypatch.setattr(memory, "memory_of", lambda device: Card(100))
    with pytest.raises(DeviceError, match="are free on card"):
        run(tmp_path / "large.yaml", out=earlier.parent)
    assert earlier.read_text() == "of an earlier run"
