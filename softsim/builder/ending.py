"""When a run ends: at its time, with a pressure cycle before, a static one with a steady probe."""

from softsim.builder.names import Names, close_names
from softsim.errors import SceneError
from softsim.loads.pressure import FollowerPressure
from softsim.model import SteadyProbe
from softsim.scene.outputs import probe_columns


def end_time(names: Names, chamber: FollowerPressure | None) -> float:
    """Latest end of the run [s]: its time, or the end of the last pressure cycle that it waits for,
    where a profile tells when that is.
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
    """More cycles than the robot's chamber ever makes; the history counts those of no other."""
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
    """The probe at whose rest a static run may end, if it names one."""
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
    """What a dynamic run is asked to wait for."""
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
