"""The constants of the scenes that no source gives, and what each was fitted on.

The values are read from the scenes: what stands here is what they rest on.
"""

from dataclasses import asdict, dataclass
from typing import Any

from softsim.errors import Location
from softsim.scene.loading import load_scene
from softsim.scene.tree import nearest
from validation.cases import SCENES


@dataclass(frozen=True)
class Constant:
    """A value in a scene; `path` are its keys joined by dots."""

    name: str
    scene: str
    path: str
    fitted_on: str

    def described(self) -> dict[str, Any]:
        """Name, value as the scene writes it, where that is written, what it rests on."""
        loaded = load_scene(SCENES / self.scene)
        keys = tuple(int(key) if key.isdigit() else key for key in self.path.split("."))
        value, depth = nearest(loaded.tree, keys)
        if depth < len(keys):
            return {"value": "default", "where": self.scene} | asdict(self)
        origin = value.origin
        where = f"{origin.file}:{origin.line}" if isinstance(origin, Location) else str(origin)
        return {"value": value.text, "where": where.removeprefix(f"{SCENES}/")} | asdict(self)


TOUCH = "not fitted on motion: the spikes barely touch (6.4), as the section's do at this pressure"
HIGHEST = "not fitted on motion: it presses as hard as the thesis's plane model at 5 kPa (6.2)"

CONSTANTS = (
    Constant(
        "friction on the pipe", "pfr_36mm.yaml", "contact.friction_coefficient",
        "fitted: Mode 1 fastest at 64 Hz, below 5 mm/s at 192 Hz (0.4, 0.6: fastest at 137 Hz)",
    ),
    Constant(
        "root of a spike", "pfr_36mm.yaml", "bodies.skin.mesh.root_thickness",
        "fitted: Mode 3 moves best at 192 Hz in the 36 mm pipe (with 3 mm best at 222 Hz)",
    ),
    Constant(
        "damping at the motor's frequencies, g at 0.9 ms", "pfr_36mm.yaml",
        "materials.sleeve.prony.1.g",
        "fitted: the same (with 0.15 and 3 mm it hardly moves at 192 Hz)",
    ),
    Constant(
        "what a strip stands for", "pfr_36mm.yaml", "bodies.skin.sector",
        "not fitted: a quarter of the robot, the vertical stiffness of a ring of 14 spikes is that "
        "of 7; see robot:pfr/section",
    ),
    *(
        Constant(f"pressure on the skin at P_M3^S, {pipe} mm pipe", f"pfr_{pipe}mm.yaml",
                 "loads.air.on_skin.1.1", TOUCH)
        for pipe in (30, 36, 41)
    ),
    Constant("pressure on the skin at 23 kPa", "pfr_36mm.yaml", "loads.air.on_skin.2.1", HIGHEST),
)  # fmt: skip
