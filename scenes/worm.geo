// The half section of a worm with three chambers, in mm: x is the radius, y the axis. Two balloons with a
// bellows between them, closed by discs.
//   gmsh -2 worm.geo -o worm.msh
DefineConstant[ size = 0.8, convolutions = 4 ];  // size: of the triangles' sides
radius = 9.5;     // of the balloons, outside
length = 14;      // of a balloon, between its discs
skin = 1.2;       // wall of a balloon
disc = 3;         // thickness of the discs
crown = 8.5; root = 5;   // radii of the bellows, outside
fold = 2;         // half of its pitch
wall = 1.8;       // of the bellows, along the radius
Mesh.MshFileVersion = 2.2;

outer[] = {};
out = newp; Point(out) = {0, 0, 0};
start = out;
// A line to the point `to` along the outside, or around a chamber.
Macro Outside
  next = newp; Point(next) = {to[0], to[1], 0};
  one = newc; Line(one) = {out, next}; outer[] += {one}; out = next;
Return
Macro Inside
  next = newp; Point(next) = {to[0], to[1], 0};
  one = newc; Line(one) = {in, next}; chamber[] += {one}; in = next;
Return

// Rear balloon.
to[] = {radius, 0}; Call Outside;
to[] = {radius, length + 2 * disc}; Call Outside;
rear_grip = one;
to[] = {root, length + 2 * disc}; Call Outside;
// Bellows.
base = length + 2 * disc;
For k In {0 : convolutions - 1}
  to[] = {crown, base + (2 * k + 1) * fold}; Call Outside;
  to[] = {root, base + (2 * k + 2) * fold}; Call Outside;
EndFor
top = base + 2 * convolutions * fold;
// Front balloon.
to[] = {radius, top}; Call Outside;
to[] = {radius, top + length + 2 * disc}; Call Outside;
front_grip = one;
to[] = {0, top + length + 2 * disc}; Call Outside;
tip = one;

// Chambers, from the rear disc on, along the axis and around each chamber.
chamber[] = {};
in = newp; Point(in) = {0, disc, 0};
axis0 = newc; Line(axis0) = {start, in};
to[] = {radius - skin, disc}; Call Inside;
to[] = {radius - skin, disc + length}; Call Inside;
to[] = {0, disc + length}; Call Inside;
rear[] = chamber[]; chamber[] = {};
last = in;
in = newp; Point(in) = {0, base, 0};
axis1 = newc; Line(axis1) = {last, in};
to[] = {root - wall, base}; Call Inside;
For k In {0 : convolutions - 1}
  to[] = {crown - wall, base + (2 * k + 1) * fold}; Call Inside;
  to[] = {root - wall, base + (2 * k + 2) * fold}; Call Inside;
EndFor
to[] = {0, top}; Call Inside;
middle[] = chamber[]; chamber[] = {};
last = in;
in = newp; Point(in) = {0, top + disc, 0};
axis2 = newc; Line(axis2) = {last, in};
to[] = {radius - skin, top + disc}; Call Inside;
to[] = {radius - skin, top + disc + length}; Call Inside;
to[] = {0, top + disc + length}; Call Inside;
front[] = chamber[];
axis3 = newc; Line(axis3) = {in, out};

Curve Loop(1) = {outer[], -axis3, -front[], -axis2, -middle[], -axis1, -rear[], -axis0};
Plane Surface(1) = {1};
Mesh.MeshSizeMin = size; Mesh.MeshSizeMax = size;
Physical Surface("silicone") = {1};
Physical Curve("rear") = {rear[]};
Physical Curve("middle") = {middle[]};
Physical Curve("front") = {front[]};
Physical Curve("grips") = {rear_grip, front_grip};
Physical Curve("tip") = {tip};
Physical Curve("tail") = {outer[0]};
