"""A tapered tentacle of silicone that tendons bend: positions of its markers in static poses.

Protocol. Data: a tentacle of 360 mm hangs from its base; motors pull two tendons with known
torques, and motion capture measures four markers and one at the base (tud-phi/soromox, system
identification; mean of each static pose). Five of the eleven poses at hand are computed, chosen
before any was, to save time: one tendon with 0.18 and 0.25 N m, the other with 0.2 N m, and both
with 0.05 and 0.1 and with 0.15 and 0.2 N m.

Taken from the scripts of the source: radii, tendons and markers, the order of the markers in each
file, the torques that the file names abbreviate (m12_u00050010: 0.05 N m on tendon 1 and 0.1 N m on
tendon 2; u018: 0.18 N m), the spool of 32.5 mm radius, the direction of gravity (along the hanging
tentacle), and the centre of the base relative to its marker (30 and 13 mm away). The markers sit on
arms of 20 to 25 mm and at the tip 8 mm below it. Nothing is aligned to the predictions. The data
alone say how exact this frame is: the poses with 0.05 and 0.1 N m and with 0.1 and 0.05 N m should
be mirror images, and their tips differ by 9 mm, 2.6 % of the length.

Constants: E = 315 kPa, nu = 0.45 and 1318 kg/m^3, which the authors fitted to eight poses with one
tendon (0.1 to 0.25 N m) by a rod with nine unknowns. There is no independent measurement. So this
tests the mechanics of body and tendons, not the constants; three of the five poses (0.18 N m and
those with both tendons) were not in the fit. Neo-Hookean law with the same E and nu.

Model: hexahedra in space, 12 in a section and 8 mm long. The polygon of a section has the second
moment of area of the circle. Each tendon is a cable without friction through 51 eyelets from the
base to its end at 305 mm; its tension is torque over spool radius. A layer of 5 mm that ends there
is 100 times as stiff, so that the section stays plane where the tendons are anchored, as in the
authors' rod; without it the tip depended on the mesh by 3 % of the length. Markers have no weight.
Static procedure, Newton's method.

Band: the largest distance of a marker from the measured one, 5 % of the length (18 mm) in each
pose: twice the error of the mirror images. The markers of two meshes (12 and 20 elements in a
section) with 0.18 N m on tendon 1 agree within 1 % of the length.

Before the protocol data and source had been read, and the computation had been tried with 0.22 N m
on tendon 1, which was not measured.

Added after the run, to find the reason for the misses: a rod of linear elasticity with the same
constants and tendons, listed below the rows. It is not judged.
"""

import csv
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from softsim.report.style import COLOURS, INK, drawing
from validation.cases import Case, Outcome, Outcomes
from validation.command import command
from validation.digitised import Points
from validation.published import MEASURED
from validation.script import PUBLISHED, Listing, Script
from validation.verdicts import Finding, Row, below, percent, row, shown, shown_list

NAME = "soft_tentacle"
DATA = MEASURED / NAME
SCENE = Path(__file__).with_name("soft_tentacle.yaml")
LENGTH, END_OF_TENDONS = 0.36, 0.305  # m
RADII = ((0.0, 0.305, 0.36), (15.41e-3, 6.42e-3, 4.80e-3))  # m
ANCHOR = 5e-3  # m, thickness of the stiff layer
TENDONS = (30.0, 150.0)  # deg, from -z to x
TENDON_OFFSET, TENDON_TAPER = 11.4e-3, 0.0295  # m, and m per m
SPOOL = 0.0325  # m
EYELETS = 51
STATIONS = (0.1291, 0.2195, 0.28, LENGTH)  # m, of the markers along the body
ARMS = (25e-3, -21e-3, 20e-3, 8e-3)  # m, towards x of a section; at the tip along the body
BASE = (-0.03, -0.013, 0.0)  # m, centre of the base from its marker in coordinates of the capture
BAND, BAND_OF_MESHES = 0.05, 0.01
MODULUS, DENSITY, GRAVITY = 315e3, 1318.0, 9.81
LINKS = 720  # of the rod


