"""Commands that change loads of a run while it goes on: chambers and motors."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from softsim.errors import SimulationError
from softsim.loads import profile
from softsim.loads.pressure import FollowerPressure, PressureSource
from softsim.loads.pressure_control import PressureRamp
from softsim.loads.rotor import Rotor
from softsim.run.course import Run
from softsim.scene.reporting import did_you_mean


@dataclass(frozen=True)
class Adjustable:
    """Load with a value that can be changed.

    unit: SI unit of its value. low, high: range of its value in the scene. limit: largest value
    that is accepted. value: returns the present value. change: takes the new value and the time [s]
    within which it is reached.
    """

    name: str
    unit: str
    low: float
    high: float
    limit: float
    value: Callable[[], float]
    change: Callable[[float, float], None]


class LoadCommands:
    """Commands to the chambers and motors of a run, from its present time on."""

    def __init__(self, run: Run) -> None:
        self.run, self.scenario, self.model = run, run.scenario, run.model
        self.loads = self.model.named_loads

    @property
    def adjustable(self) -> list[Adjustable]:
        """Chambers and motors that can be changed.

        None in a run along a path of equilibria, whose load factor is an unknown, and in one that
        computes derivatives, which are those of the loads of the scene.
        """
        relaxation = self.model.relaxation
        follows_path = relaxation is not None and relaxation.follows_path
        if follows_path or self.run.output.derivatives is not None:
            return []
        return [
            *map(self._adjustable_chamber, self.chambers),
            *map(self._adjustable_motor, self.names(Rotor)),
        ]

    def _adjustable_chamber(self, name: str) -> Adjustable:
        load = self._named(name, FollowerPressure, "chamber")
        low, high = load.source.value_range
        return Adjustable(
            name, load.source.unit, low, high, load.source.stiffest_value,
            lambda: self.present_value(load),
            lambda value, within: self.set_load(name, value, within),
        )  # fmt: skip

    def _adjustable_motor(self, name: str) -> Adjustable:
        motor = self._named(name, Rotor, "motor")
        rotors, scenario = self.scenario.term_of(motor).rotors, self.scenario.number
        return Adjustable(
            name, "Hz", 0.0, motor.rotor.frequency, np.inf,
            lambda: rotors[scenario].frequency,
            lambda frequency, within: self.set_motor(frequency, name),
        )  # fmt: skip

    def present_value(self, load: FollowerPressure) -> float:
        """Return the gauge pressure [Pa], added volume [m^3] or added mass [kg] of a chamber."""
        term = self.scenario.term_of(load)
        source: PressureSource = term.sources[self.scenario.number]
        if source.control is not None:
            return float(self.scenario.read(term.pressure))
        return source.value_at(self.scenario.time)

    def set_load(self, name: str, value: float, within: float = 0.0) -> None:
        """Change a chamber linearly to a pressure or filling; see `Simulation.set_load`."""
        self._refuse_network(name)
        load = self._named(name, FollowerPressure, "chamber")
        value = number(value, f"the value of '{name}'")
        within = number(within, f"the time within which '{name}' changes")
        if not (np.isfinite(value) and 0.0 <= within < np.inf):
            raise SimulationError(
                f"'{name}' cannot change to {value} within {within} s: both must be finite "
                "numbers, and the time at least zero"
            )
        scenario, term, now = self.scenario, self.scenario.term_of(load), self.scenario.time
        source: PressureSource = term.sources[scenario.number]
        if source.control is not None:
            start = self.present_value(load) if within > 0.0 else value
            rate = (value - start) / within if within > 0.0 else 0.0
            term.kernel.set_ramp(scenario.number, PressureRamp(start, now, rate, value))
        else:
            if value > (most := load.source.stiffest_value):
                raise SimulationError(
                    f"'{name}' cannot be set to {value:.6g}: the stable step was computed for at "
                    f"most {most:.6g}, the highest value of its profile in the scene",
                    hint="raise the highest value of the profile in the scene",
                )
            change = profile.ramp(now, self.present_value(load), within, value)
            term.follow(scenario.number, source.with_profile(change))
        if load is self.model.chamber:
            self.run.end_control()

    def set_motor(self, frequency: float, name: str | None = None) -> None:
        """Set the frequency [Hz] of a motor, or of all; see `Simulation.set_motor`."""
        frequency = number(frequency, "the frequency of a motor")
        if not 0.0 <= frequency < np.inf:
            raise SimulationError(f"the frequency of a motor cannot be {frequency} Hz")
        motors = self.model.of_kind(Rotor)
        if name is not None:
            motors = (self._named(name, Rotor, "motor"),)
        if not motors:
            raise SimulationError(
                "the scene has no motor", hint="add a load of kind eccentric_mass"
            )
        for motor in motors:
            term = self.scenario.term_of(motor)
            now = term.rotors[self.scenario.number]
            changed = motor.at_frequency(now, frequency, self.scenario.time)
            term.follow(self.scenario.number, changed)

    @property
    def chambers(self) -> tuple[str, ...]:
        """Names of the chambers that can be set: all but those of a network."""
        return tuple(
            name
            for name, load in self.loads.items()
            if isinstance(load, FollowerPressure) and load.source.can_be_set
        )

    def _refuse_network(self, name: str) -> None:
        for key, load in self.loads.items():
            is_fed = isinstance(load, FollowerPressure) and not load.source.can_be_set
            if is_fed and name in (key, key.rpartition(".")[2]):
                raise SimulationError(
                    f"the pressure of '{name}' follows from the network, so it cannot be set",
                    hint="load the chamber by follower_pressure, added_volume or added_gas",
                )

    def names(self, kind: type) -> tuple[str, ...]:
        """Return the names of the loads of a class."""
        return tuple(name for name, load in self.loads.items() if isinstance(load, kind))

    def _named(self, name: str, kind: type, called: str) -> Any:
        known = self.names(kind)
        if name not in known:
            hint = did_you_mean(str(name), known) if known else f"the scene has no {called}"
            raise SimulationError(f"there is no {called} '{name}'", hint)
        return self.loads[name]


def number(value: Any, meaning: str) -> float:
    """Return a real number of any type, numpy's too, as float; raise SimulationError for others."""
    found = np.asarray(value)
    if found.dtype.kind not in "iuf" or found.size != 1:
        raise SimulationError(f"{meaning} must be a number, not {value!r}")
    return float(found.item())
