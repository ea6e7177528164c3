"""Spectra in a scene: what is read, what is refused and where, what stays written."""

import pytest

from softsim.errors import SceneError
from softsim.scene.loading import load_scene

FRACTIONAL = "{kind: fractional, relaxation_time: 330 us, order: 0.32, band: [2 Hz, 5 kHz]}"


@pytest.fixture
def scene_with(write, smallest):
    """A scene file whose material has these lines."""

    def written(*lines):
        material = "".join(f"    {line}\n" for line in lines)
        head = "materials:\n  own:\n    law: neo_hooke\n    C10: 20 kPa\n    density: 1000 kg/m^3\n"
        return write(a=head + material + smallest.replace("dragon_skin_10", "own"))

    return written


def test_options_reach_into_a_spectrum(scene_with):
    path = scene_with(f"spectrum: {FRACTIONAL}")
    changed = ["order=0.27", "relaxation_time=260 us", "band.1=1 kHz", "largest_error=0.02"]
    loaded = load_scene(path, [f"materials.own.spectrum.{each}" for each in changed])
    spectrum = loaded.scene.materials["own"].spectrum
    assert (spectrum.order, spectrum.band, spectrum.largest_error) == (0.27, (2.0, 1000.0), 0.02)
    assert spectrum.relaxation_time == pytest.approx(260e-6)


def test_the_resolved_scene_keeps_what_was_asked(scene_with, write):
    path = scene_with(f"spectrum: {FRACTIONAL}")
    text = load_scene(path).resolved()
    assert "relaxation_time: 330 us  # a.yaml:6" in text
    assert "band: [2 Hz, 5 kHz]" in text and "largest_error: 0.05  # default" in text
    assert load_scene(write(b=text)).scene == load_scene(path).scene


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (["prony: [{g: 0.1, relaxation_time: 1 ms}]", f"spectrum: {FRACTIONAL}"],
         "a.yaml:7:15: spectrum: defines the same property as prony"),
        (["spectrum: {kind: loss_factor, loss_factor: 0.2, band: [2 kHz, 5 Hz]}"],
         "a.yaml:6:59: band: must rise"),
        (["spectrum: {kind: loss_factor, loss_factor: 0.2, band: [2 Hz, 3 GHz]}"],
         "a.yaml:6:59: band: 2 to 3e+09 Hz is too wide to fit: the limit is a factor of 1e+09"),
        (["spectrum: {kind: loss_factor, loss_factor: 0, band: [2 Hz, 5 Hz]}"],
         "a.yaml:6:48: loss_factor: 0 must be greater than 0"),
        (["spectrum: {kind: table, points: [[1 Hz, 60 kPa, 0.1], [1 Hz, 70 kPa, 0.1]]}"],
         "a.yaml:6:37: points: point 1 must have a higher frequency than point 0"),
        (["spectrum: {kind: fractal}"], "a.yaml:6:22: kind: 'fractal' is unknown here"),
        ([f"spectrum: {FRACTIONAL.replace('0.32', '1')}"], "order: 1 must be less than 1"),
    ],
)  # fmt: skip
def test_refusals_name_the_place(scene_with, lines, says):
    with pytest.raises(SceneError) as refusal:
        load_scene(scene_with(*lines))
    assert says in str(refusal.value)
