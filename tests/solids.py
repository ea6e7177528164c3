"""Geometry files that tests mesh, made with the kernel of gmsh."""

from contextlib import contextmanager

import gmsh


@contextmanager
def drawn(path):
    """Yield the OpenCASCADE kernel of gmsh; what it holds at the end is written to `path`."""
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        yield gmsh.model.occ
        gmsh.model.occ.synchronize()
        if path.suffix == ".stl":
            gmsh.option.setNumber("Mesh.MeshSizeMax", 4.0)
            gmsh.model.mesh.generate(2)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


def finger(path):
    """Write a finger of 60 x 16 x 14 mm with a chamber of 52 x 9 x 8 mm."""
    with drawn(path) as occ:
        outside, inside = occ.addBox(0, 0, 0, 60, 16, 14), occ.addBox(4, 4, 3, 52, 9, 8)
        occ.cut([(3, outside)], [(3, inside)])
    return path


def cup(path):
    """Write a cylinder along y, 20 x 30 mm, with a bore of 10 x 24 mm from y = 0."""
    with drawn(path) as occ:
        outside, bore = (
            occ.addCylinder(0, 0, 0, 0, 30, 0, 10),
            occ.addCylinder(0, 0, 0, 0, 24, 0, 5),
        )
        occ.cut([(3, outside)], [(3, bore)])
    return path


def ball(path):
    """Write a cube of 20 mm with a spherical cavity of 12 mm; return its volume."""
    with drawn(path) as occ:
        cube, ball = occ.addBox(0, 0, 0, 20, 20, 20), occ.addSphere(10, 10, 10, 6)
        made, _ = occ.cut([(3, cube)], [(3, ball)])
        return occ.getMass(*made[0])


def plate(path):
    """Write a plate of 30 x 20 x 3 mm with a hole of 8 mm in diameter."""
    with drawn(path) as occ:
        outside, hole = occ.addBox(0, 0, 0, 30, 20, 3), occ.addCylinder(15, 10, 0, 0, 0, 3, 4)
        occ.cut([(3, outside)], [(3, hole)])
    return path


def twisted(path):
    """Write a square bar along z whose section turns by 30 degrees: its sections are all equal."""
    with drawn(path) as occ:
        face = occ.addRectangle(-3, -3, 0, 6, 6)
        other = occ.copy([(2, face)])
        occ.translate(other, 0, 0, 20)
        occ.rotate(other, 0, 0, 0, 0, 0, 1, 0.5)
        loops = [occ.addCurveLoop([t for _, t in occ.getEntities(1)][k : k + 4]) for k in (0, 4)]
        occ.addThruSections(loops, makeSolid=True)
        occ.remove([(2, face), *other], recursive=True)
    return path


def two_blocks(path):
    """Write two blocks of 10 x 10 x 10 mm and 10 x 10 x 20 mm that touch at x = 10 mm."""
    with drawn(path) as occ:
        occ.addBox(0, 0, 0, 10, 10, 10)
        occ.addBox(10, 0, 0, 10, 10, 20)
    return path
