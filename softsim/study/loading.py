"""A study, read from a file or from Python values and checked: its columns, and its cases."""

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from pydantic import ValidationError

from softsim.errors import Option, SceneError
from softsim.scene.loading import LoadedScene
from softsim.scene.loads import EccentricMass
from softsim.scene.reporting import scene_error
from softsim.scene.text import Scalar, Tree, entries, nearest, plain, read_file
from softsim.scene.walls import PipePathWall
from softsim.study.bisection import Bisection, bisection_of, boundary, cells, runs_left
from softsim.study.cases import Case, Value, forget_files, resolved
from softsim.study.design import (
    Composition,
    Perturbation,
    checked_scenes,
    composed,
    perturbations,
    point_count,
    points,
    refuse_misfit,
)
from softsim.study.factors import Interval, Space
from softsim.study.measures import MeasureColumn, goal_of, measure_column
from softsim.study.schema import (
    BisectionDesign,
    Goal,
    GridDesign,
    Plot,
    PointDesign,
    StudyAxis,
    StudySpec,
    chosen_plots,
    given_plots,
)
from softsim.units import count_text

REPEAT = "repeat"
"""Column of the repeats."""


@dataclass(frozen=True)
class Round:
    """Cases that are run together. left: their number, plus the most that may follow."""

    cases: list[Case]
    left: int


@dataclass(frozen=True)
class LoadedStudy:
    """Valid study.

    path, tree: its file and the content. design: None for a bisection, or if only an optimisation
    is described. goal: None without an optimisation.
    """

    study: StudySpec
    path: Path
    tree: Tree
    composition: Composition
    design: PointDesign | None
    bisection: Bisection | None
    perturbed: tuple[Perturbation, ...]
    measures: tuple[MeasureColumn, ...]
    plots: tuple[Plot, ...]
    goal: Goal | None

    @property
    def title(self) -> str:
        """Title of the study."""
        return self.study.title or self.path.stem.replace("_", " ")

    @property
    def factors(self) -> tuple[StudyAxis, ...]:
        """Columns of the factors."""
        return tuple(factor.axis for factor in self.composition.factors)

    @property
    def repeats(self) -> int:
        """Number of repeats of each case."""
        return self.study.repeat_count

    @property
    def search_space(self) -> dict[str, Space]:
        """Factor -> its interval or values, in the unit of its column."""
        return {factor.axis.name: factor.space for factor in self.composition.factors}

    @property
    def case_count(self) -> int:
        """Number of cases, for a bisection the largest possible one, without generating them.

        Raises SceneError if the study has no design.
        """
        if self.bisection is not None:
            return len(cells(self.bisection, self.composition.factors)) * self.bisection.most_runs
        return point_count(self._design(), self.composition.factors) * self.repeats

    def cases(self) -> list[Case]:
        """Return all cases, in the order of the table; repeats of a case follow each other.

        For a bisection they are the cases of its first round. Raises SceneError if the study has
        no design.
        """
        return next(self.rounds(lambda case: None)).cases

    def rounds(self, result: Callable[[Case], float | None]) -> Iterator[Round]:
        """Yield all cases at once; for a bisection, round by round until all boundaries are known.

        A round of a bisection has the cases at the next levels of all cells. Before the next round
        is requested, `result` must return the measure of each case of the previous one, None if its
        run has failed. Raises SceneError if there is no design.
        """
        if self.bisection is None:
            cases = self._all_cases()
            yield Round(cases, len(cases))
        else:
            yield from self._halvings(self.bisection, result)

    def _halvings(
        self, sought: Bisection, result: Callable[[Case], float | None]
    ) -> Iterator[Round]:
        places = cells(sought, self.composition.factors)
        known: list[dict[float, list[float | None]]] = [defaultdict(list) for _ in places]
        count = 0
        while True:
            asked: list[tuple[list[float | None], Case]] = []
            for values, answers in zip(places, known, strict=True):
                for level in boundary(sought, answers).asked:
                    at_level = {name: values.get(name, level) for name in self.search_space}
                    held = answers[level]
                    case = self.case(count + 1, at_level)
                    further = len(held), len(held) + sought.missing(held)
                    for one in islice(self._repeated(case), *further):
                        count += 1
                        asked.append((held, replace(one, number=count)))
            if not asked:
                return
            left = sum(runs_left(sought, answers) for answers in known)
            yield Round([case for _, case in asked], left)
            for held, case in asked:
                held.append(result(case))

    def _all_cases(self) -> list[Case]:
        found: list[Case] = []
        for point in points(self._design(), self.composition.factors, self.tree):
            values = dict(zip(self.search_space, point, strict=True))
            found += self._repeated(self.case(len(found) + 1, values))
        return found

    def case(self, number: int, values: Mapping[str, Value]) -> Case:
        """Return the case with these values of the factors, unperturbed."""
        overrides = (one.override for one in self.composition.settings(values))
        return Case(number, self.composition.source(values), tuple(overrides), dict(values))

    def _repeated(self, case: Case) -> Iterator[Case]:
        """Yield the case, or its repeats."""
        if not self.perturbed:
            yield case
            return
        try:
            loaded = resolved(case)
        except SceneError:  # each repeat fails alike, and says why in its row of the table
            loaded = None
        for repeat in range(1, self.repeats + 1):
            drawn = [one.setting(loaded, repeat) for one in self.perturbed] if loaded else []
            overrides = (*case.overrides, *(one.override for one in drawn))
            values = {**case.values, REPEAT: repeat}
            yield Case(case.number + repeat - 1, case.source, overrides, values)

    def _design(self) -> PointDesign:
        if self.design is None:
            place = nearest(self.tree, ("optimize",))[0].key_origin
            hint = "use softsim optimize, or give it a design: {kind: grid}"
            raise SceneError(
                "the study defines an optimization and no design to sweep", hint, place
            )
        return self.design


