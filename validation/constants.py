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
        keys = tuple(self.path.split("."))
        value, depth = nearest(loaded.tree, keys)
        if depth < len(keys):
            return {"value": "default", "where": self.scene} | asdict(self)
        origin = value.origin
        where = f"{origin.file}:{origin.line}" if isinstance(origin, Location) else str(origin)
        return {"value": value.text, "where": where.removeprefix(f"{SCENES}/")} | asdict(self)


AIR = "not fitted on motion: 5 kPa on the section stand for 23 kPa (6.2), and at P_M3^S the spikes "
AIR += "barely touch (6.4); see parts/air.yaml"

CONSTANTS = (
    Constant(
        "friction on the pipe", "pfr_36mm.yaml", "contact.friction_coefficient",
        "assumed: silicone on acrylic, not measured in the thesis",
    ),
    Constant(
        "thickness of a strip", "pfr_36mm.yaml", "bodies.skin.thickness",
        "not fitted: 3.5 spike widths, the vertical stiffness of a ring of 14; see parts/pfr.yaml",
    ),
    *(
        Constant(f"{what}, {pipe} mm pipe", f"pfr_{pipe}mm.yaml", f"loads.air.{key}", AIR)
        for pipe in (30, 36, 41)
        for what, key in (("pressure factor", "factor"), ("pressure offset", "offset"))
    ),
)  # fmt: skip
