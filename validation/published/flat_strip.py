"""Waves in a clamped strip of Ecoflex 00-30, flat and inflated, predicted from a slow tension.

Protocol. Data: flexural waves along a strip, 10 mm wide between its clamps and 0.77 mm thick, in
air (group of Eddi, Prada, Lemoult and others, arXiv 2507.17698): wave number k over frequency at
seven points from 92.5 to 397.5 Hz, and the frequency below which no wave was seen, 82 and 92 Hz for
two strips, which differ by 8 to 14 %. The figures stand in this script; no data file is needed.

Constants: Yeoh's law with C10 = 11.0 kPa and C20 = 0.0225 kPa, the library's
ecoflex_00_30_typical. It is a fit to the slow tension of a long strip (arXiv 2603.18839). How much
stiffer the silicone is at a frequency comes from the fractional spectrum that the library has for
all silicones (330 us, 0.32). Density 1070 kg/m^3. Nothing is fitted to the waves.

Prediction: hexahedra in space, Poisson ratio 0.495, both long edges clamped over the whole
thickness. A piece of the length pi / k between two planes of symmetry holds half a wave, so that a
natural mode of the piece is the wave of this k. Modes about the static equilibrium, whose dynamic
frequencies have the modulus of the spectrum. Mesh: 4 hexahedra through the thickness, 32 across
the width, 10 along half a wave. Air is left out; it adds about 1 % to the mass.

Band: 14 %, the difference of the two strips, for the frequency at each k and for the lowest one
(87 Hz, the mean of both). Also for the lowest one of the strip stretched across by 1.09 and 1.26
(142 and 192 Hz); it is assumed that 10 mm is the width between the clamps before they move apart,
and that the clamps hold the thickness. The mesh is fine enough if two thirds of its numbers of
elements change the frequencies by less than 3 %.

Inflated: pressure on one face, air on both sides. Predicted, without a measurement at hand: the
lowest frequency at which waves propagate at 196, 490 and 785 Pa, which is the smallest over all
waves with even and odd deflection across the width and k from 0 to 314 1/m (pieces of 30, 20, 15,
12 and 10 mm with at most one half wave). The band holds the frequency of the same wave with two
other sets of constants: those of the waves' authors (Mooney-Rivlin, 23 kPa with C01 / (C10 + C01) =
0.29, 330 us, 0.32) and of Delory et al., doi 10.1039/D3SM01485A (27.8 kPa with the same ratio, 260
us, 0.27). To each side it is widened by half the difference of the two strips, 7 %.

Changed after the first runs, in the inflated part alone, because the mesh along the strip was too
coarse for waves with several half waves in ten hexahedra: up to eight of them gave 131, 169 and 192
Hz, two gave 147, 198 and 228 Hz. With 20 hexahedra along a half wave, the slowest wave has k = 0
and 148, 200 and 231 Hz.
"""

import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from softsim.compute.machine import Choice
from softsim.report.style import BLUE, ORANGE, drawing
from softsim.run.equilibrium import LoadRange, Preloaded, scene_with_loads
from softsim.statics.modes import LoadedMode
from validation.cases import Outcomes
from validation.command import command
from validation.digitised import Points
from validation.script import PUBLISHED, Script
from validation.verdicts import UNKNOWN, Finding, Row, below, percent, row, shown, signed, within

NAME = "flat_strip"
WIDTH, THICKNESS = 10e-3, 0.77e-3  # m
WAVES = (
    (46.0, 92.5), (103.0, 97.5), (173.0, 107.5), (259.0, 122.5), (355.0, 142.5), (636.0, 247.5),
    (993.0, 397.5),
)  # fmt: skip
"""Measured wave numbers [1/m] and frequencies [Hz]."""

LOWEST = 87.0  # Hz
BAND, BAND_OF_MESHES, HALF_DIFFERENCE = 0.14, 0.03, 0.07
STRETCHED = ((1.09, 142.0), (1.26, 192.0))
"""Stretch across the strip, and the lowest measured frequency [Hz]."""

