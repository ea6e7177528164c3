"""Energies of the whole model, summed at once or in parts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from softsim.builder import build_model
from softsim.compute import backend
from softsim.scene.loading import load_scene
from softsim.solver.energy import EnergyReader
from softsim.solver.explicit import ExplicitSolver
from softsim.solver.stable_step import first_time_increment

SCENES = Path(__file__).parents[2] / "scenes"
# Between them much that stores, dissipates or works: hourglass modes, a tether, a motor, mass
# scaling, self-contact, a cable through eyelets, layers, chambers, a moved wall.
FEW = ["pfr_36mm"]
MANY = ["pfr_36mm_3d", "bellows", "tendon_finger", "leafbot3", "gripper", "spike_patch"]


@pytest.mark.parametrize(
    "name", [*FEW, *(pytest.param(name, marks=pytest.mark.slow) for name in MANY)]
)
def test_parts_of_a_sum_make_the_whole(restart, monkeypatch, name):
    """As the threads of a card sum them."""
    model = build_model(load_scene(SCENES / f"{name}.yaml"))

    def after(parts):
        restart()
        monkeypatch.setattr(backend, "_device", replace(backend.device(), parts=parts))
        solver = ExplicitSolver([model])
        solver.begin(first_time_increment(model))
        solver.advance(300)
        reader = EnergyReader(solver)
        reader.update()
        return reader

    whole, in_parts = after(1), after(5)
    size = np.abs(whole.readings).max()
    assert size > 0.0
    np.testing.assert_allclose(in_parts.readings, whole.readings, rtol=1e-9, atol=1e-12 * size)
    assert np.abs(in_parts.in_parts[0, 1:]).max() > 0.0
