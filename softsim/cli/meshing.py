"""Command that meshes geometry and writes a starter scene."""

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from rich.console import Console

from softsim.errors import MeshError, Option, SceneError
from softsim.options import explained, positive, rows_of_sets
from softsim.report.table import Table

if TYPE_CHECKING:
    from softsim.mesh.cad import Chamber
    from softsim.mesh.mesh import Mesh
    from softsim.mesh.surface import CellKind

PRESSURE_OF_WALL = 0.3
"""Pressure of a starter scene over shear modulus times wall thickness over radius of the chamber.

A spherical or cylindrical balloon has its limit point between 0.8 and 1.2.
"""

MOST_THIN = 0.2
"""Fraction of a chamber's facets with a wall of one tetrahedron above which a warning is printed.
"""

END_DEPTH = 0.03
"""Depth of an end that is not planar, as a fraction of the length of the part."""


def mesh(
    part: Annotated[
        Path,
        typer.Argument(
            help="Geometry (.step, .iges, .brep, .stl, .geo) or mesh (.msh, .inp, .vtu).",
            show_default=False,
        ),
    ],
    size: Annotated[
        str | None,
        typer.Option(help="Approximate longest edge of the elements, such as '1 mm'."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Mesh file; default: PART.msh in the current folder."),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(
            help="Unit of length of the file, such as mm, m or inch; STEP and IGES files state "
            "theirs. Default: mm, or m for a part smaller than 2."
        ),
    ] = None,
    cells: Annotated[
        str,
        typer.Option(
            metavar="simplex|quad",
            help="simplex: tetrahedra. quad: hexahedra, of a solid with a constant section along "
            "x, y or z.",
        ),
    ] = "simplex",
    material: Annotated[
        str, typer.Option(help="Material of the starter scene, from the library.")
    ] = "dragon_skin_30",
) -> None:
    """Mesh a part, name its ends and chambers, and write a starter scene that runs.

    Planar ends are called x_min, x_max, y_min ... after the lowest or highest plane in which they
    lie. Closed cavities, and pockets that open into a planar end only, are called chamber1,
    chamber2 ... The mesh, its figure and the scene have the same name with the endings .msh, .png
    and .yaml; a scene that exists is not changed. Geometry is meshed by the package gmsh.
    """
    with explained() as console:
        from softsim.materials.laws import LAWS
        from softsim.materials.library import library_material, library_names
        from softsim.mesh.cad import chambers, mesh_solid, with_named_surfaces, write_gmsh
        from softsim.mesh.reading import FORMATS, GEOMETRY, MILLIMETRE, read_mesh
        from softsim.report.snapshots import draw_mesh

        kind = _cell_kind(cells)
        length_unit = None if unit is None else positive("--unit", f"1 {unit}", "m")
        target = out or Path(f"{part.stem}.msh")
        if target.suffix != ".msh":
            raise SceneError(
                "the mesh is written as .msh", "end its name with .msh", Option(f"--out {out}")
            )
        data = library_material(material)
        if data is None:
            from softsim.scene.names import close_names

            raise SceneError(
                f"there is no material '{material}' in the library",
                close_names(material, library_names(), "materials"),
                Option(f"--material {material}"),
            )
        if target.exists() and target.resolve() == part.resolve():
            raise SceneError("the mesh would overwrite the part", "choose another name with --out")
        if part.suffix.lower() in GEOMETRY:
            if size is None:
                raise MeshError(
                    f"{part}: the size of the elements is missing",
                    hint="give --size, for example --size 1mm; a wall needs at least two elements",
                )
            made = mesh_solid(part, target, positive("--size", size, "m"), length_unit, kind)
        else:
            if part.suffix.lower() in FORMATS and (size is not None or kind == "quad"):
                raise MeshError(f"{part}: is a mesh already", hint="leave out --size and --cells")
            made = with_named_surfaces(read_mesh(part, length_unit or MILLIMETRE).mesh)
            write_gmsh(made, target)
        figure, scene = target.with_suffix(".png"), target.with_suffix(".yaml")
        draw_mesh(made, figure)
        found = chambers(made)
        is_new = not scene.exists()
        if is_new:
            mu0 = LAWS[data.law](*data.constants).initial_shear_modulus
            scene.write_text(starter_scene(made, found, target, material, mu0), encoding="utf-8")
        _print_mesh(made, found, console)
        console.print(
            Table([
                ("mesh", str(target)),
                ("figure", str(figure)),
                ("scene", f"{scene}{'' if is_new else ' exists and was not changed'}"),
                ("next", f"softsim run {scene}"),
            ]),
            highlight=False,
        )  # fmt: skip


def _cell_kind(text: str) -> "CellKind":
    if text not in ("simplex", "quad"):
        raise typer.BadParameter(
            "is simplex (tetrahedra) or quad (hexahedra)", param_hint="--cells"
        )
    return "quad" if text == "quad" else "simplex"


