// The half section of a bellows, in mm: x is the radius, y the axis. Flat rings, joined by half circles
// at the crowns and at the roots; a thick lid closes it above. Into quadrilaterals:
//   gmsh -2 bellows.geo -o bellows.msh
// and finer ones, or more convolutions: gmsh -2 -setnumber size 0.275 -setnumber convolutions 6 ...
DefineConstant[ convolutions = 4, size = 0.55 ];  // size: of the quadrilaterals' sides, at most
root = 10;     // radius at which the rings end inside, and the half circles of the roots begin
crown = 16;    // where those of the crowns begin
spacing = 4;   // from the middle of one ring to that of the next: half the pitch
wall = 1.5;    // of silicone
lid = 3.5;     // how thick
rows = Ceil(wall / size);
Mesh.MshFileVersion = 2.2;

// A stretch of the wall, the chamber on its left: from the line `across` (from the point `out` on its
// right to the point `in` on its left) to such a line at the places to_out, to_in, in `steps` columns;
// along straight lines, or arcs about the point `centre`.
Macro Stretch
  next_out = newp; Point(next_out) = {to_out[0], to_out[1], 0};
  next_in = newp; Point(next_in) = {to_in[0], to_in[1], 0};
  right = newc;
  If (centre) Circle(right) = {out, centre, next_out}; Else Line(right) = {out, next_out}; EndIf
  left = newc;
  If (centre) Circle(left) = {in, centre, next_in}; Else Line(left) = {in, next_in}; EndIf
  next_across = newc; Line(next_across) = {next_out, next_in};
  face = news;
  Curve Loop(face) = {right, next_across, -left, -across};
  Plane Surface(face) = {face};
  Transfinite Curve {left, right} = steps + 1;
  Transfinite Curve {across, next_across} = rows + 1;
  faces[] += {face};
  chamber[] += {left}; sides[] += {left, right};
  out = next_out; in = next_in; across = next_across;
Return

faces[] = {}; chamber[] = {}; sides[] = {};
out = newp; Point(out) = {root, -wall / 2, 0};
in = newp; Point(in) = {root, wall / 2, 0};
base = newc; Line(base) = {out, in};
across = base;
For ring In {0 : 2 * convolutions - 1}
  y = ring * spacing;
  up = (ring % 2) ? -1 : 1;                 // outwards, the chamber above it; or inwards, and below
  from = (ring % 2) ? root : crown;         // where this ring ends and the next half circle begins
  centre = 0;
  to_out[] = {from, y - up * wall / 2}; to_in[] = {from, y + up * wall / 2};
  steps = Ceil((crown - root) / size);
  Call Stretch;
  If (ring < 2 * convolutions - 1)
    middle = from + up * spacing / 2;       // radius of the wall's middle at the crown or the root
    centre = newp; Point(centre) = {from, y + spacing / 2, 0};
    steps = Ceil(Pi / 4 * spacing / size);
    to_out[] = {middle + wall / 2, y + spacing / 2}; to_in[] = {middle - wall / 2, y + spacing / 2};
    Call Stretch;
    to_out[] = {from, y + spacing + up * wall / 2}; to_in[] = {from, y + spacing - up * wall / 2};
    Call Stretch;
  EndIf
EndFor

// The lid: as thick as the wall, and what lies on it. Its inner half touches nothing: with contact, the
// small masses of the nodes near the axis would shorten the time step.
folds[] = sides[]; under[] = {};
centre = 0;
rim = out;
steps = Ceil(root / 2 / size);
For half In {1 : 0 : -1}
  to_out[] = {half * root / 2, y + wall / 2}; to_in[] = {half * root / 2, y - wall / 2};
  Call Stretch;
  under[] += {right};
  If (half) folds[] += {left}; EndIf
EndFor
axis = newc;
top_middle = newp; Point(top_middle) = {0, y - wall / 2 + lid, 0};
top_rim = newp; Point(top_rim) = {root, y - wall / 2 + lid, 0};
Line(axis) = {out, top_middle};
side = newc; Line(side) = {rim, top_rim};
top = newc; Line(top) = {top_rim, top_middle};
face = news;
Curve Loop(face) = {side, top, -axis, -under[1], -under[0]};
Plane Surface(face) = {face};
Transfinite Curve {top} = 2 * steps + 1;
Transfinite Curve {side, axis} = Ceil((lid - wall) / size) + 1;
faces[] += {face};

Transfinite Surface {faces[]};
Transfinite Surface {face} = {rim, out, top_middle, top_rim};
Recombine Surface {faces[]};
Physical Surface("silicone") = {faces[]};
Physical Curve("chamber") = {chamber[]};
Physical Curve("folds") = {folds[]};
Physical Curve("base") = {base};
Physical Curve("top") = {top};