PRESSURES = (196.0, 490.0, 785.0)  # Pa
PIECES = (30e-3, 20e-3, 15e-3, 12e-3, 10e-3)  # m, inflated
MOST_HALF_WAVES = 1
"""Largest number of half waves in an inflated piece whose waves are compared."""

TYPICAL = "law: yeoh, C10: 11.0 kPa, C20: 0.0225 kPa"
CONSTANTS = {
    "typical": (TYPICAL, (330, 0.32)),
    "authors": ("law: mooney_rivlin, C10: 8.165 kPa, C01: 3.335 kPa", (330, 0.32)),
    "Delory": ("law: mooney_rivlin, C10: 9.869 kPa, C01: 4.031 kPa", (260, 0.27)),
}
"""Law, and relaxation time [us] and order of the spectrum, by name."""

FINE, COARSE = (10, 4, 32), (7, 3, 21)
"""Hexahedra along half a wave, through the thickness and across the width."""

COUNT = 8
"""Number of modes of a piece."""

SPAN = 15e-3  # m, of the piece that is stretched

SCENE = """
title: Piece of a clamped strip
bodies:
  strip: {{mesh: {{file: strip.inp, length_unit: 1 m}}, formulation: solid, material: silicone,
          fixed: [held]}}
materials:
  silicone: {{{law}, poisson_ratio: 0.495, density: 1070 kg/m^3,
             spectrum: {{kind: fractional, relaxation_time: {time} us, order: {order},
                        band: [2 Hz, 5 kHz]}}}}
conditions:
  begin: {{kind: symmetry, nodes: strip.begin, normal: x}}
  end: {{kind: symmetry, nodes: strip.end, normal: x}}
  clamp: {{kind: fixed, nodes: strip.moved, directions: [x, y]}}
  pull: {{kind: prescribed, nodes: strip.moved, direction: z,
         displacement: {{kind: ramp, value: {pull} m, duration: 1 s}}}}
loads:
  air: {{kind: follower_pressure, facets: [strip.face],
        profile: {{kind: ramp, value: 1 Pa, duration: 1 s}}}}
environment: {{gravity: 0 m/s^2}}
time: {{end: 1 s}}
"""


class Wave(NamedTuple):
    """Standing wave: length of the piece [m], number of half waves in it, whether its deflection is
    even across the width, and frequency [Hz].
    """

    length: float
    half_waves: int
    is_even: bool
    frequency: float

    @property
    def k(self) -> float:
        """Wave number [1/m]."""
        return self.half_waves * np.pi / self.length


