"""The first trials of an optimisation, which have nothing to learn from: they lie evenly."""

from collections.abc import Mapping
from typing import Any

from optuna.distributions import (
    BaseDistribution,
    CategoricalDistribution,
    FloatDistribution,
    IntDistribution,
)
from optuna.samplers import RandomSampler
from optuna.study import Study
from optuna.trial import FrozenTrial

from softsim.study.values import Interval

START = 8
"""How many they are; a power of two, for which a Sobol sequence is even."""


class EvenStart(RandomSampler):
    """Suggests a point of a scrambled Sobol sequence. number: of the trial, from 1 to START."""

    def __init__(self, names: list[str], seed: int, number: int) -> None:
        from scipy.stats import qmc  # slow to import

        super().__init__(seed)
        point = qmc.Sobol(len(names), seed=seed).random(START)[number - 1]
        self.shares: Mapping[str, float] = dict(zip(names, point.tolist(), strict=True))

    def sample_independent(
        self,
        study: Study,
        trial: FrozenTrial,
        param_name: str,
        param_distribution: BaseDistribution,
    ) -> Any:
        """The value at the point's share of what a factor can be; called by optuna."""
        return value_at(param_distribution, self.shares[param_name])


def value_at(distribution: BaseDistribution, share: float) -> Any:
    """What lies at a share from 0 to below 1 of a distribution."""
    match distribution:
        case FloatDistribution(low=low, high=high, log=log):
            return Interval(low, high, log).at(share)
        case IntDistribution(low=low, high=high):
            return int(Interval(low, high, is_whole=True).at(share))
        case CategoricalDistribution(choices=choices):
            return choices[int(share * len(choices))]
    raise TypeError(f"no trial asks for a {type(distribution).__name__}")
