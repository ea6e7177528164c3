"""ABAQUS input files that several tests read."""

NODES = """*Node
   10, 0., 0.
   20, 10., 0.
   30, 10., 1.D1
   40, 0., 10.
"""
SQUARE = (
    "** a comment\n*Heading\nnothing, to, read\n"
    + NODES
    + "*Element, type=CPE3\n5, 10, 20, 30\n7, 10, 30, 40\n"
)
TETRAHEDRON = """*NODE, NSET=all
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 1
*ELEMENT, TYPE=C3D4, ELSET=body
1, 1, 2, 3, 4
"""
FRAME = """*Part, name=Frame
*Node
      1, 0., -3.
      2, 10., -3.
      3, 10., 0.
*Element, type=CAX3
7, 1, 2, 3
*NGEN
1, 3
*Nset, nset=Both
 1
*End Part
"""
"""A part to put before the assembly of CAE; what it generates is not supported."""
OTHERS = """*Instance, name=Skin-2, part=Skin
 0., 20.
 5., 25., 0., 5., 25., 1., 90.
*End Instance
*Instance, name=Frame-1, part=Frame
*End Instance
*Nset, nset=Set-1, instance=Skin-2
 1,
*Nset, nset=Shared, instance=Frame-1
 1,
*Nset, nset=Shared, instance=Skin-2
 4,
*Nset, nset=OfFrame
 Frame-1.2, Frame-1.Both
*Elset, elset=_Rim_S1, internal, instance=Frame-1
 7,
*Surface, type=ELEMENT, name=Rim
_Rim_S1, S1
*Nset, nset=OfRim
 OfFrame, Shared
"""
"""Instances to put behind that of CAE, with sets that take from several."""
CAE = """*Heading
** PARTS
*Part, name=Skin
*Node
      1, 0., 0.
      2, 10., 0.
      3, 10., 10.
      4, 0., 10.
*Element, type=CAX3H
1, 1, 2, 3
2, 1, 3, 4
*Nset, nset=Set-1, generate
 1, 4, 1
*Elset, elset=Set-1, generate
 1, 2, 1
*Nset, nset="Left end"
 1, 4
** Section: Section-1
*Solid Section, elset=Set-1, material=Silicone
,
*End Part
**
*Assembly, name=Assembly
**
*Instance, name=Skin-1, part=Skin
*End Instance
**
*Node
      1, 25., 5., 0.
*Nset, nset=Frame
 1,
*Nset, nset=Set-1, instance=Skin-1
 2, 3
*Nset, nset=Both
 Set-1, Skin-1.1
*Elset, elset=_Cavity_S2, internal, instance=Skin-1, generate
 1, 2, 1
*Elset, elset=_Cavity_S1, internal, instance=Skin-1
 1,
*Surface, type=ELEMENT, name=Cavity
_Cavity_S1, S1
_Cavity_S2, S2
*Surface, type=NODE, name=Set-1_CNS_, internal
Set-1, 1.
*Surface, type=NODE, name=Tip
Skin-1.3, 1.
*End Assembly
*Material, name=Silicone
*Hyperelastic, yeoh
 0.119, 0., 0., 0., 0., 0.
*Step, name=Step-1
*Boundary
Set-1, 1, 1
*End Step
"""
