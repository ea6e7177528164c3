"""The progress of a run, in numbers that a checkpoint stores."""

from dataclasses import dataclass, field
from typing import Any

from softsim.loads.pressure_control import ControlState
from softsim.stability.schedule import StableStepSchedule


@dataclass
class Progress:
    """Progress of a run, besides the solver's state: times [s], energies [J], counts.

    time_increment: the step in use [s]. told_step: the stable step that was told last [s]. control:
    state of a controlled pressure. row_count, frame_count: entries of the run's files when the
    checkpoint was written. warnings: kind -> text of the run's warnings so far.
    """

    schedule: StableStepSchedule
    time: float = 0.0
    increment_count: int = 0
    time_increment: float = 0.0
    told_step: float = 0.0
    next_history: float = 0.0
    next_frame: float = 0.0
    last_history: float = -1.0  # before the first row
    initial_balance: float = 0.0
    largest_energy: float = 0.0
    largest_energy_error: float = 0.0
    wall_time: float = 0.0
    row_count: int = 0
    frame_count: int = 0
    control: ControlState | None = None
    warnings: dict[str, str] = field(default_factory=dict)

    @classmethod
    def written(cls, numbers: dict[str, Any]) -> "Progress":
        """Return the progress from the numbers that `dataclasses.asdict` made of it."""
        schedule = StableStepSchedule(**numbers["schedule"])
        control = numbers["control"]
        state = None if control is None else ControlState.written(control)
        return cls(**{**numbers, "schedule": schedule, "control": state})