class Pose(NamedTuple):
    """Torques on the two tendons [N m], and columns of the four markers and the base in its file.

    fitted: the authors' constants were fitted to it.
    """

    torques: tuple[float, float]
    order: str
    fitted: bool = False

    @property
    def name(self) -> str:
        """Torques as text."""
        return "{:g} and {:g} N m".format(*self.torques)


POSES = {
    "m1_u018": Pose((0.18, 0.0), "13042"),
    "m1_u025": Pose((0.25, 0.0), "30214", True),
    "m2_u02": Pose((0.0, 0.2), "24103", True),
    "m12_u00050010": Pose((0.05, 0.1), "24103"),
    "m12_u0015002": Pose((0.15, 0.2), "13204"),
}
REFINED = "m1_u018"


class Density(NamedTuple):
    """Mesh density: elements along a side of the core, rings around it, length of a layer [m]."""

    side: int
    rings: int
    layer: float

    @property
    def elements(self) -> int:
        """Number of elements in a section."""
        return self.side * (self.side + 4 * self.rings)

    @property
    def file(self) -> Path:
        """Mesh file beside the scene."""
        return SCENE.with_name(f"{NAME}_{self.elements}.vtu")

    @property
    def layers(self) -> np.ndarray:
        """Positions of the layers' ends along the body (n,) [m]."""
        ends = (0.0, *STATIONS[:3], END_OF_TENDONS - ANCHOR, END_OF_TENDONS, LENGTH)
        counts = [max(1, round(gap / self.layer)) for gap in np.diff(ends)]
        parts = [
            np.linspace(begin, end, n + 1)[1:]
            for begin, end, n in zip(ends[:-1], ends[1:], counts, strict=True)
        ]
        return np.concatenate([[0.0], *parts])


COARSE, FINE = Density(2, 1, 8e-3), Density(2, 2, 8e-3)


def widening(corners: int) -> float:
    """Return radius of a regular polygon over that of the circle of equal second moment."""
    turn = 2.0 * np.pi / corners
    return float(corners * np.sin(turn) * (2.0 + np.cos(turn)) / (6.0 * np.pi)) ** -0.25