def _write_scene(
    folder: Path, constants: str, length: float, counts: tuple[int, ...], stretch: float
) -> Path:
    """Write the scene of a piece of a length [m] and its mesh; return the file of the scene."""
    sides = [
        np.linspace(0.0, length, counts[0] + 1),
        np.linspace(0.0, THICKNESS, counts[1] + 1),
        np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, counts[2] + 1),
    ]
    points = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1)
    number = 1 + np.arange(points.size // 3).reshape(points.shape[:3])
    begin, end = np.s_[:-1], np.s_[1:]
    ring = [(begin, begin), (end, begin), (end, end), (begin, end)]
    corners = [number[x, y, z] for z in (begin, end) for x, y in ring]
    cells = np.stack([corner.ravel() for corner in corners], axis=1)
    sets = {
        "held": number[:, :, 0], "moved": number[:, :, -1],
        "begin": number[0], "end": number[-1],
    }  # fmt: skip
    lines = ["*NODE"]
    lines += [
        f"{n}, {x:.9g}, {y:.9g}, {z:.9g}" for n, (x, y, z) in enumerate(points.reshape(-1, 3), 1)
    ]
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=strip")
    lines += [", ".join(map(str, (n, *cell))) for n, cell in enumerate(cells, 1)]
    for name, nodes in sets.items():
        lines += [f"*NSET, NSET={name}", *(f"{n}," for n in nodes.ravel())]
    lowest = 1 + np.arange(len(cells)).reshape(counts)[:, 0].ravel()
    lines += ["*ELSET, ELSET=lowest", *(f"{n}," for n in lowest)]
    lines += ["*SURFACE, TYPE=ELEMENT, NAME=face", "lowest, S3"]
    (folder / "strip.inp").write_text("\n".join(lines) + "\n", encoding="utf-8")
    law, (time, order) = CONSTANTS[constants]
    scene = folder / "strip.yaml"
    scene.write_text(
        SCENE.format(law=law, time=time, order=order, pull=(stretch - 1.0) * WIDTH),
        encoding="utf-8",
    )
    return scene


def _wave(mode: LoadedMode, length: float, counts: tuple[int, ...]) -> Wave | None:
    """Return the wave of a natural mode; None if it moves along the strip rather than across it."""
    shape = mode.shape.reshape(*(n + 1 for n in counts), 3)
    deflection = shape[..., 1].mean(axis=1)
    if np.abs(deflection).max() < 0.5:
        return None
    along = np.arange(counts[0] + 1) / counts[0]
    weights = np.ones(counts[0] + 1)
    weights[[0, -1]] = 0.5
    parts = [
        np.linalg.norm((weights * np.cos(np.pi * n * along)) @ deflection) * (0.5 if n == 0 else 1)
        for n in range(counts[0])
    ]
    is_even = float((deflection * deflection[:, ::-1]).sum()) > 0.0
    half_waves = int(np.argmax(parts))
    return Wave(length, half_waves, is_even, mode.dynamic_frequency)


@cache
def waves(
    constants: str,
    length: float,
    counts: tuple[int, ...] = FINE,
    pressures: tuple[float, ...] = (),
    stretch: float = 1.0,
) -> list[list[Wave]]:
    """Return the lowest waves of a piece of a length [m], at each of these pressures [Pa].

    Without pressures the strip is flat, and may be stretched across.

    Raises StabilityError if no equilibrium is at_pressures.
    """
    with tempfile.TemporaryDirectory() as folder:
        scene = _write_scene(Path(folder), constants, length, counts, stretch)
        over = LoadRange.read(f"air=0..{max(pressures)} Pa", "--over") if pressures else None
        none = [] if pressures else ["loads={}"]
        state = Preloaded(scene_with_loads(scene, none, over=over), Choice("cpu", 1))
        times = [over.fraction_of_time(p) for p in pressures] if over else [float(stretch != 1.0)]
        at_pressures = []
        for time in times:
            state.reach(time * state.end)
            modes = state.vibrations("stick").modes(COUNT).loaded
            at_pressures.append([wave for mode in modes if (wave := _wave(mode, length, counts))])
    return at_pressures


def flexural(k: float, counts: tuple[int, ...] = FINE) -> Wave:
    """Return the lowest even wave of the flat strip with a wave number [1/m]."""
    [found] = waves("typical", np.pi / k, counts)
    return min(
        (w for w in found if w.half_waves == 1 and w.is_even), key=lambda wave: wave.frequency
    )


def lowest(found: list[Wave]) -> Wave:
    """Return the wave of the lowest frequency."""
    return min(found, key=lambda wave: wave.frequency)


@cache
def inflated(pressure: float) -> Wave:
    """Return the lowest wave of all pieces at one of PRESSURES [Pa]."""
    number = PRESSURES.index(pressure)
    pieces = [waves("typical", length, pressures=PRESSURES)[number] for length in PIECES]
    return lowest([w for piece in pieces for w in piece if w.half_waves <= MOST_HALF_WAVES])


@cache
def band_of(pressure: float) -> tuple[float, float]:
    """Return the lowest and the highest predicted frequency [Hz] at one of PRESSURES [Pa]."""
    wave, number = inflated(pressure), PRESSURES.index(pressure)
    frequencies = [
        lowest([w for w in piece[number] if w[:3] == wave[:3]]).frequency
        for piece in (waves(name, wave.length, pressures=PRESSURES) for name in CONSTANTS)
    ]
    return (1.0 - HALF_DIFFERENCE) * min(frequencies), (1.0 + HALF_DIFFERENCE) * max(frequencies)


def rows(outcomes: Outcomes, points: Points | None) -> Iterator[Row]:
    """Yield the frequencies over k, the lowest ones, the two meshes, and the predictions."""
    flat = lowest(waves("typical", np.pi / WAVES[0][0])[0]).frequency
    compared = [(f"frequency at k = {k:g} 1/m", flexural(k).frequency, f) for k, f in WAVES]
    compared.append(("lowest frequency", flat, LOWEST))
    for stretch, frequency in STRETCHED:
        found = lowest(waves("typical", SPAN, stretch=stretch)[0]).frequency
        compared.append((f"lowest frequency, stretched across by {stretch}", found, frequency))
    for claim, found, frequency in compared:
        yield row(
            None, claim, shown(frequency, "Hz"), within(found, frequency, BAND, "Hz"), (),
            signed(found / frequency - 1.0), percent(BAND),
        )  # fmt: skip
    ratios = [flexural(k, COARSE).frequency / flexural(k).frequency - 1.0 for k in (103.0, 993.0)]
    largest = max(ratios, key=abs)
    yield row(
        None, "frequency on a coarser mesh, at k = 103 and 993 1/m", "the same",
        below(100.0 * abs(largest), 100.0 * BAND_OF_MESHES, "% away"), (), signed(largest),
        percent(BAND_OF_MESHES),
    )  # fmt: skip
    for pressure in PRESSURES:
        wave = inflated(pressure)
        low, high = band_of(pressure)
        parity = "even" if wave.is_even else "odd"
        computed = f"{wave.frequency:.3g} Hz ({parity} across, k = {wave.k:.3g} 1/m)"
        yield row(
            None, f"lowest frequency, inflated by {pressure:g} Pa", "not at hand",
            Finding(computed, UNKNOWN), (), "", f"{low:.3g} to {high:.3g} Hz",
        )  # fmt: skip


def draw(outcomes: Outcomes, points: Points | None, path: Path) -> None:
    """Draw the frequency over k of the flat strip, and the lowest one over the pressure."""
    with drawing(path, 2.8) as figure:
        left, right = figure.subplots(1, 2)
        k = np.array([k for k, _ in WAVES])
        found = np.array([flexural(each).frequency for each in k])
        left.plot(k, found, color=BLUE, label="predicted")
        left.fill_between(
            k, found / (1.0 + BAND), found / (1.0 - BAND), color=BLUE, alpha=0.15, linewidth=0,
            label="band",
        )  # fmt: skip
        left.plot(*zip(*WAVES, strict=True), "o", color=ORANGE, label="measured")
        left.set(xlabel="wave number along the strip [1/m]", ylabel="frequency [Hz]", title="flat")
        flat = lowest(waves("typical", np.pi / WAVES[0][0])[0]).frequency
        pressures = (0.0, *PRESSURES)
        line = [flat, *(inflated(p).frequency for p in PRESSURES)]
        bounds = np.array([band_of(p) for p in PRESSURES]).T
        right.fill_between(PRESSURES, *bounds, color=BLUE, alpha=0.15, linewidth=0)
        right.plot(pressures, line, "o-", color=BLUE)
        right.plot(0.0, LOWEST, "o", color=ORANGE)
        right.set(
            xlabel="pressure [Pa]", ylabel="lowest frequency [Hz]", title="inflated",
            ylim=(0.0, None),
        )  # fmt: skip
        figure.legend(loc="outside upper center", ncols=3)


SCRIPT = Script(
    name=NAME,
    figure="arXiv 2507.17698 (waves) and arXiv 2603.18839 (tension)",
    about=__doc__,
    rows=rows,
    draw=draw,
    evidence=PUBLISHED,
)

if __name__ == "__main__":
    command([SCRIPT])