TAKEN = ("case", REPEAT, "verdict", "status", "reason", "warnings", "wall_time", "key")
"""Columns that every table has."""


def load_study(path: Path | str, overrides: Sequence[str] = ()) -> LoadedStudy:
    """Read a study file, and check it against the scenes that it names.

    overrides: "time.end=3 s" each, for all cases; they win over the study's `set`.

    Raises
    ------
    SceneError: anything that keeps it from being a study, at its place.
    """
    return loaded_study(read_file(Path(path), "study"), Path(path), overrides)


def study_from(content: Mapping[str, Any], folder: Path) -> LoadedStudy:
    """Return a study from Python values; scene files are relative to `folder`.

    content: the keys of a study file. Raises SceneError as load_study.
    """
    return loaded_study(tree_of(content), folder / "study", ())


def loaded_study(tree: Tree, path: Path, overrides: Sequence[str]) -> LoadedStudy:
    """Return the study in `tree`, of a file at `path`. Raises SceneError as load_study."""
    try:
        study = StudySpec.model_validate(plain(tree))
    except ValidationError as error:
        raise scene_error(error, tree, StudySpec) from None
    forget_files()
    refuse_taken_names(study, tree)
    composition = composed(study, tree, path.parent, overrides)
    perturbed = perturbations(study.repeats, entries(tree, "repeats", "perturb"))
    design = None if isinstance(study.design, BisectionDesign) else study.design
    if study.design is None and study.optimize is None:
        design = GridDesign(kind="grid")
    if design is not None:
        refuse_misfit(design, composition.factors, tree)
    scenes = checked_scenes(composition, perturbed)
    told = {
        name: measure
        for one in scenes
        for name, measure in composition.kind.produced(one.scene).items()
    }
    columns = {
        name: measure
        for one in scenes
        for name, measure in composition.kind.recorded(one.scene).items()
    }
    measures = tuple(
        measure_column(name, part, nearest(tree, ("measures", name))[0], told, columns)
        for name, part in study.measures.items()
    )
    bisection = None
    if isinstance(study.design, BisectionDesign):
        bisection = bisection_of(
            study.design, composition.factors, study.repeat_count, measures, told, tree
        )
    goal, further = goal_of(study.optimize, nearest(tree, ("optimize",))[0], measures, told)
    factors = [factor.axis for factor in composition.factors]
    plots: tuple[Plot, ...] = ()  # of a bisection the map of its boundaries says all
    if bisection is None:
        plots = chosen_plots(factors, measures, isinstance(design, GridDesign))
    measures += further
    if study.plots is not None:
        plots = given_plots(study.plots, tree, factors, measures)
    return LoadedStudy(
        study, path, tree, composition, design, bisection, perturbed, measures, plots, goal
    )


