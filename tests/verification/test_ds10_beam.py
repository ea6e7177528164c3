"""A measured beam of Dragon Skin 10: drop under its weight and a load, frequency, decay.

30 x 30 x 100 mm, clamped at one end, released from the horizontal, alone and with 52 g (0.510 N) at
its tip; motion capture of three markers near the tip (Dubied et al., arXiv 2201.12560, MIT licence;
files outside the project, see the fixture `measured`). Half of it is modelled: z is across, the
plane z = 15 mm one of symmetry.

One material for all figures:
- spectrum: that of the material library, measured on Ecoflex 00-30, carried over. At 7.7 Hz its
  loss factor is 0.104 and its storage modulus 1.23 times the long-term one; 0.089 and 1.19 at
  4.3 Hz. So the beam is stiffer when it swings than at rest, without another constant.
- LONG_TERM = 247 kPa, the only constant chosen here, 6 % below the 263.8 kPa of the source's COMSOL
  model of the beam at rest. The figures do not agree on it. Less what the mesh does (drops 4.5 %
  too small, frequencies 2.4 % too high), they ask for a beam stiffer by 9 % (own weight at rest)
  and 1 % (load at rest), softer by 6 and 7 % (swings): with this spectrum rest and swing disagree
  by 11 % in stiffness, 3.5 % of it because the real beam still creeps when its rest is measured,
  after 4.5 s, and the model's is done. With 263.8 kPa the drops are -2.4 and -9.7 % off, the
  frequencies +9 %; with the library's dragon_skin_10 (E = 216 kPa) +23 and +13 %, -3.5 and -2.3 %.
- 1070 kg/m^3; Poisson's ratio 0.49 for "nearly incompressible": a beam bends by E, and 0.499 would
  halve the time step. C10 = E / (4 (1 + nu)).

What the model cannot have. (1) The real beam creeps on: in its first half second it swings about
6.1 and 15.9 mm, four seconds later it rests at 6.5 and 17.0 mm, 7 % more (the spectrum says 5 %),
where branches fitted above 2 Hz are done within half a second. (2) The load adds 10.5 mm to the
6.5 mm of the beam's own weight, 1.61 times as much. Elastica with shear has 1.36, FElupe 1.40, so
do we; the source's COMSOL 1.50: the load may have hung beyond the tip, or the silicone is softer at
the 8 % of strain that the load brings than at the 4 % of the weight.
"""

import io
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import structural_forms
from rich.console import Console

REFERENCE = Path(__file__).resolve().parents[3] / "shared" / "reference" / "ds10_beam"
LENGTH, SIDE, DENSITY = 0.1, 0.03, 1070.0
E, NU = 263.8e3, 0.49  # the source's, of the beam at rest
LONG_TERM = "materials.rubber.C10=%r Pa" % (247e3 / (4.0 * (1.0 + NU)))
LOAD = 0.052
# Size [mm] and overrides. Four hexahedra through the height bend as eight bricks of tetrahedra.
TETRAHEDRA = (3.75,)
HEXAHEDRA = (7.5, "bodies.beam.mesh.cells=quad")
MESHES = pytest.mark.parametrize("mesh", [TETRAHEDRA, HEXAHEDRA], ids=["simplex", "quad"])

BEAM = f"""
bodies:
  beam: {{mesh: {{generator: box, length: 100 mm, height: 30 mm, width: 15 mm, element_size: 5 mm}},
         formulation: solid, material: rubber, fixed: [left]}}
materials:
  rubber: {{law: neo_hooke, C10: {E / (4.0 * (1.0 + NU))} Pa, poisson_ratio: {NU},
           density: {DENSITY} kg/m^3,
           spectrum: {{kind: fractional, relaxation_time: 330 us, order: 0.32,
                      band: [2 Hz, 5 kHz]}}}}
conditions:
  middle: {{kind: symmetry, nodes: beam.front, normal: z}}
time: {{end: 0.3 s, procedure: static}}
output:
  probes: {{tip: {{kind: displacement, nodes: beam.right}},
           clamp: {{kind: reaction, nodes: beam.left}}}}
"""
# Half of it, on the half that is modelled.
HANGING = f"  load: {{kind: point_mass, nodes: beam.right, mass: {0.5 * LOAD} kg}}\n"
LOADED_BEAM = BEAM.replace("\ntime:", f"\n{HANGING}time:")


