"""Experiments of `softsim calibrate-section`: four runs in sequence and their evaluation.

1. The reference is inflated slowly to the highest pressure.
2. The section is inflated with factor 1 and offset 0 until it presses each spike as hard.
3., 4. Both are inflated to an intermediate pressure, and their frames are pushed.
"""

import time
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from rich.console import Console

from softsim.apps.calibration.experiments import (
    FORCE_SHARE,
    Calibration,
    PressureMapping,
    Specimen,
    Stiffnesses,
    WallCurve,
    calibration_diagram,
    calibration_rows,
    inflation,
    matched,
    push,
    sample_table,
    scene_lines,
    stiffness,
    wall_curve,
)
from softsim.errors import CalibrationError, StabilityError
from softsim.output.folder import HISTORY, RunFolder
from softsim.output.history import read_history
from softsim.report.figures import draw_all, duration
from softsim.report.png import draw
from softsim.report.table import Table
from softsim.run import run
from softsim.scene.loading import LoadedScene

SECTION_TIME = 4.0
"""Ratio of the duration of the section's inflation to that of the reference.

Without hoop tension the section oscillates more slowly, and its run costs little.
"""

FARTHEST = 8.0
"""Largest ratio of the pressure in the section to the highest pressure of the reference."""

QUASI_STATIC = 0.05
"""Largest ratio of kinetic to internal energy in a slow loading.

The ABAQUS guidelines for quasi-static analysis give 5 to 10 %.
"""

CALIBRATION, FIGURE = "calibration.json", "calibration.png"


@dataclass(frozen=True)
class Settings:
    """Settings of the experiments.

    highest: pressure [Pa] up to which the reference is inflated, within `ramp` [s]. push_at:
    pressure [Pa] of the reference at which the frames are pushed; None selects the middle of
    the range from first contact to the highest matched pressure. spikes: number of spikes
    around a row. out: folder of all runs. device, threads: as for `run`.
    """

    highest: float
    ramp: float
    push_at: float | None
    spikes: int
    out: Path
    device: str
    threads: str


def calibrate(
    section: Specimen, reference: Specimen, settings: Settings, console: Console
) -> Calibration:
    """Run the experiments; print, draw and write their results.

    Raises
    ------
    CalibrationError: nothing touches the pipe, or pressures are out of range. Everything that
    `run` raises, except that a body that fails during its inflation is used up to that pressure.
    """
    laboratory = Laboratory(settings, console)
    in_space = laboratory.inflated(reference, "reference", settings.highest, settings.ramp)
    # Said at once, so that a reference that never touches costs no further run.
    console.print(f"  first contact at {in_space.touch * 1e-3:.4g} kPa", highlight=False)
    due = FORCE_SHARE * float(in_space.force.max())
    in_section = laboratory.section_pressed(section, due)
    mapping = matched(in_space, in_section)
    thickness = section.loaded.scene.bodies[section.body].thickness
    assert thickness is not None  # the section is plane strain
    pushed_at = _push_pressures(mapping, settings.push_at)
    found = Calibration(in_space, in_section, mapping, thickness, settings.spikes, pushed_at)
    if section.frame is not None and reference.formulation == "solid" and reference.frame:
        found = _with_stiffness(found, laboratory.pushed(section, reference, pushed_at))
    for name, curve in (("reference", in_space), ("section", in_section)):
        if curve.largest_kinetic_share > QUASI_STATIC:
            laboratory.remark(
                f"the {name} was inflated too fast: its kinetic energy reaches "
                f"{100 * curve.largest_kinetic_share:.3g} % of the internal energy; "
                "increase --ramp"
            )
    found = replace(found, remarks=tuple(laboratory.remarks))
    _tell(found, section, settings.out, console)
    return found


