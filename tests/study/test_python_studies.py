"""Studies from Python values."""

import numpy as np
import pytest

from softsim.errors import SceneError
from softsim.study.loading import study_from


def content(**changed):
    """A study of block.yaml, with some keys of another value."""
    given = {
        "scene": "block.yaml",
        "factors": {"thick": {"key": "bodies.block.thickness", "values": ["5 mm", "6 mm"]}},
        "measures": {"moved": {"of": "body_displacement"}},
    }
    return {**given, **changed}


def test_numbers_of_numpy_and_paths_are_taken(folder):
    friction = {"key": "contact.friction_coefficient", "values": np.linspace(0.25, 1.0, 4)}
    steps = {"key": "solver.safety_factor", "range": (np.float32(0.5), 1), "count": np.int64(3)}
    study = study_from(
        content(scene=folder / "block.yaml", factors={"friction": friction, "steps": steps}), folder
    )
    assert study.search_space == {"friction": (0.25, 0.5, 0.75, 1.0), "steps": (0.5, 0.75, 1)}
    assert study.title == "study"


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"scene": "none.yaml"}, "^scene: there is no file "),
        ({"measures": {"m": {"of": "bodi"}}}, r"^measures\.m\.of: no run of this scene tells"),
        ({"factors": {"t": {"key": "bodies.block.thickness", "values": ["5 mm", 3]}}},
         r"^factors\.t\.values\[1\]: a length needs a unit"),
        ({"set": {"time.end": object()}}, r"^set\.time\.end: a object cannot be part of a study"),
        ({"mesures": {}}, "^mesures: unknown key 'mesures'\n  did you mean 'measures'"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_by_its_keys(folder, changed, message):
    with pytest.raises(SceneError, match=message):
        study_from(content(**changed), folder)
