"""Compression waves along a bar: speed between two stations, by cross-correlation.

One end is pushed by a pulse of the velocity v (1 - cos(2 pi t / T)) / 2, which travels on as a
pulse of length l = c T; v / c = 1e-4, so all is linear. A wave of wave number k is slower than a
long one by a share that falls with k^2: through lateral inertia (a free bar: nu^2 k^2 / 2 times
the squared polar radius of gyration of the section, Rayleigh) and in the mesh, through lumped mass
by (k a)^2 / 24, through pressure averaged twice, over elements and over nodes, by (k a)^2 / 8.
Differentiated, this pulse has the one wave number k = 2 pi / l, and the delay at which the signals
of the stations are most alike is that of k.
"""

import numpy as np
import pytest
import structural_forms

SHEAR_MODULUS, KAPPA, DENSITY = 72e3, 20.0 * 72e3, 1000.0
E = 9.0 * KAPPA * SHEAR_MODULUS / (3.0 * KAPPA + SHEAR_MODULUS)
NU = E / (2.0 * SHEAR_MODULUS) - 1.0
HEIGHT, LENGTH = 1e-3, 100e-3
STATIONS = 20e-3, 60e-3

MESHES = {
    "plane_strain": "{generator: block, length: 100 mm, height: 1 mm, element_size: 0.5 mm}",
    "solid": "{generator: box, length: 100 mm, height: 1 mm, width: 1 mm, element_size: 1 mm}",
}
ELEMENT_SIZE = {"plane_strain": 0.5e-3, "solid": 1e-3}
MORE = {"plane_strain": "plane_strain, thickness: 1 mm", "solid": "solid"}
SIDES = {
    "plane_strain": {"bottom": "y", "top": "y"},
    "solid": {"bottom": "y", "top": "y", "back": "z", "front": "z"},
}

CONFINED = structural_forms.confined_wave_speed(KAPPA, SHEAR_MODULUS, DENSITY)
# Formulation and sides -> speed of a long wave, and nu^2 / 2 times the squared radius of gyration.
CASES = {
    ("plane_strain", "free"): (
        structural_forms.plane_strain_bar_wave_speed(E, NU, DENSITY),
        (NU / (1.0 - NU) * HEIGHT) ** 2 / 24.0,
    ),
    ("plane_strain", "confined"): (CONFINED, 0.0),
    ("solid", "free"): (structural_forms.bar_wave_speed(E, DENSITY), (NU * HEIGHT) ** 2 / 12.0),
    ("solid", "confined"): (CONFINED, 0.0),
}


def bar(formulation, sides, duration, speed):
    """The scene of a bar whose left end is pushed by the pulse."""
    t = np.linspace(0.0, duration, 129)
    u = 0.5 * speed * (t - duration / (2.0 * np.pi) * np.sin(2.0 * np.pi * t / duration))
    points = ", ".join(f"[{1e6 * a:.9g} us, {1e9 * b:.9g} nm]" for a, b in zip(t, u, strict=True))
    held = SIDES[formulation] if sides == "confined" else {}
    symmetries = "".join(
        f"  {side}: {{kind: symmetry, nodes: bar.{side}, normal: {axis}}}\n"
        for side, axis in held.items()
    )
    return f"""
bodies:
  bar: {{mesh: {MESHES[formulation]}, formulation: {MORE[formulation]}, material: rubber}}
materials: {{rubber: {{law: neo_hooke, C10: 36 kPa, density: 1000 kg/m^3}}}}
environment: {{gravity: 0 m/s^2}}
solver: {{bulk_viscosity: 0}}
time: {{end: 1 s}}
conditions:
  push: {{kind: prescribed, nodes: bar.left, direction: x,
         displacement: {{kind: table, points: [{points}]}}}}
{symmetries}"""


def delay(near, far):
    """Samples by which two signals are most alike, with the top of the parabola through three."""
    likeness = np.correlate(far, near, "full")
    k = int(np.argmax(likeness))
    before, most, after = likeness[k - 1 : k + 2]
    return k - (len(near) - 1) + 0.5 * (before - after) / (before - 2.0 * most + after)


@pytest.mark.parametrize(("formulation", "sides"), list(CASES))
def test_wave_speed(build, start, record_verification, formulation, sides):
    """Waves 30 times the height long: off by no more than they are dispersed; waves half as long
    are off four times as much.
    """
    exact, inertia = CASES[formulation, sides]
    lengths = np.array([15e-3, 30e-3])
    models = [build(bar(formulation, sides, length / exact, 1e-4 * exact)) for length in lengths]
    x = models[0].points[:, 0] - models[0].points[:, 0].min()
    stations = [np.flatnonzero(np.abs(x - place) < 1e-9) for place in STATIONS]
    solver = start(*models)
    every = max(1, int(lengths.min() / exact / 100.0 / solver.time_increment))
    seen = []
    # Until both pulses have passed; what the far end reflects is not back yet.
    while solver.time < (STATIONS[1] + 1.3 * lengths.max()) / exact:
        solver.advance(every)
        moved = (solver.positions() - models[0].points)[:, :, 0]
        seen.append([moved[:, nodes].mean(axis=1) for nodes in stations])
    near, far = np.diff(np.array(seen), axis=0).transpose(1, 2, 0)
    passed = [delay(*signals) for signals in zip(near, far, strict=True)]
    speeds = (STATIONS[1] - STATIONS[0]) / (np.array(passed) * every * solver.time_increment)
    errors = speeds / exact - 1.0
    k = 2.0 * np.pi / lengths
    assert (np.abs(errors) < inertia * k**2 + (k * ELEMENT_SIZE[formulation]) ** 2 / 6.0).all()
    order = np.log2(errors[0] / errors[1])
    record_verification(f"wave speed [m/s], {formulation}, {sides}", exact, speeds[1], order)
    assert order == pytest.approx(2.0, abs=0.3)
