"""The constants of the scenes that no source gives, and what each rests on: nothing on motion.

The values are read from the scenes.
"""

from dataclasses import asdict, dataclass
from typing import Any

from softsim.errors import Location
from softsim.scene.loading import load_scene
from softsim.scene.text import nearest
from validation.cases import SCENES


@dataclass(frozen=True)
class Constant:
    """A value in a scene; `path` are its keys joined by dots."""

    name: str
    scene: str
    path: str
    rests_on: str

    def described(self) -> dict[str, Any]:
        """Name, value as the scene writes it, where that is written, what it rests on."""
        loaded = load_scene(SCENES / self.scene)
        keys = tuple(int(key) if key.isdigit() else key for key in self.path.split("."))
        value, depth = nearest(loaded.tree, keys)
        if depth < len(keys):
            return {"value": "default", "where": self.scene} | asdict(self)
        origin = value.origin
        where = f"{origin.file}:{origin.line}" if isinstance(origin, Location) else str(origin)
        for folder in (SCENES, SCENES.parent):
            where = where.removeprefix(f"{folder}/")
        return {"value": value.text, "where": where} | asdict(self)


STIFFNESS = (
    "hypothesis: 2.2 times the stated constants (36, 0.25, 0.023 kPa), pressures taken literally; "
    "fits radii and rows in contact at 20 to 26 kPa and the pull at 23 kPa, where 2.0 to 2.4 are "
    "admitted (sleeve_stiffness)"
)
SPECTRUM = (
    "measured on Ecoflex 00-30 (rheometer, guided waves), carried over to Dragon Skin 10, whose "
    "measured beam damps alike at 4 and 8 Hz; standard deviation "
)
SPACE = "derived: a ring of 14 spikes is as stiff across the pipe as 7; see robot:pfr/section"
TRAILED = "assumption: a polyurethane tube of 2 mm and wires, 0.25 m of them; see robot:pfr/tether"

CONSTANTS = (
    Constant(
        "friction on the pipe", "pfr_36mm.yaml", "contact.friction_coefficient",
        "silicone limbs that slide (Table B.1); the thesis gives none for this robot; 0.5 to 0.8",
    ),
    Constant(
        "root of a spike", "pfr_36mm.yaml", "bodies.skin.mesh.root_thickness",
        "assumed: half of a spike's height, for the thesis gives no number; 2 to 3 mm",
    ),
    *(
        Constant(f"stiffness of the sleeve, {key}", "pfr_36mm.yaml", f"materials.sleeve.{key}",
                 STIFFNESS)
        for key in ("C10", "C20", "C30")
    ),
    Constant(
        "spectrum of the sleeve, relaxation time", "pfr_36mm.yaml",
        "materials.sleeve.spectrum.relaxation_time", SPECTRUM + "50 us",
    ),
    Constant(
        "spectrum of the sleeve, order", "pfr_36mm.yaml",
        "materials.sleeve.spectrum.order", SPECTRUM + "0.03",
    ),
    Constant("what a strip stands for", "pfr_36mm.yaml", "bodies.skin.sector", SPACE),
    Constant("thickness of a strip's spikes", "pfr_36mm.yaml", "bodies.skin.thickness", SPACE),
    Constant(
        "drag of the tether on the section", "pfr_36mm.yaml", "loads.tether.drag",
        f"{TRAILED}: 10 mN on the robot, up to 30 mN; half of it on the section",
    ),
    Constant("weight of the tether", "pfr_36mm.yaml", "loads.tether.weight", TRAILED),
)  # fmt: skip
