"""Fibres of scenes: where they lie, what they weigh, and what is refused and where."""

import numpy as np
import pytest

from softsim.errors import SceneError
from softsim.solver.plausibility import plausibility_warnings

THREAD = "diameter: 0.4 mm, youngs_modulus: 30 GPa, density: 1440 kg/m^3"
SCENE = f"""\
bodies:
  b: {{mesh: {{generator: box, length: 8 mm, height: 4 mm, width: 4 mm, element_size: 2 mm,
             cells: quad}}, formulation: solid, material: dragon_skin_10}}
fibres:
  kevlar:
    body: b
    points: [[0 mm, 1 mm, 1 mm], [8 mm, 1 mm, 1 mm], [8 mm, 3 mm, 1 mm]]
    spacing: 1 mm
    {THREAD.replace(", ", chr(10) + "    ")}
time: {{end: 1 s}}
"""
BARE = SCENE[: SCENE.index("fibres:")] + SCENE[SCENE.index("time:") :]
WOUND = SCENE.replace(
    "points: [[0 mm, 1 mm, 1 mm], [8 mm, 1 mm, 1 mm], [8 mm, 3 mm, 1 mm]]",
    "helix: {center: [1 mm, 2 mm, 2 mm], direction: x, radius: 1.5 mm, pitch: 3 mm, turns: 2}",
)
FLAT = SCENE.replace("box,", "block,").replace(" width: 4 mm,", "").replace(", 1 mm]", "]")


def test_a_line_has_its_corners_and_whole_bars(build):
    model = build(SCENE)
    (fibre,) = model.structures[0].fibres
    places = fibre.places(model.points)
    np.testing.assert_allclose(places[[0, 8, 10]], [[0, 1e-3, 1e-3], [8e-3, 1e-3, 1e-3],
                               [8e-3, 3e-3, 1e-3]], atol=1e-15)  # fmt: skip
    np.testing.assert_allclose(fibre.lengths, 1e-3, rtol=1e-12)
    area = 0.25 * np.pi * 0.4e-3**2
    assert fibre.stretching_stiffness == pytest.approx(30e9 * area, rel=1e-12)
    added = model.mass - build(BARE).mass
    assert added.sum() == pytest.approx(1440.0 * area * 10e-3, rel=1e-9)
    assert fibre.mass == pytest.approx(added.sum(), rel=1e-9)
    centre = added @ model.points / added.sum()
    np.testing.assert_allclose(centre, [4.8e-3, 1.2e-3, 1e-3], rtol=1e-9)


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_a_helix_winds_as_a_screw(build, hand):
    name = "right" if hand > 0.0 else "left"
    model = build(WOUND.replace("turns: 2", f"turns: 2, handedness: {name}, start_angle: 90 deg"))
    x, y, z = model.structures[0].fibres[0].places(model.points).T * 1e3
    assert (x[0], x[-1]) == pytest.approx((1.0, 7.0), rel=1e-12)
    np.testing.assert_allclose(np.hypot(y - 2.0, z - 2.0), 1.5, rtol=1e-12)
    turned = np.unwrap(np.arctan2(z - 2.0, y - 2.0))
    np.testing.assert_allclose(turned, 0.5 * np.pi + hand * 2.0 * np.pi * (x - 1.0) / 3.0)
    steps = np.diff(model.structures[0].fibres[0].lengths)
    np.testing.assert_allclose(steps, 0.0, atol=1e-15)


def test_what_lies_outside_by_less_than_the_tolerance_is_moved(build):
    text = SCENE.replace("3 mm, 1 mm]", "4.05 mm, 1 mm]")
    model = build(text)
    assert model.structures[0].fibres[0].places(model.points)[-1, 1] == pytest.approx(
        4e-3, rel=1e-12
    )


@pytest.mark.parametrize(
    ("text", "old", "new", "told", "line"),
    [
        (SCENE, "body: b", "body: c", "there is no body 'c'", 6),
        (SCENE, "3 mm, 1 mm]]", "4.2 mm, 1 mm]]",
         "leaves body 'b' at (8.00, 4.20, 1.00) mm; at (8.00, 4.20, 1.00) mm it is 0.2 mm out", 7),
        (SCENE, "3 mm, 1 mm]]", "1 mm, 1 mm]]", "two successive points at (8.00, 1.00, 1.00)", 7),
        (SCENE, "points:", "#", "either points or a helix", 6),
        (WOUND, "radius: 1.5 mm", "radius: 2.5 mm", "leaves body 'b' at", 7),
        (WOUND, "spacing: 1 mm", "spacing: 2 mm", "less than 8 bars of 2 mm", 8),
        (WOUND, "spacing: 1 mm", "spacing: 1 nm", "bars; at most 100000 are possible", 8),
        (SCENE, "spacing: 1 mm", "spacing: 1 nm", "bars; at most 100000 are possible", 8),
        (WOUND, "pitch: 3 mm", "pitch: -3 mm", "pitch", 7),
        (FLAT, "plain", "plain", "would be a closed sheet around the axis", 6),
    ],
)  # fmt: skip
def test_what_cannot_be_a_fibre_is_refused(build, text, old, new, told, line):
    if text is FLAT:
        text = text.replace(
            "formulation: solid", "formulation: axisymmetric, position: [4 mm, 0 mm]"
        )
    with pytest.raises(SceneError) as raised:
        build(text.replace(old, new))
    assert told in str(raised.value)
    assert raised.value.location.line == line


@pytest.mark.parametrize(
    ("spacing", "told"),
    [("8 mm", "span several elements"), ("0.1 mm", "add run time"), ("1 mm", None)],
)
def test_a_spacing_far_from_the_elements_is_doubted(build, spacing, told):
    found = plausibility_warnings(build(SCENE.replace("spacing: 1 mm", f"spacing: {spacing}")))
    text = found.get("bars of kevlar")
    assert text is None if told is None else text is not None and told in text