@pytest.fixture
def run(kernel_cache, monkeypatch, write_scene, tmp_path):
    """Run the beam, alone or loaded, with elements of a size [mm], quietly on the CPU."""
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    from softsim.run import run as run_scene

    def quiet(is_loaded, size, *overrides):
        scene = write_scene(LOADED_BEAM if is_loaded else BEAM)
        overrides = [f"bodies.beam.mesh.element_size={size} mm", *overrides]
        console = Console(file=io.StringIO())
        return run_scene(scene, overrides, tmp_path / "out", "cpu", console=console)

    return quiet


class Swing(NamedTuple):
    """Frequency [Hz] and damping ratio of a free decay."""

    frequency: float
    damping_ratio: float


SWINGS = 8
"""Half periods that count, from the second extreme on: the first one depends on how the beam was
let go."""


def swing(t: np.ndarray, z: np.ndarray) -> Swing:
    """From the extremes of z(t), equally spaced, each by the parabola through three samples.

    The swings between successive extremes, which a slow creep leaves alone, decay by
    exp(-pi zeta / sqrt(1 - zeta^2)).
    """
    turns = np.sign(np.diff(z))
    k = np.flatnonzero(turns[:-1] * turns[1:] < 0.0) + 1
    slope, bend = 0.5 * (z[k + 1] - z[k - 1]), z[k + 1] - 2.0 * z[k] + z[k - 1]
    times = (t[k] - slope / bend * (t[1] - t[0]))[1 : SWINGS + 2]
    extremes = (z[k] - 0.5 * slope**2 / bend)[1 : SWINGS + 2]
    decay = -np.polyfit(np.arange(SWINGS), np.log(np.abs(np.diff(extremes))), 1)[0]
    return Swing(0.5 * SWINGS / (times[-1] - times[0]), decay / np.hypot(np.pi, decay))


class Measured(NamedTuple):
    """Markers (3, 3) at the start, in the model's axes [m]; of the two runs: how far they dropped
    at the end [m], and how they swung.
    """

    markers: np.ndarray
    drops: np.ndarray
    swings: list[Swing]

    @property
    def drop(self) -> float:
        """Mean of the runs and markers [m]."""
        return float(self.drops.mean())

    @property
    def frequency(self) -> float:
        """Mean of the runs [Hz]."""
        return float(np.mean([s.frequency for s in self.swings]))

    @property
    def damping_ratio(self) -> float:
        """Mean of the runs."""
        return float(np.mean([s.damping_ratio for s in self.swings]))


@pytest.fixture(params=["gravity", "load52"])
def measured(request):
    """Name and measurement of the beam alone and of the loaded one."""
    if not REFERENCE.is_dir():
        pytest.skip(f"the measured beam is not here: {REFERENCE}")
    drops, swings, markers = [], [], []
    for file in sorted(REFERENCE.glob(f"beam_{request.param}_V2_*_tip_mm.csv")):
        table = np.genfromtxt(file, delimiter=",")
        t, places = table[:, 0], 1e-3 * table[:, 1:].reshape(-1, 3, 3)
        start = places[t <= 0.0].mean(axis=0)
        height = places[:, :, 2].mean(axis=1) - start[:, 2].mean()
        drops.append(-height[-50:].mean())  # the last half second
        swings.append(swing(t[t > 0.0], height[t > 0.0]))
        markers.append(start)
    assert len(drops) == 2
    # Theirs: x from -100 mm at the clamp, y across, z up. Ours: x from the clamp, y up, z across.
    x, across, up = np.mean(markers, axis=0).T
    return request.param == "load52", Measured(
        np.column_stack([x + LENGTH, up, across]), np.array(drops), swings
    )


