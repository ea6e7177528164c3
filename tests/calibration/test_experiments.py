"""The scenes of a calibration, from the scenes that are shipped."""

from pathlib import Path

import numpy as np
import pytest

from softsim.apps.calibration.experiments import (
    PUSH_DISTANCE,
    inflation,
    push,
    reference_specimen,
    section_specimen,
)
from softsim.builder import build_model
from softsim.loads.prescribed import PrescribedMotion
from softsim.loads.rotor import Rotor
from softsim.scene.loading import load_scene

SCENES = Path(__file__).parents[2] / "scenes"
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