def section(side: int, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 2) and quadrilaterals (m, 4) of a disc of radius 1: a core and rings."""
    corners = 4 * side
    ticks = np.linspace(-0.48, 0.48, side + 1)
    core = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)
    number = np.arange(len(core)).reshape(side + 1, side + 1)
    rim = np.concatenate([number[:-1, 0], number[-1, :-1], number[:0:-1, -1], number[0, :0:-1]])
    angle = 2.0 * np.pi / corners * np.arange(corners) - 0.75 * np.pi
    outer = widening(corners) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points, loop = [core], rim
    cells = [np.stack([number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]], -1)]
    for ring in range(1, rings + 1):
        inner, loop = loop, len(core) + corners * (ring - 1) + np.arange(corners)
        points.append(core[rim] + ring / rings * (outer - core[rim]))
        cells.append(np.stack([inner, loop, np.roll(loop, -1), np.roll(inner, -1)], axis=1))
    return np.concatenate(points), np.concatenate([block.reshape(-1, 4) for block in cells])


@cache
def write_mesh(density: Density) -> None:
    """Write the mesh of the body and its node sets: base, and those from which markers follow."""
    import meshio  # takes longer to import than this package

    flat, quads = section(density.side, density.rings)
    s, n = density.layers, len(flat)
    points = np.zeros((len(s), n, 3))
    points[..., [0, 2]] = np.interp(s, *RADII)[:, None, None] * flat * (1.0, -1.0)
    points[..., 1] = -s[:, None]
    layers = n * np.arange(len(s) - 1)[:, None, None] + quads
    cells = np.concatenate([layers + n, layers], axis=2).reshape(-1, 8)
    centre = int(np.argmin(np.hypot(*flat.T)))
    side, other = int(np.argmax(flat[:, 0])), int(np.argmin(flat[:, 0]))
    sets = {"base": range(n), "m4_above": [n * (len(s) - 2) + centre]}
    for k, station in enumerate(STATIONS, 1):
        first = n * int(np.argmin(np.abs(s - station)))
        sets[f"m{k}"] = [first + centre]
        sets[f"m{k}_side"], sets[f"m{k}_other"] = [first + side], [first + other]
    numbers = np.arange(n * len(s))
    data = {name: np.isin(numbers, nodes).astype(np.int32) for name, nodes in sets.items()}
    mesh = meshio.Mesh(1e3 * points.reshape(-1, 3), [("hexahedron", cells)], point_data=data)
    mesh.write(density.file)


def cable(angle: float, torque: float) -> str:
    """Return the load of a tendon at an angle [deg]."""
    s = np.linspace(0.0, END_OF_TENDONS, EYELETS)
    offset = TENDON_OFFSET - TENDON_TAPER * s
    x, z = np.sin(np.radians(angle)) * offset, -np.cos(np.radians(angle)) * offset
    places = 1e3 * np.stack([x, -s, z], axis=1)
    eyelets = ", ".join("[{:.4f} mm, {:.4f} mm, {:.4f} mm]".format(*place) for place in places)
    return (
        f"{{kind: pulled_cable, eyelets: [{eyelets}], tension: {torque / SPOOL:.6g} N, "
        "profile: {kind: ramp, value: 1, duration: 1 s}}"
    )


def case(pose: Pose, density: Density) -> Case:
    """Return the case of a pose."""
    pulls = [
        f"tendon_{k}: {cable(angle, torque)}"
        for k, (angle, torque) in enumerate(zip(TENDONS, pose.torques, strict=True), 1)
        if torque > 0.0
    ]
    overrides = (
        f"bodies.tentacle.mesh.file={density.file.name}",
        f"loads={{{', '.join(pulls)}}}",
    )
    return Case(f"{pose.name}, {density.elements} elements in a section", str(SCENE), overrides)


def cases() -> list[Case]:
    """Return all poses and one on a finer mesh."""
    for density in (COARSE, FINE):
        write_mesh(density)
    return [*(case(pose, COARSE) for pose in POSES.values()), case(POSES[REFINED], FINE)]


@cache
def measured() -> dict[str, np.ndarray]:
    """Return pose -> positions of the markers (4, 3) [m] from the centre of the base, y upwards."""
    found = {}
    with (DATA / "markers_static.csv").open(encoding="utf-8", newline="") as stream:
        for line in csv.DictReader(stream):
            if line["file"] in POSES:
                order = POSES[line["file"]].order
                *markers, base = (
                    np.array([float(line[f"m{k}_{axis}_m"]) for axis in "xyz"]) for k in order
                )
                found[line["file"]] = (np.array(markers) - base - BASE) * (1.0, -1.0, -1.0)
    return found


def predicted(outcome: Outcome, density: Density, row_number: int = -1) -> np.ndarray:
    """Return the same from an equilibrium of a run, the last by default; NaN if it failed."""
    history = outcome.history
    if outcome.failure or not history:
        return np.full((4, 3), np.nan)

    def moved(name: str) -> np.ndarray:
        return np.array([history[f"{name}_{axis}"][row_number] for axis in "xyz"])

    found = []
    for k, (station, arm) in enumerate(zip(STATIONS, ARMS, strict=True), 1):
        if station < LENGTH:
            width = 2.0 * widening(4 * density.side) * np.interp(station, *RADII)
            direction = moved(f"m{k}_side") - moved(f"m{k}_other") + (width, 0.0, 0.0)
        else:
            direction = moved(f"m{k}") - moved(f"m{k}_above")
            direction[1] -= density.layers[-1] - density.layers[-2]
        place = moved(f"m{k}") - (0.0, station, 0.0)
        found.append(place + arm * direction / np.linalg.norm(direction))
    return np.array(found)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Yield each pose, and the two meshes."""
    band = f"{percent(BAND)} of the length"
    for name, pose in POSES.items():
        outcome = outcomes[case(pose, COARSE).name]
        markers = predicted(outcome, COARSE)
        away = np.linalg.norm(markers - measured()[name], axis=1)
        verdict = below(float(away.max()), BAND * LENGTH).verdict
        tips = [
            "tip at ({:.0f}, {:.0f}, {:.0f}) mm".format(*(1e3 * place[-1]))
            for place in (measured()[name], markers)
        ]
        worst = percent(float(away.max()) / LENGTH)
        error = f"markers {shown_list(1e3 * away, 'mm')} away; {worst}"
        fitted = ", in the authors' fit" if pose.fitted else ""
        finding = Finding(tips[1], verdict)
        yield row(None, f"{pose.name}{fitted}", tips[0], finding, [outcome], error, band)
    pair = [(outcomes[case(POSES[REFINED], density).name], density) for density in (COARSE, FINE)]
    coarse, fine = (predicted(outcome, density) for outcome, density in pair)
    away = float(np.linalg.norm(coarse - fine, axis=1).max())
    finding = below(1e3 * away, 1e3 * BAND_OF_MESHES * LENGTH, "mm")
    error, band = percent(away / LENGTH), f"{percent(BAND_OF_MESHES)} of the length"
    claim = f"markers of two meshes, {POSES[REFINED].name}, largest distance"
    yield row(None, claim, "0", finding, [outcome for outcome, _ in pair], error, band)