class Laboratory:
    """Runner of the experiments, each in its own folder; stores the warnings."""

    def __init__(self, settings: Settings, console: Console) -> None:
        self.settings, self.console = settings, console
        self.remarks: list[str] = []
        self.paces: dict[str, float] = {}  # wall time over simulated time, of bodies that ran

    def remark(self, text: str) -> None:
        """Print a warning and store it."""
        self.console.print(f"warning: {text}", highlight=False)
        self.remarks.append(text)

    def inflated(self, specimen: Specimen, name: str, highest: float, ramp: float) -> WallCurve:
        """Return the wall force over the pressure, up to the pressure at which the body fails."""
        scene = inflation(specimen, highest, ramp)
        what = f"{name}: inflate to {highest * 1e-3:.4g} kPa"
        folder = self.settings.out / name
        try:
            self._run(scene, name, what)
        except StabilityError as error:
            curve = wall_curve(read_history(folder / HISTORY))
            self.remark(
                f"the {name} failed at {curve.highest * 1e-3:.4g} kPa; its results up to this "
                f"pressure are used: {error.message}"
            )
            return curve
        return wall_curve(read_history(folder / HISTORY))

    def section_pressed(self, section: Specimen, due: float) -> WallCurve:
        """Return the wall curve of the section.

        Its pressure is raised until the wall force is `due` [N], the body fails, or
        FARTHEST is reached.
        """
        highest, ramp = self.settings.highest, SECTION_TIME * self.settings.ramp
        farthest = FARTHEST * highest
        while True:
            broken = len(self.remarks)
            curve = self.inflated(section, "section", highest, ramp)
            if curve.force.max() >= due or len(self.remarks) > broken:
                return curve
            if highest >= farthest:
                self.remark(
                    f"the wall force of the section is {curve.force.max():.3g} N at "
                    f"{highest * 1e-3:.4g} kPa, less than the {due:.3g} N required: the mapping "
                    "ends there"
                )
                return curve
            highest, ramp = 2.0 * highest, 2.0 * ramp

    def pushed(
        self, section: Specimen, reference: Specimen, pressures: tuple[float, float]
    ) -> tuple[Stiffnesses, ...]:
        """Return the stiffnesses of both models, transverse to the pipe and along it."""
        measured = []
        for specimen, name, pressure, slower in (
            (reference, "reference", pressures[0], 1.0),
            (section, "section", pressures[1], SECTION_TIME),
        ):
            experiment = push(specimen, pressure, slower * self.settings.ramp)
            what = f"{name}: push the frame at {pressure * 1e-3:.4g} kPa"
            history = self._run(experiment.scene, f"{name}_push", what)
            measured.append([stiffness(history, move) for move in experiment.moves])
        axes = [move.axis for move in experiment.moves]
        return tuple(Stiffnesses(*three) for three in zip(axes, *measured, strict=True))

    def _run(self, scene: LoadedScene, name: str, what: str) -> dict[str, np.ndarray]:
        """Run a scene in the folder `name`, draw its figures and return its history."""
        end, body = scene.scene.time.end, name.partition("_")[0]
        outlook = ""
        if body in self.paces:  # the second run of a body is as costly a second as its first
            expected = self.paces[body] * end
            done_at = datetime.now() + timedelta(seconds=expected)
            outlook = f", about {duration(expected)}, done at {done_at:%H:%M}"
        self.console.print(f"{what}, {end:.3g} s{outlook}", highlight=False)
        began, folder = time.monotonic(), self.settings.out / name
        try:
            results = run(
                scene, out=folder, device=self.settings.device, console=self.console,
                threads=self.settings.threads,
            )  # fmt: skip
        finally:
            # A body that broke has a failed frame to look at too.
            if (folder / HISTORY).is_file():
                draw_all(folder, "stretch")
        took = time.monotonic() - began
        self.paces[body] = took / end
        self.console.print(f"  took {duration(took)}", highlight=False)
        return results.history


def _push_pressures(m: PressureMapping, wanted: float | None) -> tuple[float, float]:
    """Return the pressures [Pa] for pushing the frames of the reference and of the section."""
    pressure = m.pressure
    at = 0.5 * (pressure[0] + pressure[-1]) if wanted is None else wanted
    if not pressure[0] < at <= pressure[-1]:
        raise CalibrationError(
            f"--push-at {at * 1e-3:.4g} kPa is outside the range of pressures at which both "
            f"models touch the pipe, {pressure[0] * 1e-3:.4g} to {pressure[-1] * 1e-3:.4g} kPa",
            "choose a pressure inside this range",
        )
    return float(at), float(np.interp(at, pressure, m.section_pressure))


def _with_stiffness(found: Calibration, stiffnesses: tuple[Stiffnesses, ...]) -> Calibration:
    """Return the calibration with its stiffnesses and the mapping at the resulting thickness."""
    across = stiffnesses[0]
    thick = matched(found.reference, found.section, across.ratio)
    return replace(found, stiffnesses=stiffnesses, thick_mapping=thick)


def _tell(found: Calibration, section: Specimen, out: Path, console: Console) -> None:
    """Write and draw the calibration; print its numbers, comparison, figure and scene lines."""
    RunFolder(out).write_json_atomic(CALIBRATION, found.as_json())
    draw(out / FIGURE, calibration_diagram(found))
    console.print(Table(calibration_rows(found)))
    console.print(sample_table(found))
    for remark in found.remarks:
        console.print(f"warning: {remark}", highlight=False)
    console.print(f"figure  {out / FIGURE}\nresults in {out}", highlight=False)
    print(f"\n{scene_lines(found, section.pressure, section.body)}")
