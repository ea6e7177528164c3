"""How much is measured: all of it, or a quick look."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Effort:
    """rounds: ours and the ceiling, in turn. seconds: of one measurement. counts: elements of the
    large meshes. starts: warm starts. simulated: time [s] of the long run that is computed, the
    rest extrapolated; None for all. study_time: that of each case of a study [s].
    cases: of a study whose cases cost nothing.
    """

    rounds: int
    seconds: float
    counts: tuple[int, int]
    starts: int
    simulated: float | None
    study_time: float
    cases: int


# Short measurements and many: some of them find the machine undisturbed.
FULL = Effort(
    rounds=15,
    seconds=0.4,
    counts=(20_000, 200_000),
    starts=3,
    simulated=None,
    study_time=0.5,
    cases=10_000,
)
QUICK = Effort(
    rounds=4,
    seconds=0.2,
    counts=(20_000, 200_000),
    starts=1,
    simulated=0.2,
    study_time=0.02,
    cases=2_000,
)
