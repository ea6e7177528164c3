"""Study files: read, and checked against the scenes that they name."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from softsim.errors import SceneError
from softsim.scene.measures import Measure, produced
from softsim.scene.reporting import scene_error
from softsim.scene.tree import Keys, Tree, entries, nearest, plain
from softsim.scene.yaml_reading import read_file
from softsim.study.axes import Goal
from softsim.study.checking import checked_scenes
from softsim.study.composition import composed
from softsim.study.designs import refuse_misfit
from softsim.study.goal import goal_of, mismatch_column
from softsim.study.loaded import REPEAT, LoadedStudy
from softsim.study.measures import MeasureColumn, measure_column
from softsim.study.plots import chosen_plots, given_plots
from softsim.study.python_values import tree_of
from softsim.study.repeats import perturbations
from softsim.study.resolution import forget_files
from softsim.study.schema import GridDesign, Study

TAKEN = ("case", REPEAT, "verdict", "status", "reason", "wall_time", "key")
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
    """A study from Python values: the keys of a study file; scene files are relative to `folder`.
    SceneError as load_study.
    """
    return loaded_study(tree_of(content), folder / "study", ())


def loaded_study(tree: Tree, path: Path, overrides: Sequence[str]) -> LoadedStudy:
    """The study that `tree` says, in a file at `path`. SceneError as load_study."""
    try:
        study = Study.model_validate(plain(tree))
    except ValidationError as error:
        raise scene_error(error, tree, Study) from None
    forget_files()
    refuse_taken_names(study, tree)
    composition = composed(study, tree, path.parent, overrides)
    perturbed = perturbations(study.repeats, entries(tree, "repeats", "perturb"))
    design = study.design
    if design is None and study.optimize is None:
        design = GridDesign(kind="grid")
    if design is not None:
        refuse_misfit(design, composition.factors, tree)
    scenes = checked_scenes(composition, perturbed)
    told = {name: measure for one in scenes for name, measure in produced(one.scene).items()}
    measures = tuple(
        measure_column(name, part, nearest(tree, ("measures", name))[0], told)
        for name, part in study.measures.items()
    )
    goal, further = sought(study, tree, measures, told)
    factors = [factor.axis for factor in composition.factors]
    plots = chosen_plots(factors, measures, isinstance(design, GridDesign))
    measures += further
    if study.plots is not None:
        plots = given_plots(study.plots, tree, factors, measures)
    return LoadedStudy(study, path, tree, composition, design, perturbed, measures, plots, goal)


def refuse_taken_names(study: Study, tree: Tree) -> None:
    """A column has one meaning. SceneError at a factor or measure whose name is another's."""
    for name in study.factors:
        if name in TAKEN:
            raise _named(tree, ("factors", name), f"a table has a column {name} already")
    for name in study.measures:
        if name in TAKEN or name in study.factors:
            raise _named(tree, ("measures", name), f"a table has a column {name} already")


def sought(
    study: Study, tree: Tree, measures: Sequence[MeasureColumn], told: Mapping[str, Measure]
) -> tuple[Goal | None, tuple[MeasureColumn, ...]]:
    """What is best, if the study says so, and the further column that it takes to tell. SceneError
    where that makes no sense.
    """
    if study.optimize is None:
        return None, ()
    place = nearest(tree, ("optimize",))[0]
    mismatch = mismatch_column(study.optimize, place, measures, told)
    return goal_of(study.optimize, place, measures), () if mismatch is None else (mismatch,)


def _named(tree: Tree, keys: Keys, message: str, hint: str = "") -> SceneError:
    """An error at a key."""
    return SceneError(message, hint or "give it another name", nearest(tree, keys)[0].key_origin)