def rod(torques: tuple[float, float], with_anchor: bool) -> np.ndarray:
    """Return the same of a rod of linear elasticity, which bends in a plane.

    with_anchor: it does not bend in the stiff layer. Fixed-point iteration on the angles of links.
    """
    ds = LENGTH / LINKS
    s = ds * (np.arange(LINKS) + 0.5)
    radius = np.interp(s, *RADII)
    area, second_moment = np.pi * radius**2, np.pi * radius**4 / 4.0
    pulled = s < END_OF_TENDONS
    rigid = pulled & (s > END_OF_TENDONS - ANCHOR) & with_anchor
    tensions = np.array(torques) / SPOOL
    directions = np.array([(np.sin(a), 0.0, -np.cos(a)) for a in np.radians(TENDONS)])
    sum_of_pulls = tensions @ directions
    pull = float(np.linalg.norm(sum_of_pulls))
    across, down = sum_of_pulls / pull, np.array([0.0, -1.0, 0.0])
    link_weight = DENSITY * GRAVITY * area * ds

    def from_tip(values: np.ndarray) -> np.ndarray:
        return values[::-1].cumsum()[::-1]

    angle = np.zeros(LINKS)
    for _ in range(600):
        force = from_tip(link_weight) * np.cos(angle) - pulled * tensions.sum()
        length = ds * (1.0 + force / (MODULUS * area))
        away = np.cumsum(length * np.sin(angle))
        moment = pulled * pull * (TENDON_OFFSET - TENDON_TAPER * s)
        moment -= from_tip(link_weight * away) - away * from_tip(link_weight)
        curvature = np.where(rigid, 0.0, moment / (MODULUS * second_moment))
        angle = 0.5 * (angle + np.cumsum(curvature * ds))
    places = np.outer(away, across) + np.outer(np.cumsum(length * np.cos(angle)), down)
    found = []
    for station, arm in zip(STATIONS, ARMS, strict=True):
        k = min(int(station / ds), LINKS - 1)
        tangent = np.sin(angle[k]) * across + np.cos(angle[k]) * down
        normal = np.cos(angle[k]) * across - np.sin(angle[k]) * down
        x_of_section = np.array([1.0, 0.0, 0.0]) + across[0] * (normal - across)
        found.append(places[k] + arm * (x_of_section if station < LENGTH else tangent))
    return np.array(found)


