"""Trials on the workers, one after the other for each pipe, and the files in their folder.

reach.json          result, and all trials
reach.png           figure of the result
PIPE.yaml           scene of the trials in a pipe, for softsim run
cases/KEY/          output of the run of a trial, reduced
"""

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from softsim.analysis.travel import LEAST_PROGRESS
from softsim.apps.reach.distance import (
    Distance,
    PathLoad,
    TetherProperties,
    Way,
    diameter,
    distance,
    load_of,
    needed,
    pulls_along,
    straight_distance,
    ways,
)
from softsim.apps.reach.report import ANSWER
from softsim.apps.reach.trials import (
    DIAMETERS,
    Bracket,
    Puller,
    TrialPipe,
    bracket,
    drag_override,
    next_drag,
    progress,
    trial_scene,
    trials_left,
)
from softsim.builder import build_model
from softsim.builder.assembly import gravity_in_space
from softsim.builder.walls import key_of_item
from softsim.contact.pipe_network import PipeNetwork
from softsim.contact.pipe_path import Segment
from softsim.errors import SceneError, StabilityError
from softsim.output.folder import CASES, HISTORY, RunFolder, claimed
from softsim.output.history import read_history
from softsim.scene.loading import LoadedScene
from softsim.scene.walls import PipePathWall
from softsim.study.cases import DONE, FAILED, LOST, Case, Source, case_key, load_source
from softsim.sweep.engine import WorkerPool, completed
from softsim.sweep.job import Job, Outcome, Simulate, known_outcome, simulate

# -------------------------------------------------------------------------------------------------
# Plan of a reach computation: paths of a layout, their loads on a robot, the trials they need.


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


# -------------------------------------------------------------------------------------------------
# Search for the pulling force in each pipe, one trial after the other.

RETRIED = (FAILED, LOST)  # without them there is no answer


@dataclass(frozen=True)
class DragTrial:
    """Trial with a drag [N] on the robot: displacement in a pressure cycle [m], mean speed [m/s].

    The robot advanced if the displacement is larger than the recoil of its spikes explains. key,
    wall_time [s]: of its run.
    """

    drag: float
    progress: float
    speed: float
    key: str
    wall_time: float

    @property
    def got_on(self) -> bool:
        """True if the robot advanced."""
        return self.progress > LEAST_PROGRESS


@dataclass
class Search:
    """Search for the pulling force of the robot in a pipe.

    file: scene of the trials. cases: folder of their runs. ratio: required ratio of the bracket.
    trials: those done so far.
    """

    pipe: TrialPipe
    file: Path
    cases: Path
    puller: Puller
    ratio: float
    trials: list[DragTrial] = field(default_factory=list)

    @property
    def seen(self) -> dict[float, bool]:
        """Mapping from each drag to True if the robot advanced with it."""
        return {trial.drag: trial.got_on for trial in self.trials}

    @property
    def bracket(self) -> Bracket:
        """Bracket of the pulling force from the trials so far."""
        return bracket(self.seen)

    @property
    def left(self) -> int:
        """Largest number of trials that are left."""
        return trials_left(self.seen, self.ratio)

    def next_job(self, device: str) -> Job | None:
        """Return the job of the next trial, or None at the end."""
        drag = next_drag(self.seen, self.ratio)
        if drag is None:
            return None
        override = drag_override(self.puller, self.pipe, drag)
        case = Case(len(self.trials) + 1, Source(self.file), (override,), {"drag": drag})
        key = case_key(load_source(case.source, case.overrides))
        return Job(case, key, self.cases / key, device)

    def note(self, job: Job, outcome: Outcome) -> DragTrial:
        """Record and return the result of a trial. Raises StabilityError if its run has failed."""
        drag = float(job.case.values["drag"])
        if outcome.status != DONE:
            raise StabilityError(
                f"the trial in {self.pipe.name} with {1e3 * drag:.3g} mN has failed: "
                f"{outcome.reason}",
                hint=f"its run folder: {job.folder}",
            )
        way, time = progress(read_history(job.folder / HISTORY))
        self.trials.append(DragTrial(drag, way, way / time, job.key, outcome.wall_time))
        return self.trials[-1]

    def take_stored(self, device: str) -> None:
        """Record the trials that are stored in the folder."""
        while (job := self.next_job(device)) is not None:
            known = known_outcome(job, RETRIED)
            if known is None:
                return
            self.note(job, known)


