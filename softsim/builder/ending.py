"""End of a run: at its time, after a pressure cycle, or when a probe of a static run is steady."""

from softsim.builder.names import Names, close_names
from softsim.errors import SceneError
from softsim.loads.pressure import FollowerPressure
from softsim.model import SteadyProbe
from softsim.scene.outputs import probe_columns


def end_time(names: Names, chamber: FollowerPressure | None) -> float:
    """Return the latest end of the run [s].

    It is the time of the scene, or the end of the last pressure cycle that the run waits for, if
    the profile defines it.
    """
    time = names.scene.time
    latest = names.beginning.time + time.end
    if time.cycles is None:
        return latest
    if chamber is None:
        raise _refused(names, "no pressure has cycles to count")
    refuse_missing_cycles(names, chamber, time.cycles)
    return min(latest, chamber.drive.cycle_end(time.cycles))


def refuse_missing_cycles(names: Names, chamber: FollowerPressure, asked: int) -> None:
    """Raise SceneError if the run waits for more cycles than the chamber of the robot has.

    The history counts the cycles of no other chamber.
    """
    most, name = chamber.drive.cycle_count, chamber.name
    if asked <= most:
        return
    if most == 0:
        raise _refused(names, f"the pressure of '{name}', the chamber of the robot, has no cycles")
    raise names.loaded.error(
        ("time", "cycles"),
        f"the run is to end after {asked} pressure cycles, but '{name}' has only {most:g}",
        f"write at most {most:g}, or raise loads.{name}.profile.count",
    )


def steady_probe(names: Names) -> SteadyProbe | None:
    """Return the probe that ends a static run once it is steady, or None."""
    time, probes = names.scene.time, names.scene.output.probes
    if time.until is None:
        return None
    name = time.until.probe
    if name not in probes:
        raise names.loaded.error(
            ("time", "until", "probe"),
            f"there is no probe '{name}'",
            close_names(name, list(probes), "probes") if probes else "add output.probes",
        )
    columns = probe_columns(name, probes[name].kind, "xyz"[: names.dimension])
    since = names.beginning.time + time.end
    return SteadyProbe(name, tuple(columns), time.until.within, since)


def refuse_steady_probe(names: Names) -> None:
    """Raise SceneError if a dynamic run should end when a probe is steady."""
    if names.scene.time.until is not None:
        raise names.loaded.error(
            ("time", "until"),
            "only a static run can end when a probe is steady",
            "write procedure: static, or leave `until` out",
        )


def _refused(names: Names, problem: str) -> SceneError:
    return names.loaded.error(
        ("time", "cycles"),
        f"the run is to end after pressure cycles: {problem}",
        "leave cycles out, so that the run ends at `end`, or use a profile of kind cycles",
    )