def _print_mesh(made: "Mesh", found: "list[Chamber]", console: Console) -> None:
    """Print size, quality and sets of a mesh, and its chambers."""
    from softsim.mesh.quality import quality

    sides = " x ".join(f"{1e3 * side:.4g}" for side in np.ptp(made.points, axis=0))
    q = quality(made)
    rows = [("size", f"{sides} mm, {q.volume * 1e6:.4g} ml"), ("mesh", q.describe())]
    rows += rows_of_sets(made.node_sets, made.facet_sets, made.cell_sets)
    console.print(Table(rows))
    for chamber in found:
        where = f"open at {chamber.opening}" if chamber.opening else "closed"
        console.print(f"{chamber.name}: {chamber.volume * 1e6:.4g} ml, {where}", highlight=False)
        if chamber.thin > MOST_THIN:
            console.print(
                f"warning: the wall of {chamber.name} is one tetrahedron thick at "
                f"{100 * chamber.thin:.0f} % of its facets, which makes it much too stiff in "
                "bending: use a smaller --size",
                highlight=False,
            )
    if not found:
        console.print(
            "no chamber: no cavity is closed, or open at one planar end only", highlight=False
        )


def starter_scene(
    made: "Mesh", found: "list[Chamber]", target: Path, material: str, mu0: float
) -> str:
    """Return the YAML text of a static scene with everything that can be guessed of a part.

    mu0 [Pa]: initial shear modulus of the material.

    One end is held, that of the chambers' openings if they have any, else the lowest of the longest
    side. The chambers that it closes, and the closed ones, are inflated; without a chamber the part
    bends under its weight.
    """
    body = re.sub(r"[^A-Za-z0-9_]", "_", target.stem)
    body = body if body[0].isalpha() else f"part_{body}"
    low, high = made.points.min(axis=0), made.points.max(axis=0)
    openings = [chamber.opening for chamber in found if chamber.opening]
    held = openings[0] if openings else f"{'xyz'[int(np.argmax(high - low))]}_min"
    tip = held[:2] + ("max" if held.endswith("min") else "min")
    sets = [_end_set(name, low, high) for name in (held, tip) if name not in made.node_sets]
    pressed = [chamber for chamber in found if chamber.opening in ("", held)]
    lines = [
        f"# Starter scene of {target.name}, written by `softsim mesh`. Change each (guess).",
        "# All keys: the page Scene keys of the documentation. Check: softsim check.",
        f"title: {target.stem}",
        "bodies:",
        f"  {body}:",
        f"    mesh: {{file: {target.name}}}",
        "    formulation: solid",
        f"    material: {material}  # (guess) `softsim materials` lists others",
        *(["    sets:  # ends that are not planar", *sets] if sets else []),
        f"    fixed: [{held}]  # (guess) held end",
    ]
    if pressed:
        facets = ", ".join(f"{body}.{chamber.name}" for chamber in pressed)
        pressure = f"{1e-3 * _pressure(made, pressed, mu0):g}"
        lines += [
            "environment: {gravity: 0 m/s^2}",
            "loads:",
            "  air:",
            "    kind: follower_pressure",
            f"    facets: [{facets}]",
            f"    profile: {{kind: constant, value: {pressure} kPa, ramp: 1 s}}  # (guess)",
        ]
    else:
        lines.append("# No chamber was found: the only load is the weight.")
        lines.append("environment: {gravity: [0 m/s^2, -9.81 m/s^2, 0 m/s^2]}  # (guess)")
    lines += [
        "time: {end: 1 s, procedure: static}  # equilibria, while the load rises",
        "output:",
        "  probes:",
        f"    tip: {{kind: displacement, nodes: {body}.{tip}}}  # columns tip_x, tip_y, tip_z",
        f"    angle: {{kind: rotation, nodes: {body}.{tip}}}  # columns angle_x, angle_y, angle_z",
        "  history_interval: 50 ms  # longest load step: 20 rows of history.csv",
        "  frame_interval: 50 ms    # frames of figures and films",
    ]
    unused = [chamber for chamber in found if chamber not in pressed]
    lines += [f"# {c.name} is open at {c.opening}, which moves: not inflated." for c in unused]
    return "\n".join(lines) + "\n"


def _end_set(name: str, low: np.ndarray, high: np.ndarray) -> str:
    """Return the line of a set that holds the outermost nodes at an end."""
    axis, is_low = "xyz".index(name[0]), name.endswith("min")
    depth = END_DEPTH * (high - low)[axis]
    place = low[axis] + depth if is_low else high[axis] - depth
    point, normal = ["0 mm"] * 3, [0, 0, 0]
    point[axis], normal[axis] = f"{place * 1e3:.5g} mm", -1 if is_low else 1
    return f"      {name}: {{plane: {{point: [{', '.join(point)}], normal: {normal}}}}}"


def _pressure(made: "Mesh", pressed: "list[Chamber]", mu0: float) -> float:
    """Return a moderate pressure [Pa], from the mean thickness of the walls, to one digit."""
    from softsim.mesh.mesh import signed_volumes, simplex_facets
    from softsim.mesh.surface import area_vectors

    facets = np.concatenate([made.facet_sets[chamber.name] for chamber in pressed])
    triangles, _ = simplex_facets(facets)
    area = float(np.linalg.norm(area_vectors(made.points, triangles), axis=1).sum())
    thickness = float(signed_volumes(made.points, made.cells).sum()) / area
    radius = 3.0 * sum(chamber.volume for chamber in pressed) / area
    pressure = PRESSURE_OF_WALL * mu0 * thickness / radius
    digit = 10.0 ** math.floor(math.log10(pressure))
    return round(pressure / digit) * digit
