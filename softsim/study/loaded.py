"""A study that was read and checked: its columns and its cases."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from softsim.errors import SceneError
from softsim.scene.tree import Tree, nearest
from softsim.study.axes import Axis, Goal, Plot
from softsim.study.case import Case, Value
from softsim.study.composition import Composition
from softsim.study.designs import point_count, points
from softsim.study.measures import MeasureColumn
from softsim.study.repeats import Perturbation
from softsim.study.resolution import resolved
from softsim.study.schema import Design, Study
from softsim.study.spacing import Space

REPEAT = "repeat"
"""Column of the repeats."""


@dataclass(frozen=True)
class LoadedStudy:
    """A valid study. path: its file; tree: what it says; design: None where it only says what to
    optimise; goal: what is best, None where it does not say.
    """

    study: Study
    path: Path
    tree: Tree
    composition: Composition
    design: Design | None
    perturbed: tuple[Perturbation, ...]
    measures: tuple[MeasureColumn, ...]
    plots: tuple[Plot, ...]
    goal: Goal | None

    @property
    def title(self) -> str:
        """One line for people."""
        return self.study.title or self.path.stem.replace("_", " ")

    @property
    def factors(self) -> tuple[Axis, ...]:
        """Columns of what varies."""
        return tuple(factor.axis for factor in self.composition.factors)

    @property
    def repeats(self) -> int:
        """How often each case is run."""
        return self.study.repeats.count if self.study.repeats is not None else 1

    @property
    def search_space(self) -> dict[str, Space]:
        """Factor -> all that it can be: an interval, or values; in the unit of its column."""
        return {factor.axis.name: factor.space for factor in self.composition.factors}

    @property
    def case_count(self) -> int:
        """How many cases it has, without making them. SceneError where it has no design."""
        return point_count(self._design(), self.composition.factors) * self.repeats

    def cases(self) -> list[Case]:
        """All cases, in the order of the table; repeats of a case follow each other. SceneError
        where it has no design.
        """
        return list(self._cases())

    def case(self, number: int, values: Mapping[str, Value]) -> Case:
        """The case with these values of the factors, unperturbed."""
        overrides = (one.override for one in self.composition.settings(values))
        return Case(number, self.composition.source(values), tuple(overrides), dict(values))

    def _cases(self) -> Iterator[Case]:
        factors, number = self.composition.factors, 1
        for point in points(self._design(), factors, self.tree):
            values = {f.axis.name: value for f, value in zip(factors, point, strict=True)}
            for case in self._repeated(self.case(number, values)):
                yield case
                number = case.number + 1

    def _repeated(self, case: Case) -> Iterator[Case]:
        """The case, or its repeats."""
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

    def _design(self) -> Design:
        if self.design is None:
            place = nearest(self.tree, ("optimize",))[0].key_origin
            hint = "softsim optimize runs it; or give it a design: {kind: grid}"
            raise SceneError("the study only says what to optimise, not what to run", hint, place)
        return self.design