def strains_at_end(torques: tuple[float, float]) -> tuple[float, float]:
    """Return the strains of linear theory at the end of the tendons: of the axis, of bending."""
    tensions = np.array(torques) / SPOOL
    directions = np.array([(np.sin(a), -np.cos(a)) for a in np.radians(TENDONS)])
    radius = float(np.interp(END_OF_TENDONS, *RADII))
    moment = np.linalg.norm(tensions @ directions) * (TENDON_OFFSET - TENDON_TAPER * END_OF_TENDONS)
    section = MODULUS * np.pi * radius**2  # E A; E I = E A radius^2 / 4
    return float(tensions.sum() / section), float(4.0 * moment / (section * radius))


def listings(outcomes: Outcomes) -> Iterator[Listing]:
    """Yield the tips of the solid, of the rod of linear elasticity, and the measured one."""

    def away(markers: np.ndarray, others: np.ndarray) -> str:
        return shown(1e3 * float(np.linalg.norm(markers[-1] - others[-1])), "mm")

    lines = []
    for name, pose in POSES.items():
        outcome = outcomes[case(pose, COARSE).name]
        weak = (0.2 * pose.torques[0], 0.2 * pose.torques[1])
        lines.append((
            pose.name,
            away(predicted(outcome, COARSE), measured()[name]),
            away(rod(pose.torques, True), measured()[name]),
            away(rod(pose.torques, False), measured()[name]),
            away(rod(pose.torques, True), rod(pose.torques, False)),
            away(predicted(outcome, COARSE), rod(pose.torques, True)),
            away(predicted(outcome, COARSE, 1), rod(weak, True)),
            *(percent(strain) for strain in strains_at_end(pose.torques)),
        ))  # fmt: skip
    headings = (
        "pose", "solid from measured", "rod with stiff layer from measured",
        "rod without it from measured", "rod with the layer from rod without it",
        "solid from rod", "solid from rod with a fifth of the torques",
        "tension / (E A) at the end of the tendons", "moment x radius / (E I) there",
    )  # fmt: skip
    title = "Distance of the tip marker; added after the run, not judged"
    yield Listing(title, headings, tuple(lines))


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Draw the markers from two sides: measured as circles, predicted as crosses."""
    with drawing(path, 3.7) as figure:
        panels = figure.subplots(1, 2, sharey=True, width_ratios=(4.0, 2.2))
        for axes, axis, limits in zip(panels, (2, 0), ((-200, 200), (-20, 200)), strict=True):
            for (name, pose), colour in zip(POSES.items(), COLOURS, strict=False):
                found = 1e3 * predicted(outcomes[case(pose, COARSE).name], COARSE)
                given = 1e3 * measured()[name]
                pairs = np.stack([given, found])
                axes.plot(pairs[..., axis], pairs[..., 1], "-", color=colour, linewidth=0.8)
                axes.plot(given[:, axis], given[:, 1], "o", color=colour, markerfacecolor="none")
                axes.plot(found[:, axis], found[:, 1], "x", color=colour)
                axes.plot([], [], "s", color=colour, label=pose.name)
            axes.set(xlabel=f"{'xyz'[axis]} [mm]", xlim=limits, ylim=(-350, -60), aspect="equal")
        first = figure.axes[0]
        first.set_ylabel("height [mm]")
        first.plot([], [], "o", color=INK, markerfacecolor="none", label="measured")
        first.plot([], [], "x-", color=INK, linewidth=0.8, label="predicted")
        handles = first.get_legend_handles_labels()
        figure.legend(*handles, loc="outside upper center", ncols=4)


SCRIPT = Script(
    name=NAME,
    figure="tud-phi/soromox, system identification of a soft tentacle",
    about=__doc__,
    cases=cases,
    rows=rows,
    draw=draw,
    listings=listings,
    evidence=PUBLISHED,
    data=DATA,
)

if __name__ == "__main__":
    command([SCRIPT])
