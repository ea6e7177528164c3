"""What is measured: the robot in section and in space, plain blocks of any number of elements."""

from dataclasses import dataclass
from pathlib import Path

from softsim.scene.loading import load_scene

ROOT = Path(__file__).resolve().parents[1]
PFR = ROOT / "scenes" / "pfr_36mm.yaml"
PFR_IN_SPACE = ROOT / "scenes" / "pfr_36mm_3d.yaml"

# Bare: no contact and no Maxwell branches, which flatters the rate. Held at one end, they sag.
_PLATE = """
bodies:
  block:
    mesh: {{generator: block, length: {length} m, height: {height} m, element_size: {size} m,
            cells: {cells}}}
    formulation: plane_strain
    thickness: 10 mm
    material: rubber
    fixed: [left]
"""
_BAR = """
bodies:
  block:
    mesh: {{generator: box, length: {length} m, width: {height} m, height: {height} m,
            element_size: {size} m, cells: {cells}}}
    formulation: solid
    material: rubber
    fixed: [left]
"""
_REST = """
materials:
  rubber: {law: yeoh, C10: 36 kPa, C20: 0.25 kPa, C30: 0.023 kPa, density: 1070 kg/m^3}
time: {end: 1 s}
"""
SIZE = 1e-3  # of an element [m]


@dataclass(frozen=True)
class _Block:
    """length: in heights. split: cells that a square or a brick is cut into."""

    text: str
    dimension: int
    length: int
    cells: str
    split: int


_BLOCKS = {
    "triangles": _Block(_PLATE, 2, 4, "simplex", 2),
    "quadrilaterals": _Block(_PLATE, 2, 4, "quad", 1),
    "tetrahedra": _Block(_BAR, 3, 3, "simplex", 6),
    "hexahedra": _Block(_BAR, 3, 3, "quad", 1),
}


OF_TRIANGLES = (
    "bodies.skin.mesh.cells=simplex",
    "bodies.skin.mesh.skin_rows=null",
    "bodies.skin.mesh.spike_columns=null",
    "bodies.skin.mesh.element_size=0.5 mm",
)


def pfr_of_triangles(folder: Path) -> Path:
    """PFR with a mesh of 1,112 triangles."""
    return changed(PFR, OF_TRIANGLES, folder / "pfr_of_triangles.yaml")


def pfr_in_space(folder: Path) -> Path:
    """PFR_IN_SPACE without mass scaling, which the compiled reference has not."""
    return changed(PFR_IN_SPACE, ("solver.mass_scaling=null",), folder / "pfr_in_space.yaml")


def changed(scene: Path, overrides: tuple[str, ...], path: Path) -> Path:
    """A scene with overrides, written to `path`."""
    path.write_text(load_scene(scene, overrides).resolved())
    return path


def block(folder: Path, kind: str, count: int) -> Path:
    """A scene of about `count` triangles, quadrilaterals, tetrahedra or hexahedra: a plate four
    times as long as high, or a bar three times as long as wide.
    """
    of = _BLOCKS[kind]
    rows = max(1, round((count / (of.length * of.split)) ** (1 / of.dimension)))
    text = of.text.format(
        length=of.length * rows * SIZE, height=rows * SIZE, size=SIZE, cells=of.cells
    )
    path = folder / f"{kind}_{count}.yaml"
    path.write_text(text + _REST)
    return path
