"""The scenes of a calibration, from the scenes that are shipped."""

from pathlib import Path

import numpy as np
import pytest

from softsim.apps.calibration.experiments import (
    PUSH_DISTANCE,
    Move,
    inflation,
    push,
    reference_specimen,
    section_specimen,
    stiffness,
)
from softsim.builder import build_model
from softsim.loads.nodal import Rotor
from softsim.loads.prescribed import PrescribedMotion
from softsim.scene.loading import load_scene

SCENES = Path(__file__).parents[3] / "scenes"
COARSE = "bodies.skin.mesh.element_size=1 mm"


@pytest.fixture(scope="module")
def section():
    return section_specimen(load_scene(SCENES / "pfr_36mm.yaml", [COARSE]))


@pytest.fixture(scope="module")
def solid():
    return reference_specimen(load_scene(SCENES / "pfr_36mm_3d.yaml", [COARSE]))


def test_the_names_are_found(section, solid):
    for specimen in (section, solid):
        assert (specimen.pressure, specimen.body, specimen.frame) == ("air", "skin", "frame")
        assert specimen.diameter == pytest.approx(36e-3)
    assert (section.axes, solid.axes) == ("xy", "xyz")


def test_nothing_acts_but_the_air_and_all_of_it(section):
    """Motor and gravity are gone, the factor of the scene too; friction stays."""
    before = build_model(section.loaded)
    model = build_model(inflation(section, 10e3, 0.2))
    assert before.of_kind(Rotor) and not model.of_kind(Rotor)
    assert not model.gravity.any()
    profile = model.pressures[0].source.facet_profile
    assert profile.at(0.2) == pytest.approx(10e3, rel=1e-12)
    assert profile.at(0.1) == pytest.approx(5e3, rel=1e-12)  # smooth: u^2 (3 - 2u) at u = 1/2
    assert model.contact.friction_coefficient == before.contact.friction_coefficient
    assert model.end_time == 0.2


@pytest.mark.parametrize("which", ["section", "solid"])
def test_the_frame_is_held_by_the_nodes_tied_to_it(which, request):
    specimen = request.getfixturevalue(which)
    before = build_model(specimen.loaded)
    model = build_model(inflation(specimen, 10e3, 0.2))
    knots = np.unique(before.rigid_bodies[0].tied[before.mass[before.rigid_bodies[0].tied] > 0.0])
    assert not any(model.rigid_bodies[0].free)
    for axis in range(len(specimen.axes)):
        held = [m for m in model.of_kind(PrescribedMotion) if m.axis == axis]
        assert np.array_equal(np.unique(np.concatenate([m.nodes for m in held])), knots)
        assert all((m.profile.values == 0.0).all() for m in held)


def test_a_push_moves_it_across_and_then_along_the_pipe(section):
    experiment = push(section, 5e3, 0.2)
    model = build_model(experiment.scene)
    assert [move.axis for move in experiment.moves] == ["y", "x"]
    for move in experiment.moves:
        (moved,) = [m for m in model.of_kind(PrescribedMotion) if "xyz"[m.axis] == move.axis]
        assert moved.profile.at(move.begin) == 0.0
        assert moved.profile.at(move.end) == pytest.approx(PUSH_DISTANCE)
        assert moved.profile.at(move.until) == pytest.approx(PUSH_DISTANCE)
        assert move.begin - move.rest > 0.2 and move.end < move.until - move.rest
    assert experiment.moves[0].until <= experiment.moves[1].begin
    assert model.end_time == pytest.approx(experiment.moves[1].until)


# -------------------------------------------------------------------------------------------------
# Stiffness from the force after a move.

MOVE = Move("y", 1e-4, begin=1.0, end=1.1, until=1.5, rest=0.1)


def history(stiffness_value, swing=0.0):
    """A spring that already pushes with 2 N, then gives way to the move; it may swing after it."""
    time = np.linspace(0.0, 2.0, 2001)
    course = np.interp(time, [MOVE.begin, MOVE.end], [0.0, MOVE.distance])
    force = 2.0 - stiffness_value * course
    force[time > MOVE.end] += swing * np.sin(2.0 * np.pi * time[time > MOVE.end] / 0.05)
    return {"time": time, "wall_force_y": force}


def test_the_force_that_was_there_before_does_not_count():
    found = stiffness(history(300.0), MOVE)
    assert found.value == pytest.approx(300.0, rel=1e-9)
    assert found.unrest < 1e-9


def test_what_still_swings_is_told():
    found = stiffness(history(300.0, swing=0.003), MOVE)
    # Two whole periods of the swing lie in the rest, whose samples miss its mean by 1/100 of it.
    assert found.value == pytest.approx(300.0, rel=0.1 * 0.01)
    assert found.unrest == pytest.approx(0.1, rel=0.01)


def test_a_frame_that_nothing_holds_has_no_stiffness():
    found = stiffness(history(0.0), MOVE)
    assert found.value == 0.0
    assert found.unrest == np.inf
