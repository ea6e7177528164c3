"""Fig 6.3, 6.4 and Table 6.1 of the thesis: samples of 3 x 5, 5 x 5, 7 x 5 spikes on a plate.

`spike_patch.yaml`, one case a sample and mesh: the underside of the skin held, pressed by 1 mm. The
thesis says that the stiffness grows as the number of spikes and takes the force as linear in the
depth; from that it scales the motor's force for its plane model by 1/186. A spike's stiffness it
tells of Leafbot's limb only, 250 N/m of Dragon Skin 30 (Table B.1): as C10, 94 N/m of Dragon
Skin 10.

The factor. A plane model shakes as the robot does if its force is to the robot's as its stiffness
to the robot's. The samples stand for one half of the robot; the plane model has one row of five
spikes on each side and no depth that is told. So the factor is computed for a depth of 1 mm, from
one row of five plane spikes, and from the whole plane model with the thesis's 5 kPa in the 36 mm
pipe, whose frame is pushed across. Both go as the depth.
Digitised points: columns (3, 5, 7), depth_mm, force_N.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from softsim.report.style import BLUE, GREEN, INK, ORANGE, QUIET, drawing
from validation.cases import Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points, deviation
from validation.motion import MILLI, NAN
from validation.script import Listing, Script
from validation.statements import CONVERGENCE, MOTOR_FORCE, PATTERN, SPIKE_STIFFNESS
from validation.verdicts import (
    IN_SPACE,
    Finding,
    Row,
    above,
    between,
    judged,
    row,
    shown,
    within,
)

NAME = "spike_patches"
SCENE = "spike_patch.yaml"
ROWS = 5  # j1 to j5
COLUMNS = (3, 5, 7)  # i1 to i3, i5, i7
# Twice as many hexahedra across what bends.
MESHES = {"shipped mesh": (), "finer mesh": ("bodies.patch.mesh.spike_columns=4",)}
SHIPPED, FINER = MESHES
DEPTH = 1e-3  # m, at the end
FIRST = 0.1e-3  # m, over which a spike sticks to the plate
PROPORTIONAL = 0.05  # share by which forces may be off the number of spikes
STRAIGHT = 0.98  # R^2 of a force that counts as linear in the depth
SPIKE = 250.0 * 36.0 / 96.0  # N/m, Leafbot's limb scaled by C10 from Dragon Skin 30 to 10
SPIKE_SPREAD = 0.25
MESH_SPREAD = 0.1
PUSH = (0.4, 0.6)  # horizontal over vertical force of a limb: a half (Eq 5.22)
FACTOR = 186.0  # 1.432 N of the motor at 192 Hz over 0.0077 N (Table 6.1)
FACTOR_SPREAD = 1.5
PLANE_DEPTH = 1e-3  # m, of the plane models here

PLANE = "plane spike"
PUSHED = "plane model at 5 kPa, frame pushed"
PUSHED_BY = 0.05e-3  # m, at 1.5 s, when the air has been in for half a second
ONE = "one spike"
ALONE = ("bodies.patch.mesh.columns=1", "bodies.patch.mesh.rows=1", *MESHES[FINER])
BANDS = {
    "root 3 mm": ("bodies.patch.mesh.root_thickness=3 mm",),
    "root 4 mm, as Leafbot's": ("bodies.patch.mesh.root_thickness=4 mm",),
    "friction 0.5": ("contact.friction_coefficient=0.5",),
    "friction 1": ("contact.friction_coefficient=1",),
    "root 4 mm, Dragon Skin 30": (
        "bodies.patch.mesh.root_thickness=4 mm", "bodies.patch.material=dragon_skin_30",
    ),
    "four times slower": ("conditions.down.displacement.duration=1 s", "time.end=1 s"),
}  # fmt: skip
DRAWN = {
    ONE: INK, "root 3 mm": BLUE, "root 4 mm, as Leafbot's": ORANGE, "friction 0.5": GREEN,
    "friction 1": QUIET,
}  # fmt: skip
COLOURS = {3: GREEN, 5: BLUE, 7: ORANGE}


def label(columns: int, mesh: str) -> str:
    """The name of a case."""
    return f"{columns} x {ROWS}, {mesh}"


def pressed(columns: int, mesh: str) -> Case:
    """A sample on the plate."""
    overrides = (f"bodies.patch.mesh.columns={columns}", *MESHES[mesh])
    return Case(label(columns, mesh), SCENE, overrides)


def cases() -> list[Case]:
    """Patches of all sizes on both meshes, one spike alone, its bands, and the plane models."""
    found = [pressed(columns, mesh) for mesh in MESHES for columns in COLUMNS]
    return [
        *found,
        Case(ONE, SCENE, ALONE),
        *(Case(name, SCENE, (*ALONE, *changed)) for name, changed in BANDS.items()),
        Case(PLANE, "leafbot_press.yaml", (
            "bodies.body.material=dragon_skin_10", "bodies.body.mesh.thickness=1 mm",
            "bodies.body.mesh.root_thickness=2.5 mm", "bodies.body.regions.limbs.thickness=1 mm",
            "bodies.body.mesh.limb_columns=4", "bodies.body.mesh.backbone_rows=2",
            "bodies.body.mesh.element_size=0.5 mm",
        )),
        Case(PUSHED, "pfr_36mm_literal.yaml", (
            "bodies.skin.thickness=1 mm", "environment.gravity=0 m/s^2",
            "loads.motor.amplitude=1e-9 N", "time.end=2 s",
            "conditions.push={kind: rigid_motion, body: frame, direction: y, displacement: "
            "{kind: table, points: [[0 s, 0 mm], [1.5 s, 0 mm], [1.6 s, 0.05 mm], "
            "[2 s, 0.05 mm]]}}",
        )),
    ]  # fmt: skip


def curve(outcome: Outcome) -> tuple[np.ndarray, np.ndarray]:
    """Depth [m] and force [N] (rows,) of a press that reaches DEPTH at a constant speed."""
    history = outcome.history
    if not history:
        return np.full(2, NAN), np.full(2, NAN)
    time = history["time"]
    return DEPTH * time / time[-1], np.abs(history["wall_force_y"])


def at(outcome: Outcome, depth: float) -> float:
    """Force at a depth [N]."""
    return float(np.interp(depth, *curve(outcome)))


def slope(outcome: Outcome) -> float:
    """Of the straight line with the least squares [N/m]."""
    depth, force = curve(outcome)
    return float(np.polyfit(depth, force, 1)[0]) if outcome.history else NAN


def straightness(outcome: Outcome) -> float:
    """R^2 of that line."""
    return float(np.corrcoef(*curve(outcome))[0, 1] ** 2) if outcome.history else NAN


def push(outcome: Outcome) -> float:
    """Horizontal over vertical force at the end."""
    if not outcome.history:
        return NAN
    x, y = (outcome.history[f"wall_force_{axis}"][-1] for axis in "xy")
    return float(abs(x / y))


def pushed_stiffness(outcome: Outcome) -> float:
    """Of the plane model's frame against a push across the pipe [N/m]."""
    if not outcome.history:
        return NAN
    time, force = outcome.history["time"], outcome.history["drive_force"]
    before, after = force[(time > 1.4) & (time < 1.5)].mean(), force[time > 1.9].mean()
    return float((after - before) / PUSHED_BY)


