"""Plan of a reach computation: paths of a layout, their loads on a robot, the trials they need."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from softsim.builder import build_model
from softsim.builder.assembly import gravity_in_space
from softsim.builder.pipe_path import key_of_item
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.pipe_path import Segment
from softsim.errors import SceneError
from softsim.reach.answer import PathLoad, diameter, load_of, needed
from softsim.reach.tension import TetherProperties, Way, ways
from softsim.reach.trials import DIAMETERS, Puller, TrialPipe, trial_scene
from softsim.scene.loading import LoadedScene
from softsim.scene.walls import PipePathWall


@dataclass(frozen=True, eq=False)
class Plan:
    """Paths of a layout, with their loads on the robot, and the scenes of the trials.

    weight [N/m]: of the tether. loads: of each path for the least and the most friction of the
    tether. scenes: of the trials, by pipe.
    """

    loaded: LoadedScene
    puller: Puller
    weight: float
    ways: tuple[Way, ...]
    loads: tuple[tuple[PathLoad, PathLoad], ...]
    scenes: Mapping[TrialPipe, LoadedScene]

    @property
    def friction(self) -> tuple[float, float]:
        """Least and largest friction coefficient of the tether [-]."""
        return trailed_friction(self.loaded)


def plan_for(loaded: LoadedScene, robot: str, overrides: Sequence[str]) -> Plan:
    """Return the plan for a layout with a standard robot in it, after overrides of both.

    Raises
    ------
    SceneError, MeshError
        The layout has no end, the robot does not fit or pulls no tether, there is no gravity, or no
        pressure cycle is known for a pipe of that diameter.
    """
    puller = Puller.of(loaded)
    gravity = gravity_in_space(loaded.scene.environment)
    strength = float(np.linalg.norm(gravity))
    if strength == 0.0:
        raise loaded.error(
            ("environment", "gravity"),
            "without gravity a tether has neither weight nor friction: the reach is unlimited",
            "leave environment.gravity out; its default is 9.81 m/s^2",
        )
    model = build_model(loaded)
    assert model.passage is not None  # the question asks for it
    network = model.passage.network
    assert loaded.scene.trailed is not None
    weight = loaded.scene.trailed.mass_per_length * strength
    tethers = [TetherProperties(weight, friction) for friction in trailed_friction(loaded)]
    found = tuple(ways(network))
    refuse_unknown_diameters(loaded, network, found)
    loads = [tuple(load_of(way, tether, gravity / strength) for tether in tethers) for way in found]
    pipes = set[TrialPipe]().union(*map(needed, found, loads))
    scenes = {
        pipe: trial_scene(loaded.path, robot, list(overrides), puller, pipe, strength)
        for pipe in sorted(pipes, key=lambda one: (one.diameter, one.heading.value))
    }
    both = tuple((least, most) for least, most in loads)
    return Plan(loaded, puller, weight, found, both, scenes)


def trailed_friction(loaded: LoadedScene) -> tuple[float, float]:
    """Return the least and largest friction coefficient of the tether [-]."""
    assert loaded.scene.trailed is not None  # the question has it
    return loaded.scene.trailed.friction_coefficient


def refuse_unknown_diameters(
    loaded: LoadedScene, network: PipeNetwork, found: Sequence[Way]
) -> None:
    """Raise SceneError for a diameter outside the range with known pressure cycles."""
    for way in found:
        for segment, _ in way.parts:
            for radius in segment.radii:
                wide = diameter(radius)
                if not DIAMETERS[0] - 1e-9 <= wide <= DIAMETERS[-1] + 1e-9:
                    raise wrong_diameter(loaded, network, segment, wide)


def wrong_diameter(
    loaded: LoadedScene, network: PipeNetwork, segment: Segment, wide: float
) -> SceneError:
    """Return the error of a segment with a diameter `wide` [m] without a known pressure cycle."""
    keys = ("environment", "walls", str(network.name))
    wall = loaded.scene.environment.walls[str(network.name)]
    assert isinstance(wall, PipePathWall)
    at = key_of_item(wall, segment.item) if wide != diameter(0.5 * wall.diameter) else ("diameter",)
    least, most = 1e3 * DIAMETERS[0], 1e3 * DIAMETERS[-1]
    return loaded.error(
        (*keys, *at),
        f"no optimal pressure cycle is known for a pipe of {1e3 * wide:g} mm",
        f"Table 6.2 of the thesis covers {least:g} to {most:g} mm",
    )