def marker_drop(folder, markers):
    """Mean drop [m] of markers that move with the tip's face as a rigid body."""
    from softsim.output.fields import read_frames

    frames = read_frames(folder / "results.vtkhdf")
    tip = np.flatnonzero(frames.points[:, 0] > LENGTH * (1.0 - 1e-9))
    rest = frames.points[tip, :2]
    now = rest + frames.point_data["displacement"][-1][tip, :2]
    a, b = rest - rest.mean(axis=0), now - now.mean(axis=0)
    angle = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    c, s = np.cos(angle), np.sin(angle)
    arm = markers[:, :2] - rest.mean(axis=0)
    place = now.mean(axis=0) + arm @ np.array([[c, s], [-s, c]])
    return float((markers[:, 1] - place[:, 1]).mean())


def test_the_clamp_carries_the_weight(run, build, record_verification):
    """At rest the clamp holds beam and load against gravity, which pulls at point masses too.

    Tolerance: the forces balance to 1e-5 of the inner forces, which are some ten times the weight
    (its moment has the lever of the beam's length, they that of its height).
    """
    model = build(LOADED_BEAM, "bodies.beam.mesh.element_size=10 mm")
    assert model.mass.sum() == pytest.approx(0.5 * (DENSITY * LENGTH * SIDE**2 + LOAD), rel=1e-12)
    weight = 9.81 * model.mass.sum()
    found = run(True, 10.0).summary["probes"]["clamp_y"]
    record_verification("DS10 beam, loaded: reaction of the clamp", weight, found)
    assert found == pytest.approx(weight, rel=1e-3)


@pytest.mark.slow
def test_the_beam_at_rest_converges_to_another_program(run, record_verification):
    """Half the beam at rest by FElupe, the same constants, 16 x 6 x 3 bricks of 27 nodes: 6.64 mm
    alone, 15.93 mm loaded (12 x 4 x 2 bricks: 6.54 and 15.74: some 1 % is still to come).

    4 and 8 rows of linear tetrahedra lie 15 % and 4 % under that, second order; extrapolated so,
    they agree within 2 %, and so do 4 rows of hexahedra as they are (-1.2 and -1.1 %). Elastica
    with Timoshenko's shear, whose clamp does not hold the section's width, drops a tenth further.
    """
    for is_loaded, felupe in ((False, 6.636e-3), (True, 15.929e-3)):
        drops = [-run(is_loaded, size).summary["probes"]["tip_y"] for size in (7.5, 3.75)]
        extrapolated = drops[1] + (drops[1] - drops[0]) / 3.0
        name = "loaded" if is_loaded else "own weight"
        record_verification(f"DS10 beam against FElupe, {name}", felupe, extrapolated)
        assert extrapolated == pytest.approx(felupe, rel=0.02)
        found = -run(is_loaded, *HEXAHEDRA).summary["probes"]["tip_y"]
        record_verification(f"DS10 beam against FElupe, {name}, hexahedra", felupe, found)
        assert found == pytest.approx(felupe, rel=0.02)
        bending, area = E * SIDE**4 / 12.0, SIDE**2
        force, weight = LOAD * 9.81 * is_loaded, DENSITY * area * 9.81
        sag = structural_forms.elastica_sag(LENGTH, bending, weight, force).drop
        shear = structural_forms.rectangle_shear_coefficient(NU) * E / (2.0 * (1.0 + NU)) * area
        sag += (0.5 * weight * LENGTH + force) * LENGTH / shear
        assert 0.85 * sag < extrapolated < sag