def refuse_taken_names(study: StudySpec, tree: Tree) -> None:
    """Raise SceneError at a factor or measure whose name is already taken by another column."""
    names = [("factors", name) for name in study.factors if name in TAKEN]
    names += [("measures", name) for name in study.measures if name in (*TAKEN, *study.factors)]
    for keys in names:
        message, place = f"a table already has a column {keys[1]}", nearest(tree, keys)[0]
        raise SceneError(message, "give it another name", place.key_origin)


def tree_of(value: Any, place: str = "study") -> Tree:
    """Return the tree of mappings, lists, texts and numbers, also of numpy.

    The origin of each value is the keys that lead to it, such as "factors.rate.values[0]". Raises
    SceneError for values of another type.
    """
    origin = Option(place)
    if isinstance(value, Mapping):
        above = "" if place == "study" else f"{place}."
        below = {str(key): tree_of(held, f"{above}{key}") for key, held in value.items()}
        return Tree(below, origin, origin)
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Sequence) and not isinstance(value, str):
        entries = [tree_of(held, f"{place}[{index}]") for index, held in enumerate(value)]
        return Tree(entries, origin, origin)
    scalar = _scalar(value, origin)
    return Tree(scalar, origin, origin, scalar if isinstance(scalar, str) else repr(scalar))


def _scalar(value: Any, origin: Option) -> Scalar:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Path):
        return str(value)
    if value is None or isinstance(value, str | int | float):
        return value
    hint = "only numbers, texts, lists and mappings can"
    raise SceneError(f"a {type(value).__name__} cannot be part of a study", hint, origin)


# -------------------------------------------------------------------------------------------------
# Description of a study in a few rows of text.

MOST_SHOWN = 6
"""Largest number of values of a factor that are all written; of more, only some are."""


def describe(study: LoadedStudy) -> list[tuple[str, str]]:
    """Return rows of text on the factors and settings of a study."""
    factors = study.composition.factors
    return [(f.axis.column, space_text(f.axis, f.space)) for f in factors] + settings(study)


def settings(study: LoadedStudy) -> list[tuple[str, str]]:
    """Return rows of text on shared settings, design, repeats, measures and goal of a study."""
    rows = []
    if study.study.scene is not None:
        rows.append(("scene", study.study.scene))
    if study.study.robot is not None:
        rows.append(("robot", study.study.robot))
    if study.study.set:
        written = yaml.safe_dump(study.study.set, default_flow_style=True, width=math.inf)
        rows.append(("in all cases", written.strip()[1:-1]))  # without the braces
    if study.bisection is not None:
        rows.append(("design", sought_text(study, study.bisection)))
    if study.design is not None:
        kind = study.design.kind.replace("_", " ")
        rows.append(("design", f"{kind}, {count_text(study.case_count, 'case')}"))
    if study.perturbed:
        perturbed = ", ".join(f"{one.path} by {one.written.text}" for one in study.perturbed)
        rows.append(("repeats", f"{study.repeats} of each case, perturbed: {perturbed}"))
    rows.append(("measures", ", ".join(measure.column for measure in study.measures)))
    if study.goal is not None:
        rows.append(("goal", f"{study.goal.sense} {study.goal.measure}"))
    return rows


def space_text(axis: StudyAxis, space: Space) -> str:
    """Return the values of a factor as text."""
    spacing = ", logarithmic" if axis.logarithmic else ""
    if isinstance(space, Interval):
        return f"{space.low:g} to {space.high:g}, continuous{spacing}"
    shown = [value if isinstance(value, str) else f"{value:g}" for value in space]
    if len(shown) > MOST_SHOWN:
        return f"{len(shown)} values, {', '.join(shown[:3])} ... {shown[-1]}{spacing}"
    return ", ".join(shown) + spacing


def sought_text(study: LoadedStudy, sought: Bisection) -> str:
    """Return a description of a bisection: its target, assumption, and largest number of cases."""
    axis = next(axis for axis in study.factors if axis.name == sought.factor)
    cell_count = study.case_count // sought.most_runs
    return (
        f"bisection: where {sought.measure} crosses {sought.share:g} as {axis.name} increases, to "
        f"within {sought.tolerance:g} {axis.unit}".rstrip()
        + f", assumed to happen once; in {count_text(cell_count, 'cell')} at most "
        f"{count_text(study.case_count, 'case')}"
    )


