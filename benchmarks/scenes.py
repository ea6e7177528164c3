"""What is measured: the robot in section and in space, plain blocks of any number of elements."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PFR = ROOT / "scenes" / "pfr_36mm.yaml"
PFR_IN_SPACE = ROOT / "scenes" / "pfr_36mm_3d.yaml"

# Bare: no contact and no Maxwell branches, which flatters the rate. Held at one end, they sag.
_TRIANGLES = """
bodies:
  block:
    mesh: {{generator: block, length: {length} m, height: {height} m, element_size: {size} m}}
    formulation: plane_strain
    thickness: 10 mm
    material: rubber
    fixed: [left]
"""
_TETRAHEDRA = """
bodies:
  block:
    mesh: {{generator: box, length: {length} m, width: {height} m, height: {height} m,
            element_size: {size} m}}
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


def triangles(folder: Path, count: int) -> Path:
    """A scene of about `count` triangles: a block four times as long as high."""
    rows = max(1, round((count / 8) ** 0.5))
    text = _TRIANGLES.format(length=4 * rows * SIZE, height=rows * SIZE, size=SIZE)
    return _written(folder / f"triangles_{count}.yaml", text)


def tetrahedra(folder: Path, count: int) -> Path:
    """A scene of about `count` tetrahedra: a bar three times as long as wide."""
    rows = max(1, round((count / 18) ** (1 / 3)))
    text = _TETRAHEDRA.format(length=3 * rows * SIZE, height=rows * SIZE, size=SIZE)
    return _written(folder / f"tetrahedra_{count}.yaml", text)


def _written(path: Path, text: str) -> Path:
    path.write_text(text + _REST)
    return path