def searches(
    scenes: Mapping[TrialPipe, LoadedScene], puller: Puller, written: Path, folder: Path,
    ratio: float, device: str,
) -> list[Search]:  # fmt: skip
    """Return a search for each pipe, with the trials that the folder already has.

    The scenes are written into the folder `written`. Raises the errors of `seek`.
    """
    home, found = RunFolder(written.resolve()), []
    for pipe, loaded in scenes.items():
        name = f"{pipe.name}.yaml"
        home.write_text_atomic(name, loaded.resolved())
        cases = folder.resolve() / CASES
        found.append(Search(pipe, home.path / name, cases, puller, ratio))
        found[-1].take_stored(device)
    return found


def seek(
    asked: Sequence[Search], folder: Path, pool: AbstractContextManager[WorkerPool], device: str,
    console: Console, simulate: Simulate = simulate,
) -> None:  # fmt: skip
    """Run trials until all pulling forces are known; stored trials are not run again.

    Raises StabilityError if the run of a trial has failed, Interrupted after SIGINT or SIGTERM (the
    same call continues the search), and OutputError if another process uses the folder or a file
    cannot be written.
    """
    if not any(search.left for search in asked):
        return
    RunFolder(folder / CASES)  # is made here, or refused
    with claimed(folder), pool as workers:
        while jobs := {job.key: (search, job) for search in asked
                       if (job := search.next_job(device)) is not None}:  # fmt: skip
            for job, outcome in completed(
                [job for _, job in jobs.values()], workers, RETRIED, simulate=simulate
            ):
                search = jobs[job.key][0]
                trial = search.note(job, outcome)
                left = sum(each.left for each in asked)
                console.print(
                    progress_line(search.pipe, trial, left), highlight=False, soft_wrap=True
                )


def progress_line(pipe: TrialPipe, trial: DragTrial, left: int) -> str:
    """Return a trial as a line of text."""
    got_on = "advances" if trial.got_on else "does not advance"
    return (
        f"{pipe.name}, {1e3 * trial.drag:.3g} mN: {got_on}, {1e3 * trial.progress:+.1f} mm per "
        f"cycle, {1e3 * trial.speed:+.1f} mm/s; at most {left} trials left"
    )


# -------------------------------------------------------------------------------------------------
# Output file reach.json: pulling forces with their trials, distances, and curves along paths.

ASSUMED = (
    "a drag that stops the robot also stops it when larger",
    "between level and vertical pipes the pulling force varies linearly; the additional effort "
    "in bends is neglected",
    "nothing holds the tether back at the entrance of the layout",
    "the tether has no bending stiffness and does not stretch; in level pipes it does not pull a "
    "robot back",
)


def write_answer(plan: Plan, robot: str, asked: list[Search], folder: Path) -> list[Distance]:
    """Write reach.json, and return the distance of the robot on the path to each exit.

    Raises OutputError if the file cannot be written.
    """
    brackets = {search.pipe: search.bracket for search in asked}
    distances = [
        distance(way, loads, brackets) for way, loads in zip(plan.ways, plan.loads, strict=True)
    ]
    content = {
        "layout": plan.loaded.path,
        "robot": robot,
        "tether": {"weight": plan.weight, "friction_coefficient": plan.friction},
        "pulls": [pull_content(plan, search) for search in asked],
        "exits": [
            way_content(way, loads, brackets, found)
            for way, loads, found in zip(plan.ways, plan.loads, distances, strict=True)
        ],
        "assumptions": ASSUMED,
    }
    RunFolder(folder).write_json_atomic(ANSWER, content)
    return distances


def pull_content(plan: Plan, search: Search) -> dict[str, Any]:
    """Return the content of reach.json for the trials in a pipe."""
    found = search.bracket
    return {
        "pipe": search.pipe.name,
        "diameter": search.pipe.diameter,
        "heading": search.pipe.heading.value,
        "low": found.low,
        "high": found.high,
        "straight_distance": straight_distance(search.pipe, found, plan.weight, plan.friction),
        "trials": [
            {
                "drag": trial.drag,
                "got_on": trial.got_on,
                "progress": trial.progress,
                "speed": trial.speed,
                "wall_time": trial.wall_time,
                "key": trial.key,
            }
            for trial in search.trials
        ],
    }


def way_content(
    way: Way, loads: tuple[PathLoad, PathLoad], brackets: dict[TrialPipe, Bracket], found: Distance
) -> dict[str, Any]:
    """Return the content of reach.json for the path to an exit.

    There are two curves each of tension and pulling force, the lower one first.
    """
    ends = ({p: b.low for p, b in brackets.items()}, {p: b.high for p, b in brackets.items()})
    return {
        "exit": way.exit,
        "length": way.length,
        "least": found.least,
        "most": found.most,
        "sentence": found.sentence,
        "arc_length": loads[0].tension.arc_length,
        "tension": [load.tension.drawing for load in loads],
        "pull": [
            pulls_along(way, load, pulls)
            for load, pulls in zip(reversed(loads), ends, strict=True)
        ],
    }  # fmt: skip