# -------------------------------------------------------------------------------------------------
# The study of `softsim assess --repeats`: a robot in a layout with varied uncertain parameters.
#
# Friction, the place where it starts and the angle at which its motor starts are drawn from ranges,
# which a Latin hypercube fills evenly. The same seed draws the same values.


@dataclass(frozen=True)
class Spread:
    """Number of runs of a robot through a layout, and the ranges of what varies.

    friction: half of the range of the friction coefficient, over the coefficient. start: half of
    the range of the place at which the robot starts, along the pipe [m]. seed: of the draws.
    """

    count: int
    friction: float = 0.1
    start: float = 2e-3
    seed: int = 1


ASSESSMENT_MEASURES = {
    "time": {"of": "layout.time", "about": "time until the verdict"},
    "reached": {"of": "layout.where.arc_length", "about": "farthest place of the centre"},
    "standstill": {"of": "layout.longest_standstill.duration", "about": "longest standstill"},
    "patience_used": {
        "of": "layout.patience_used",
        "about": "fraction of the patience used, 1 if stuck",
    },
}


def repeated_assessment(
    layout: Path, robot: str, loaded: LoadedScene, spread: Spread, overrides: Sequence[str]
) -> LoadedStudy:
    """Return the study that runs a layout with a robot `spread.count` times.

    Parameters
    ----------
    layout, robot: the file of the layout, the name of the standard robot.
    loaded: the scene that they make together with the overrides.
    spread: count and ranges.
    overrides: "a.b.c=value" each, for all runs; a key that varies, varies about its value.

    Raises
    ------
    SceneError: the scene cannot be run with values from these ranges.
    """
    factors = _factors(loaded, spread)
    if not factors:
        raise SceneError(
            "nothing varies: the scene has no friction, no explicit start of its pipe and no motor",
            "set a range of friction or of the start greater than zero",
            Option(f"--repeats {spread.count}"),
        )
    varied = {factor["key"] for factor in factors.values()}
    content = {
        "title": f"{loaded.scene.title or layout.stem}: {robot}, {spread.count} runs",
        "scene": layout.name,
        "robot": robot,
        "factors": factors,
        "design": {"kind": "latin_hypercube", "count": spread.count, "seed": spread.seed},
        "measures": ASSESSMENT_MEASURES,
        "plots": [{"kind": "scatter", "x": name, "y": "standstill"} for name in factors],
    }
    shared = [one for one in overrides if one.partition("=")[0].strip() not in varied]
    return loaded_study(tree_of(content), layout, shared)


def _factors(loaded: LoadedScene, spread: Spread) -> dict[str, dict[str, Any]]:
    """Return the factors: name -> its entry as in a study file."""
    scene, found = loaded.scene, {}
    friction = scene.contact.friction_coefficient
    if friction > 0.0 and spread.friction > 0.0:
        found["friction"] = {
            "key": "contact.friction_coefficient",
            "range": [friction * (1.0 - spread.friction), friction * (1.0 + spread.friction)],
            "about": "friction coefficient",
        }
    walls = scene.environment.walls
    paths = {name: wall for name, wall in walls.items() if isinstance(wall, PipePathWall)}
    asked = scene.layout.path if scene.layout else None
    path = asked if asked in paths else next(iter(paths), None)
    keys = ("environment", "walls", str(path), "start", 0)
    is_written = nearest(loaded.tree, keys)[1] == len(keys)  # a study sets what a scene has
    if path is not None and is_written and spread.start > 0.0:
        ends = [1e3 * (paths[path].start[0] + sign * spread.start) for sign in (-1.0, 1.0)]
        found["start"] = {
            "key": ".".join(map(str, keys)),
            "range": [f"{end:.10g} mm" for end in ends],
            "about": "where the pipe starts, seen from the robot",
        }
    for name, load in scene.loads.items():
        if isinstance(load, EccentricMass):
            found[f"phase_of_{name}"] = {
                "key": f"loads.{name}.phase",
                "range": ["0 deg", "360 deg"],
                "about": f"phase angle of {name} at the start",
            }
    return found