def over(sample: float, plane: float) -> Finding:
    """A sample's stiffness over that of a plane model, which the thesis takes as FACTOR."""
    ratio = sample / plane
    holds = FACTOR / FACTOR_SPREAD <= ratio <= FACTOR * FACTOR_SPREAD
    return judged(holds, f"1/{shown(ratio)}", ratio)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Proportional, straight, as stiff as the limb, the meshes alike; the force's factor."""
    for mesh in MESHES:
        samples = {n: outcomes[label(n, mesh)] for n in COLUMNS}
        three = at(samples[3], DEPTH)
        for n in (5, 7):
            found = within(at(samples[n], DEPTH) / three, n / 3, PROPORTIONAL)
            claim = f"force of {n} x 5 over 3 x 5 at 1 mm, {mesh}"
            reference = f"{n}/3 within {100 * PROPORTIONAL:g} %"
            yield row(PATTERN, claim, reference, found, [samples[3], samples[n]])
        found = above(straightness(samples[7]), STRAIGHT)
        claim = f"force linear in the depth up to 1 mm, R^2, {mesh}"
        yield row(PATTERN, claim, f"above {STRAIGHT:g}", found, [samples[7]])
        found = within(slope(samples[7]) / (7 * ROWS), SPIKE, SPIKE_SPREAD, "N/m")
        reference = f"{SPIKE:.0f} N/m within {100 * SPIKE_SPREAD:g} %"
        yield row(SPIKE_STIFFNESS, f"stiffness of a spike, {mesh}", reference, found, [samples[7]])
        found = between(push(samples[7]), *PUSH)
        claim = f"horizontal over vertical force at 1 mm, {mesh}"
        yield row(SPIKE_STIFFNESS, claim, "0.4 to 0.6", found, [samples[7]])
    fine, coarse = (outcomes[label(7, mesh)] for mesh in (FINER, SHIPPED))
    found = within(at(coarse, DEPTH), at(fine, DEPTH), MESH_SPREAD, "N")
    yield row(CONVERGENCE, "both meshes, force of 7 x 5 at 1 mm", "alike within 10 %", found,
              [fine, coarse])  # fmt: skip
    plane, pushed = outcomes[PLANE], outcomes[PUSHED]
    reference = f"1/{FACTOR:g} within a factor of {FACTOR_SPREAD:g}"
    claim = "factor on the motor's force: a plane row of five spikes, 1 mm deep, over 7 x 5"
    yield row(MOTOR_FORCE, claim, reference, over(slope(fine), ROWS * slope(plane)), [fine, plane])
    claim = "factor on the motor's force: the whole plane model, 1 mm deep, over 7 x 5"
    yield row(
        MOTOR_FORCE, claim, reference, over(slope(fine), pushed_stiffness(pushed)), [fine, pushed]
    )
    if points is not None:
        forces = [
            at(outcomes[label(int(n), FINER)], depth / MILLI) if n in COLUMNS else NAN
            for n, depth in zip(points["columns"], points["depth_mm"], strict=True)
        ]
        finding = deviation(np.array(forces), points["force_N"], points["spread"], "N")
        yield row(PATTERN, "Fig 6.4: force", "digitised points", finding, outcomes.values())


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Samples, one spike and what changes it, depths at which the plane models have the factor."""
    samples = [label(n, mesh) for mesh in MESHES for n in COLUMNS]
    count = {label(n, mesh): n * ROWS for mesh in MESHES for n in COLUMNS}
    listed = tuple(
        (
            name,
            shown(at(outcomes[name], DEPTH), "N"),
            *(
                shown(stiffness / count.get(name, 1))
                for stiffness in (
                    at(outcomes[name], FIRST) / FIRST,
                    slope(outcomes[name]),
                    at(outcomes[name], DEPTH) / DEPTH,
                )
            ),
            shown(straightness(outcomes[name])),
            shown(push(outcomes[name])),
        )
        for name in (*samples, ONE, *BANDS)
    )
    yield Listing(
        "Samples, and one spike of the finer mesh",
        (
            "what", "force at 1 mm", "N/m a spike up to 0.1 mm", "of the line", "at 1 mm",
            "R^2 of the line", "horizontal over vertical",
        ),
        listed,
    )  # fmt: skip
    fine = outcomes[label(7, FINER)]
    plane = {
        "a row of five plane spikes": ROWS * slope(outcomes[PLANE]),
        "the whole plane model at 5 kPa": pushed_stiffness(outcomes[PUSHED]),
    }
    depths = tuple(
        (
            name,
            shown(stiffness, "N/m"),
            shown(MILLI * PLANE_DEPTH * slope(fine) / FACTOR / stiffness, "mm"),
            shown(MILLI * PLANE_DEPTH * SPIKE * 7 * ROWS / FACTOR / stiffness, "mm"),
        )
        for name, stiffness in plane.items()
    )
    yield Listing(
        f"How deep the plane model would be for 1/{FACTOR:g}",
        ("what", "stiffness, 1 mm deep", "with the spikes here", f"with spikes of {SPIKE:.0f} N/m"),
        depths,
    )


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Force over depth of the samples; of one spike with other roots and other friction."""
    with drawing(path, 3.0) as figure:
        left, right = figure.subplots(1, 2)
        for n in COLUMNS:
            for mesh, style in zip(MESHES, ("--", "-"), strict=True):
                depth, force = curve(outcomes[label(n, mesh)])
                left.plot(MILLI * depth, force, color=COLOURS[n], linestyle=style,
                          label=f"{n} x {ROWS}" if style == "-" else None)  # fmt: skip
            if points is not None:
                chosen = points["columns"] == n
                left.plot(points["depth_mm"][chosen], points["force_N"][chosen], color=COLOURS[n],
                          marker="s", linestyle="none")  # fmt: skip
        for name, colour in DRAWN.items():
            depth, force = curve(outcomes[name])
            right.plot(MILLI * depth, MILLI * force, color=colour, label=name)
        limit = np.array([0.0, 0.5e-3])
        right.plot(MILLI * limit, MILLI * SPIKE * limit, color=QUIET, linestyle=":",
                   label=f"{SPIKE:.0f} N/m")  # fmt: skip
        left.set(xlabel="depth [mm]", ylabel="force [N]", title="dashed: shipped mesh")
        right.set(xlabel="depth [mm]", ylabel="force [mN]", title="one spike, finer mesh")
        left.legend()
        right.legend(fontsize="small")


SCRIPT = Script(
    name=NAME,
    model=IN_SPACE,
    figure="Fig 6.4, Table 6.1",
    about=(
        "Samples of 3 x 5, 5 x 5, 7 x 5 spikes of Dragon Skin 10, skin held at its underside, "
        "pressed on a plate, on two meshes. Claims: force as the number of spikes, linear in the "
        "depth; 94 N/m a spike, Leafbot's limb of 250 N/m scaled by the silicone; horizontal force "
        "half the vertical one; the factor 1/186 on the motor's force in the plane model follows "
        "from the stiffness of the spikes."
    ),
    cases=cases,
    rows=rows,
    draw=draw,
    columns=("columns", "depth_mm", "force_N"),
    listings=listings,
)

if __name__ == "__main__":
    command([SCRIPT])
