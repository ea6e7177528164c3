"""Where a run is, in numbers that a checkpoint keeps."""

from dataclasses import dataclass
from typing import Any

from softsim.loads.pressure_control import ControlState
from softsim.stability.schedule import InspectionPlan


@dataclass
class Progress:
    """Where a run is, beside the solver's memory: times [s], energies [J], counts.

    control: what a controlled pressure remembers.
    """

    inspections: InspectionPlan
    time: float = 0.0
    increments: int = 0
    increment: float = 0.0
    next_history: float = 0.0
    next_frame: float = 0.0
    last_history: float = -1.0  # before the first row
    initial_balance: float = 0.0
    largest_energy: float = 0.0
    largest_energy_error: float = 0.0
    wall_time: float = 0.0
    control: ControlState | None = None

    @classmethod
    def written(cls, numbers: dict[str, Any]) -> "Progress":
        """As `dataclasses.asdict` wrote it."""
        plan = InspectionPlan(**numbers["inspections"])
        control = numbers["control"]
        state = None if control is None else ControlState.written(control)
        return cls(**{**numbers, "inspections": plan, "control": state})