TOO_FAR = pytest.mark.xfail(
    strict=True,
    reason="7 % too far: LONG_TERM, which tetrahedra make up for, is 9 % too soft at rest",
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("measured", "mesh"),
    [
        ("gravity", TETRAHEDRA),
        ("load52", TETRAHEDRA),
        ("load52", HEXAHEDRA),
        pytest.param("gravity", HEXAHEDRA, marks=TOO_FAR),
    ],
    indirect=["measured"],
)
def test_the_beam_drops_as_measured(run, measured, mesh, record_verification):
    """The markers at rest, tetrahedra of 3.75 mm, whose drop is 4 to 5 % too small, and hexahedra
    of 7.5 mm, 1 %.

    Found with tetrahedra: own weight +4.2 % (5 % allowed: the mesh; the two runs differ by 2 %),
    loaded -3.8 % (12 % allowed: the mesh, and remark (2) above, which costs 6 % with any program).
    With hexahedra: +7.4 %, a miss, and -0.6 %.
    """
    is_loaded, beam = measured
    results = run(is_loaded, *mesh, LONG_TERM)
    found = marker_drop(results.folder, beam.markers)
    name = "loaded" if is_loaded else "own weight"
    record_verification(f"DS10 beam measured, {name}: drop, {mesh[0]} mm", beam.drop, found)
    assert found == pytest.approx(beam.drop, rel=0.12 if is_loaded else 0.05)


def swung(run, is_loaded, mesh):
    """How the beam swings, let go from the horizontal; and the run."""
    end = "1.4 s" if is_loaded else "0.8 s"
    results = run(is_loaded, *mesh, LONG_TERM, "time.procedure=dynamic", f"time.end={end}")
    t = np.arange(0.0, results.history["time"][-1], 2e-3)
    return swing(t, np.interp(t, results.history["time"], results.history["tip_y"])), results


@pytest.mark.slow
@MESHES
def test_the_beam_swings_as_measured(run, measured, mesh, record_verification):
    """The frequency by the same fit to both curves: found +5.2 % and +5.9 % with tetrahedra, of
    which the mesh makes 2.4 % (a drop 5 % too small), +3.5 and +4.1 % with hexahedra; 6 % are
    allowed.
    """
    is_loaded, beam = measured
    found, results = swung(run, is_loaded, mesh)
    name = "DS10 beam measured, " + ("loaded" if is_loaded else "own weight")
    record_verification(f"{name}: frequency, {mesh[0]} mm", beam.frequency, found.frequency)
    assert found.frequency == pytest.approx(beam.frequency, rel=0.06)
    assert results.summary["energy_error"] < 1e-3


MISSED = pytest.mark.xfail(
    strict=True, reason="15.05 % too small: the spectrum's loss factor is 0.09 at 4.5 Hz, not 0.11"
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("measured", "mesh"),
    [
        ("gravity", TETRAHEDRA),
        ("gravity", HEXAHEDRA),
        pytest.param("load52", TETRAHEDRA, marks=MISSED),
        ("load52", HEXAHEDRA),
    ],
    indirect=["measured"],
)
def test_the_beam_decays_as_measured(run, measured, mesh, record_verification):
    """Damping ratio, found 0.0557 and 0.0475 (hexahedra: 0.0560 and 0.0479), from a spectrum that
    knows nothing of this beam. The fit has 0.054 and 0.057 for the two runs of the beam alone,
    0.059 and 0.053 loaded: +0.1 %, and -15.05 %, just missed (the source gives 0.05 for both).
    They scatter by 6 %; 15 % are allowed.
    """
    is_loaded, beam = measured
    found, _ = swung(run, is_loaded, mesh)
    name = "DS10 beam measured, " + ("loaded" if is_loaded else "own weight")
    record_verification(
        f"{name}: damping ratio, {mesh[0]} mm", beam.damping_ratio, found.damping_ratio
    )
    assert found.damping_ratio == pytest.approx(beam.damping_ratio, rel=0.15)
