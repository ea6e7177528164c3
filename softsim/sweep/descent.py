"""Optimisation of a static scene by the derivatives of its measures.

L-BFGS-B (Byrd et al. 1995, SIAM J. Sci. Comput. 16:1190-1208, implemented in scipy) varies the
factors within their ranges, one trial after the other. A trial is a static run that computes its
derivatives (run/statics.py). The trials depend on the results of earlier ones alone: repeated, an
optimisation finds its stored trials and continues.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from softsim.errors import SceneError
from softsim.scene.loading import keys_at
from softsim.scene.measures import WITHOUT_DERIVATIVE
from softsim.scene.text import nearest
from softsim.study.cases import Case
from softsim.study.design import Composition, value_at
from softsim.study.factors import Interval, NumberFactor
from softsim.study.loading import LoadedStudy
from softsim.study.measures import MAXIMIZE, History, HistoryColumn, MeasureColumn

RANGE = 10.0
"""Scaled range of a factor.

L-BFGS-B begins with a step along the gradient, which is scaled to a largest component of 1: a tenth
of the range.
"""

GRADIENT_TOLERANCE, VALUE_TOLERANCE = 1e-4, 1e-9
"""Gradient over that of the start, and relative change of the objective, that end the search."""


Evaluate = Callable[[np.ndarray], tuple[float, np.ndarray]]
"""Function that returns the objective and its gradient at scaled factors (k,)."""


class SearchEndedError(Exception):
    """The search is over: all trials are used, or one has failed."""


@dataclass(frozen=True)
class Dimension:
    """Factor of a descent with its range."""

    factor: NumberFactor
    space: Interval

    def value(self, x: float) -> float:
        """Return the value in the unit of the factor, at a scaled number x from 0 to RANGE."""
        return float(f"{self.space.number(x / RANGE):.12g}")

    def scaled(self, value: float) -> float:
        """Return the scaled number of a value."""
        return RANGE * self.space.share(value)

    def slope(self, x: float) -> float:
        """Return the derivative of the value, SI, over its scaled number."""
        return self.factor.size * self.space.slope(x / RANGE) / RANGE


class Descent:
    """Objective of a study as a function of its scaled factors (k,), with its gradient.

    Raises SceneError if a factor or a measure has no derivative.
    """

    def __init__(self, study: LoadedStudy, column: MeasureColumn, sense: str) -> None:
        self.study, self.column = study, column
        self.sign = -1.0 if sense == MAXIMIZE else 1.0
        self.dimensions = [self._dimension(factor) for factor in study.composition.factors]
        self.parts: list[HistoryColumn] = []
        for part in column.parts:
            if not (isinstance(part, HistoryColumn) and part.take == "last"):
                raise self._refusal("measures", part.name, "take: last of a column of the history")
            if part.of in WITHOUT_DERIVATIVE:
                raise self._refusal("measures", part.name, f"a derivative, unlike {part.of}")
            self.parts.append(part)
        objective = study.study.optimize
        if objective is not None and objective.prune is not None:
            raise self._refusal("optimize", "prune", "every trial: leave prune out")

    def _dimension(self, factor: Any) -> Dimension:
        space = factor.space
        if not (isinstance(factor, NumberFactor) and isinstance(space, Interval)):
            raise self._refusal("factors", factor.axis.name, "a range without a count")
        if space.is_whole:
            raise self._refusal("factors", factor.axis.name, "a number that is not whole")
        return Dimension(factor, space)

    def _refusal(self, part: str, name: str, needed: str) -> SceneError:
        """Return the error that the search needs something of a key that the study lacks."""
        place = nearest(self.study.tree, (part, name))[0]
        return SceneError(f"{name}: method: gradient needs {needed}", "", place.key_origin)

    def start(self) -> np.ndarray:
        """Return the scaled factors (k,) of the scene; the middle for a key without value.

        A value outside its range is moved to the nearest end.
        """
        alone: Composition = replace(self.study.composition, factors=())
        loaded = alone.loaded({})
        scaled = []
        for dimension in self.dimensions:
            factor, space = dimension.factor, dimension.space
            keys = keys_at(loaded.tree, factor.path, factor.path_origin, type(loaded.scene))
            value = value_at(loaded.scene, keys)
            inside = np.clip(value / factor.size, space.low, space.high) if value else None
            scaled.append(0.5 * RANGE if inside is None else dimension.scaled(float(inside)))
        return np.array(scaled)

    def case(self, number: int, x: np.ndarray) -> Case:
        """Return the case of scaled factors (k,), whose run computes the derivatives."""
        pairs = zip(self.dimensions, x.tolist(), strict=True)
        case = self.study.case(number, {d.factor.axis.name: d.value(s) for d, s in pairs})
        parameters = ", ".join(f'"{d.factor.path}"' for d in self.dimensions)
        ends = {part.end for part in self.parts}
        times = ", ".join(f"{time!r} s" for time in sorted(ends) if np.isfinite(time))
        if times and np.inf in ends:
            raise SceneError(
                "some measures of the objective have a time `to`, others have none",
                "give all of them one, the end of the run where it is meant",
                nearest(self.study.tree, ("measures",))[0].key_origin,
            )
        at = f", at: [{times}]" if times else ""
        asked = f"output.derivatives={{parameters: [{parameters}]{at}}}"
        return replace(case, overrides=(*case.overrides, asked))

    def value(
        self, x: np.ndarray, summary: Mapping[str, Any], history: History
    ) -> tuple[float, np.ndarray]:
        """Return the objective, to be minimised, and its gradient over the scaled factors (k,)."""
        value = self.column.value(summary, history)
        if value is None:
            raise SearchEndedError(f"a trial has no value of {self.column.name}")
        of_parts = [part.derivative(summary) for part in self.parts]
        partials = self.column.partials(summary, history)
        slopes = [
            sum(p * of_paths[d.factor.path] for p, of_paths in zip(partials, of_parts, strict=True))
            * d.slope(scaled)
            for d, scaled in zip(self.dimensions, x.tolist(), strict=True)
        ]
        return self.sign * float(value), self.sign * np.array(slopes)

    def minimise(self, evaluate: Evaluate, count: int) -> str:
        """Minimise by L-BFGS-B; return why the search ended.

        evaluate: runs a trial, and returns `value`, or raises SearchEndedError with the reason to
        stop. count: largest number of trials.
        """
        start = self.start()
        try:
            scale = max(float(np.abs(evaluate(start)[1]).max()), 1e-300)

            def scaled(x: np.ndarray) -> tuple[float, np.ndarray]:
                value, gradient = evaluate(x)
                return value / scale, gradient / scale

            found = minimize(
                scaled, start, jac=True, method="L-BFGS-B", bounds=[(0.0, RANGE)] * len(start),
                options={"gtol": GRADIENT_TOLERANCE, "ftol": VALUE_TOLERANCE, "maxfun": count},
            )  # fmt: skip
        except SearchEndedError as end:
            return str(end)
        steps = f"after {found.nit} step{'' if found.nit == 1 else 's'}"
        if found.success:
            return f"converged {steps}"
        return f"stopped {steps}: no lower value was found along the last direction"
