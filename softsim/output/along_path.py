"""Position of a body along its pipe, its clearance, and the wall forces that push or brake it."""

import numpy as np

from softsim.contact.path_features import narrowings
from softsim.contact.pipe_drawing import stations
from softsim.contact.pipe_network import PipeNetwork
from softsim.model import Passage
from softsim.solver.explicit import Scenario

# A node this near [m] to a place where the pipe narrows touches what narrows it: the thickness of a
# spike.
REACH = 2e-3

COLUMNS = {
    "arc_length": "m",  # of the body's centre along the path
    "branch": "-",  # in which that is, counted from 0, the pipe of the start
    "clearance": "m",  # smallest gap of its outline to the pipe at this moment
    # Forces of walls, means of the interval; on its outline:
    "frame_wall_force": "N",  # magnitudes summed
    "frame_pinch": "N",  # half of what of that cancels out: a force that clamps it from two sides
    "frame_drag": "N",  # against the way along the path
    # on the whole robot:
    "thrust": "N",  # what pushes it along the path
    "drag": "N",  # what pushes it back
    "narrowing_drag": "N",  # the part of the drag that acts where the pipe narrows
}
"""Additional columns in the history of a layout, name -> unit."""


def path_readings(
    scenario: Scenario, passage: Passage, centre: np.ndarray, interval: float
) -> dict[str, float]:
    """Return the current values of COLUMNS.

    centre: of the body (d,) [m]. interval: time since the impulses were cleared [s].
    """
    x = scenario.positions()
    branch, s = passage.network.locate(centre[None])
    row = {
        "arc_length": float(s[0]),
        "branch": float(branch[0]),
        "clearance": float(passage.network.gap(x[passage.outline]).min()),
    }
    nodes, forces = wall_forces(scenario, interval)
    of_frame = np.isin(nodes, passage.outline)
    return row | frame_forces(forces[of_frame]) | forces_along(
        passage.network, x[nodes], forces, of_frame
    )  # fmt: skip


def path_samples(network: PipeNetwork) -> dict[str, np.ndarray]:
    """Return samples of the pipes for figures: `path` and `path_branch`.

    path (n, 2 d + 2): arc length, point, tangent and radius at each sampled arc length.
    path_branch (n,): number of the branch of each row.
    """
    samples = [np.column_stack(stations(b.path.segments)) for b in network.branches]
    branches = np.repeat(np.arange(len(samples)), [len(one) for one in samples])
    return {"path": np.concatenate(samples), "path_branch": branches}


def wall_forces(scenario: Scenario, interval: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (k,) that touched walls since the impulses were cleared, and the mean
    forces (k, d) [N] of all walls on them.
    """
    model = scenario.model
    impulses = np.zeros((len(model.contact.nodes), model.dimension))
    for walls in scenario.terms.wall_contacts:
        impulses += scenario.read(walls.impulse)
    touched = impulses.any(axis=1) if interval > 0.0 else np.zeros(len(impulses), dtype=bool)
    return model.contact.nodes[touched], impulses[touched] / (interval or 1.0)


def frame_forces(forces: np.ndarray) -> dict[str, float]:
    """Return the sum of the magnitudes of forces (k, d) [N], and their clamping force.

    The clamping force is half of the part that cancels out in the vector sum: N for two
    opposite forces N, 0 for parallel forces.
    """
    whole = float(np.linalg.norm(forces, axis=1).sum())
    rest = float(np.linalg.norm(forces.sum(axis=0)))
    return {"frame_wall_force": whole, "frame_pinch": 0.5 * (whole - rest)}


def forces_along(
    network: PipeNetwork, places: np.ndarray, forces: np.ndarray, of_frame: np.ndarray
) -> dict[str, float]:
    """Return the sums of the force components along the path and against it [N].

    forces (k, d) [N] act at places (k, d) [m]. of_frame (k,): True for forces on the outline.
    """
    branch, s = network.locate(places)
    along = (forces * network.tangents(branch, s)).sum(axis=1)
    drag = np.maximum(-along, 0.0)
    near = np.zeros(len(s), dtype=bool)
    for number, one in enumerate(network.branches):
        low, high = narrowings(one.path).T
        within = ((s[:, None] >= low - REACH) & (s[:, None] <= high + REACH)).any(axis=1)
        near |= within & (branch == number)
    return {
        "frame_drag": float(drag[of_frame].sum()),
        "thrust": float(np.maximum(along, 0.0).sum()),
        "drag": float(drag.sum()),
        "narrowing_drag": float(drag[near].sum()),
    }
