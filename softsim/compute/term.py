"""Interface of force terms, and the data of their scenarios and rows.

The solver calls the same methods of all terms: for the passes of an increment, the fields of a
checkpoint, energies and work, and columns of the history. The defaults of Term are empty; a term
overrides those that apply to it.

A class whose functions (ti.func) kernels call is a plain class. ti.data_oriented is for those that
have kernels of their own: each look at an attribute of such an object takes a microsecond.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, dataclass, is_dataclass
from dataclasses import fields as data_fields
from enum import IntEnum
from typing import Annotated, Any, TypeVar, get_args, get_origin

import numpy as np
import taichi as ti

from softsim.compute import backend, fields
from softsim.compute.fields import Number, Row, real_field

# -------------------------------------------------------------------------------------------------
# Fields of a scenario at the times of several rows of its history.
#
# Columns of the history are computed for many rows at once: a small numpy operation takes a few
# microseconds, as long as it takes for a hundred rows together. So a row copies the fields that its
# columns need, and the columns follow later (output/observation.py).


# Rows whose columns are computed together, and the memory for their fields [bytes].
MOST_ROWS = 256
MOST_BYTES = 2**25


class Samples:
    """Fields of a scenario at the times of several rows of its history.

    Parameters
    ----------
    scenario : int
        Number of the scenario.
    times, load_times : ndarray, (rows,) [s]
        Simulated time of each row, and the time at which its loads are taken.
    intervals : ndarray, (rows,) [s]
        Time since the impulses were cleared.
    values : mapping of Field to ndarray, (rows, ...)
        Values of each field.
    """

    def __init__(
        self,
        scenario: int,
        times: np.ndarray,
        load_times: np.ndarray,
        intervals: np.ndarray,
        values: Mapping[ti.Field, np.ndarray],
    ) -> None:
        self.scenario, self.times, self.load_times = scenario, times, load_times
        self.intervals, self.values = intervals, values

    def __len__(self) -> int:
        return len(self.times)

    @property
    def rates(self) -> np.ndarray:
        """Factors (rows,) [1/s] of impulses to mean forces; 0 in an interval of no time."""
        return self.mean(np.ones(len(self)))

    def read(self, field: ti.Field) -> np.ndarray:
        """Return the values (rows, ...) of a field; its term lists it in `sampled`."""
        return self.values[field]

    def mean(self, impulses: np.ndarray) -> np.ndarray:
        """Return the mean forces (rows, ...) [N] of impulses [N s]; 0 in an interval of no time."""
        shape = (-1, *(1 for _ in impulses.shape[1:]))
        intervals = self.intervals.reshape(shape)
        nothing = np.zeros(impulses.shape)
        return np.divide(impulses, intervals, out=nothing, where=intervals > 0.0)


class Sampler:
    """Sampler of fields of one scenario, which holds up to `most` samples.

    most: reduced where the fields are so large that the samples would need more than MOST_BYTES.
    """

    def __init__(self, scenario: int, fields: Sequence[ti.Field], most: int) -> None:
        self.scenario, self.fields = scenario, list(dict.fromkeys(fields))
        self.row = Row(self.fields, scenario)
        self.most = max(1, min(most, MOST_BYTES // max(1, self.row.bytes)))
        self.arrays, self.clocks = self.row.arrays(self.most), np.zeros((self.most, 3))
        self.count = 0

    @property
    def is_full(self) -> bool:
        """True if no further sample fits."""
        return self.count == self.most

    def take(self, time: float, load_time: float, interval: float) -> None:
        """Copy the present fields; the times [s] are those of one row of Samples."""
        self.clocks[self.count] = time, load_time, interval
        self.row.copy_to(self.arrays, self.count)
        self.count += 1

    def handed_over(self) -> Samples:
        """Return the samples taken so far, and begin anew; they are valid until the next `take`."""
        count, self.count = self.count, 0
        values = [array[:count] for array in self.arrays]
        times, load_times, intervals = self.clocks[:count].T
        return Samples(
            self.scenario, times, load_times, intervals, dict(zip(self.fields, values, strict=True))
        )


def present(
    scenario: int, fields: Sequence[ti.Field], time: float = 0.0, interval: float = 0.0
) -> Samples:
    """Return one sample of the present fields of a scenario; times [s] as in Samples."""
    sampler = Sampler(scenario, fields, most=1)
    sampler.take(time, time, interval)
    return sampler.handed_over()


# -------------------------------------------------------------------------------------------------
# Force term: passes of an increment, fields, energies, columns of the history.


class Stage(IntEnum):
    """Stage of an increment in which a pass runs.

    Passes of a stage do not depend on each other and may run in parallel; each stage begins when
    the previous one has ended.
    """

    STEER = 0  # velocities that are prescribed; then everything drifts
    FOLLOW = 1  # places and velocities of nodes that are tied to facets
    MEASURE = 2  # gravity of now, lengths that elements ask for
    MOVE = 3  # deformation; forces that follow from places and velocities alone
    SUPPLY = 4  # flows of a network, from the volumes of its chambers
    PRESS = 5  # pressures, from volumes
    STRESS = 6  # forces, from deformation and pressures
    LIST = 7  # who touches whom among surfaces
    GATHER = 8  # forces on facets, from the nodes that touch them
    PULL = 9  # forces of the hoop stress on nodes opposite to those of the element (ring sections)
    HAND_OVER = 10  # what acts on tied nodes, onto the corners of their facets


@dataclass(frozen=True)
class Pass:
    """Calls of `functions` (s, i, t, dt) in order on `count` indices; `phase` names it in timings.

    A function may read results of earlier functions of its pass only at its own index.
    """

    phase: str
    count: int
    functions: tuple[Callable[..., None], ...]


class Term:
    """Base class of force terms."""

    def connect(self, loads: Mapping[str, "Term"]) -> None:
        """Take references to the terms of other loads, by name, before kernels are compiled."""

    def passes(self) -> dict[Stage, list[Pass]]:
        """Return the passes of an increment by stage."""
        return {}

    def pulls(self) -> list[Callable[..., None]]:
        """Return functions (s, i, t, dt) that add to the loads on rigid bodies.

        They are called one after another in stage MOVE.
        """
        return []

    def state_fields(self) -> dict[str, ti.Field]:
        """Return the fields that a checkpoint stores."""
        return {}

    def set_time_increment(self, scenario: int, dt: float) -> None:
        """Set the time step [s] of a scenario; infinite: all relaxation is complete."""

    def forget_work(self) -> None:
        """Reset the work of all scenarios."""

    def forget_dissipation(self, scenario: int) -> None:
        """Reset the dissipated energy of a scenario."""

    def impulses(self) -> list[ti.Field]:
        """Return fields (scenarios, ...) that are summed between two rows of the history.

        They are cleared after each row.
        """
        return []

    def refuse(self, scenario: int) -> None:
        """Raise StabilityError if a run must not continue from the present state.

        It is called before each row of the history.
        """

    def sampled(self) -> list[ti.Field]:
        """Return the fields that `readings` reads. Default: the impulses."""
        return self.impulses()

    def readings(self, samples: Samples) -> dict[str, np.ndarray]:
        """Return the columns of the history (rows,) from samples of the fields in `sampled`."""
        return {}

    @ti.func
    def stored_energy(self, s, part):
        """Return the energy of springs and materials [J] in a part of the sum.

        See `Number.first` and `once`.
        """
        return ti.cast(0.0, backend.real)

    @ti.func
    def dissipated_energy(self, s, part):
        """Return the energies dissipated so far by friction, and by viscosity and damping [J]."""
        return ti.Vector([0.0, 0.0])

    @ti.func
    def work_done(self, s, dt, part):
        """Return the work on the bodies so far [J], up to the time of their positions."""
        return ti.cast(0.0, backend.real)


class WorkingTerm(Term):
    """Force term that records the `work` (scenarios, count) [J] of its forces for each index."""

    def __init__(self, scenarios: int, count: int) -> None:
        self.count = Number(count)
        self.work = real_field(np.zeros((scenarios, count)))

    def state_fields(self) -> dict[str, ti.Field]:
        return {"work": self.work}

    def forget_work(self) -> None:
        fields.write(self.work, 0.0)

    @ti.func
    def work_done(self, s, dt, part):
        total = ti.cast(0.0, backend.real)
        for i in range(self.count.first(part), self.count.first(part + 1)):
            total += self.work[s, i]
        return total


# -------------------------------------------------------------------------------------------------
# Per-scenario and shared data of a batch of scenarios.
#
# A solver takes mesh, masses, materials, contact stiffnesses and the places of loads from the first
# of its models. Dataclass fields of a type `PerScenario[...]` are stored for each scenario.

T = TypeVar("T")

PER_SCENARIO = "own"

PerScenario = Annotated[T, PER_SCENARIO]
"""Type of per-scenario data."""


def equal_but_per_scenario(one: Any, other: Any) -> bool:
    """Return True if two parts of models are equal except for per-scenario data."""
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(equal_but_per_scenario, one, other))
    if is_dataclass(one):
        shared = [f.name for f in data_fields(one) if not is_per_scenario(f)]
        return all(
            equal_but_per_scenario(getattr(one, name), getattr(other, name)) for name in shared
        )
    return bool(one == other)


def is_per_scenario(field: Field[Any]) -> bool:
    """Return True if a dataclass field is per-scenario data."""
    return get_origin(field.type) is Annotated and PER_SCENARIO in get_args(field.type)


def shares_kernels(one: Any, other: Any) -> bool:
    """Return True if kernels that were compiled for one object of a solver serve the other as well.

    Numbers, texts and lengths of lists that a kernel reads from objects of the solver are compiled
    into it as constants; these must be equal. Fields are read at run time, arrays in Python only.
    Dataclasses are parts of models, of which kernels contain only the shared data.
    """
    return _compiles_alike(one, other, set())


def _compiles_alike(one: Any, other: Any, compared: set[int]) -> bool:
    if type(one) is not type(other):
        return False
    if isinstance(one, bool | int | float | str | np.generic):
        return bool(one == other)
    if id(one) in compared:
        return True
    compared.add(id(one))
    if is_dataclass(one):
        return equal_but_per_scenario(one, other)
    if isinstance(one, list | tuple):
        pairs = zip(one, other, strict=False)
        return len(one) == len(other) and all(_compiles_alike(*pair, compared) for pair in pairs)
    if isinstance(one, dict):
        known = one.keys() == other.keys()
        return known and all(_compiles_alike(one[key], other[key], compared) for key in one)
    if type(one).__module__.startswith("softsim."):
        return _compiles_alike(vars(one), vars(other), compared)
    return True
