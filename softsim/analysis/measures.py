"""Measures of a run of a model, and their comparison with the scene's `expect`."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from softsim.analysis.catalogue import RecordedRun, values
from softsim.analysis.passage import Verdict, analyses
from softsim.analysis.travel import FRAME, travel_axis
from softsim.loads.nodal import Rotor
from softsim.loads.pressure_control import Phase
from softsim.loads.profile import Cycle
from softsim.loads.tether import Tendon
from softsim.model import Model
from softsim.scene.measures import Part, chosen
from softsim.scene.outputs import Expect, Range, probe_columns

History = dict[str, np.ndarray]


def measures(model: Model, history: History) -> dict[str, Any]:
    """Return the measures of a run, name -> value in SI; None if a value cannot be determined.

    They are those of the catalogue, the reports of the analyses, and the readings of probes.
    Empty for a history without rows.
    """
    if len(history["time"]) == 0:
        return {}
    found = values(recorded_run(model, history))
    for analysis in analyses(model):
        found[analysis.name] = analysis.report(history)
    if model.probes:
        found |= probe_extremes(model, history)
    return found


def recorded_run(model: Model, history: History) -> RecordedRun:
    """Return a run of a model as the catalogue reads it."""
    cycles, robot, chamber = whole_cycles(model, history), model.robot, model.chamber
    parts = {
        Part.X: not model.is_axisymmetric,
        Part.Y: True,
        Part.Z: model.dimension == 3,
        Part.RADIAL: model.is_axisymmetric,
        Part.FRAME: robot.frame is not None and travel_axis(history, FRAME) is not None,
        Part.ROWS: bool(robot.rows),
        Part.TRACK: robot.track is not None,
        Part.CHAMBER: chamber is not None,
        Part.CYCLES: bool(cycles),
        Part.CONTROL: chamber is not None and chamber.source.control is not None,
        Part.TENDON: bool(model.of_kind(Tendon)),
        Part.LAYOUT: model.passage is not None,
        Part.CROSSING: model.crossing is not None,
    }
    motors = [motor.rotor for motor in model.of_kind(Rotor)]
    return RecordedRun(history, chosen(parts), cycles, motors, tuple(robot.rows), robot.track or "")


def whole_cycles(model: Model, history: Mapping[str, np.ndarray]) -> list[Cycle]:
    """Return the cycles of the pressure in the robot's chamber that ended within a history."""
    if model.chamber is None:
        return []
    source = model.chamber.source
    if source.control is not None:
        return controlled_cycles(history)
    until = history["time"][-1]
    return [c for c in source.pressure_cycles if c.has_ended(until)]


def controlled_cycles(history: Mapping[str, np.ndarray]) -> list[Cycle]:
    """Return the finished cycles of a controlled pressure, from the columns cycle and phase.

    A row holds the phase in which it was measured: the last row of a deflation marks its end.
    """
    t, number, falls = history["time"], history["cycle"], history["phase"] == Phase.DEFLATION
    cycles = []
    for k in np.unique(number):
        fall = np.flatnonzero(falls & (number == k))
        if len(fall) > 0 and fall[-1] < len(t) - 1:
            begin, end = float(t[fall[0] - 1]), float(t[fall[-1]])
            cycles.append(Cycle(begin, end, end))
    return cycles


def probe_extremes(model: Model, history: History) -> dict[str, dict[str, float]]:
    """Return the last, the lowest and the highest reading of each probe, by column."""
    axes = "xyz"[: model.dimension]
    names = [name for probe in model.probes for name in probe_columns(probe.name, probe.kind, axes)]
    return {
        "probes": {name: float(history[name][-1]) for name in names},
        "probes_min": {name: float(history[name].min()) for name in names},
        "probes_max": {name: float(history[name].max()) for name in names},
    }


def failed_expectations(expect: Expect, found: dict[str, Any]) -> str | None:
    """Return a message on the expectations that are not met; None if all are met.

    found: name -> value, or list of values that must all be within the limits.
    """
    wrong = [*other_verdict(expect, found), *outside_limits(expect, found)]
    return "expectation of the scene not met: " + "; ".join(wrong) if wrong else None


def other_verdict(expect: Expect, found: dict[str, Any]) -> Iterator[str]:
    """Yield a text if the verdict or exit of a layout is not the expected one.

    The verdict `unfinished` is never expected.
    """
    layout = found.get("layout", {"verdict": None, "sentence": "none"})
    if expect.passes is not None:
        expected = Verdict.PASSED if expect.passes else Verdict.STUCK
        if layout["verdict"] != expected.value:
            yield f"verdict {expected.value}, found {layout['sentence']}"
    if expect.exit is not None and layout.get("exit") != expect.exit:
        yield f"exit {expect.exit}, found {layout['sentence']}"


def outside_limits(expect: Expect, found: dict[str, Any]) -> Iterator[str]:
    """Yield a text for each value outside the limits that the scene gives for it."""
    for name, limits in expect:
        if not isinstance(limits, Range):
            continue
        value = found.get(name)
        low = -np.inf if limits.min is None else limits.min
        high = np.inf if limits.max is None else limits.max
        for v in value if isinstance(value, list) else [value]:
            if v is None or not low <= v <= high:
                yield f"{name}: {v} is outside [{low:g}, {high:g}]"
