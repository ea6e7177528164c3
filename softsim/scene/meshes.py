"""Sources of the mesh of a body: a generator with its dimensions, or a file."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from softsim.mesh.surface import CellKind
from softsim.scene.quantities import Length, PositiveLength, Spec, Text, WholeNumber, written


class GeneratedMesh(Spec):
    """Mesh from sizes; built_by: entry point of its generator."""

    built_by: ClassVar[str]


class _Filled(GeneratedMesh):
    cells: CellKind = Field(
        default="simplex",
        description="Cell type. simplex: triangles or tetrahedra. quad: quadrilaterals or "
        "hexahedra.",
    )


class BlockMesh(_Filled):
    """Rectangle (2D). Sets: bottom, top, left, right, surface."""

    built_by: ClassVar[str] = "softsim.robots.block:block"
    generator: Literal["block"] = Field(description="Name of the mesh generator.")
    length: PositiveLength = Field(description="Size along x.")
    height: PositiveLength = Field(description="Size along y, from y = 0.")
    element_size: PositiveLength = Field(
        description="Longest edge of the cells, before they are divided into triangles."
    )


class _Skin(_Filled):
    skin_rows: WholeNumber | None = Field(
        default=None,
        ge=1,
        le=100,
        description="Number of quadrilaterals or hexahedra through the skin. Default: from "
        "`element_size`.",
    )


class _PfrSkin(_Skin):
    inner_diameter: PositiveLength = Field(
        default=written("15 mm"), description="Inner diameter of the skin."
    )
    outer_diameter: PositiveLength = Field(
        default=written("17 mm"), description="Outer diameter of the skin, without spikes or rings."
    )
    free_length: PositiveLength = Field(
        default=written("30 mm"), description="Length of the skin between the knots."
    )


class _CurvedFin(_Filled):
    front_radius: PositiveLength = Field(
        default=written("5 mm"),
        description="Radius of the front edge of a spike or limb. A large value gives a straight "
        "edge.",
    )
    rear_radius: PositiveLength = Field(
        default=written("3.5 mm"), description="Radius of the rear edge of a spike or limb."
    )
    tip_thickness: PositiveLength = Field(
        default=written("1 mm"), description="Thickness of a spike or limb at its tip."
    )
    lean: Length = Field(
        default=written("2.5 mm"), description="Distance of the tip behind the root."
    )


class _Spiked(_CurvedFin):
    spike_pitch: PositiveLength = Field(
        default=written("6 mm"), description="Distance between rows of spikes."
    )
    spike_height: PositiveLength = Field(
        default=written("5 mm"), description="Height of the spikes above the skin."
    )
    root_thickness: PositiveLength = Field(
        default=written("3 mm"),
        description="Thickness of a spike at its root, along x. A broad root matches the measured "
        "stiffness better than a thin arc.",
    )
    spike_columns: WholeNumber | None = Field(
        default=None,
        ge=1,
        le=100,
        description="Number of quadrilaterals or hexahedra across a spike, along the axis. "
        "Default: from `element_size`.",
    )


class _SpikedInSpace(_Spiked):
    rows: WholeNumber = Field(default=5, ge=0, le=100, description="Number of rows of spikes.")
    spike_width: PositiveLength = Field(
        default=written("2 mm"), description="Width of a spike around the skin."
    )
    element_size: PositiveLength = Field(
        default=written("0.7 mm"), description="Approximate edge length of the cells."
    )
    spike_layers: WholeNumber | None = Field(
        default=None,
        ge=1,
        le=100,
        description="Number of hexahedra across the width of a spike. Default: from "
        "`element_size`.",
    )


class PfrSectionMesh(_PfrSkin, _Spiked):
    """Longitudinal section of the PufferFace Robot (PFR): two skin strips with
    curved spikes (2D).
    """

    built_by: ClassVar[str] = "softsim.robots.pfr:pfr_section"
    generator: Literal["pfr_section"] = Field(description="Name of the mesh generator.")
    spikes_per_strip: WholeNumber = Field(
        default=5, ge=0, le=100, description="Number of spikes on each strip."
    )
    element_size: PositiveLength = Field(
        default=written("0.35 mm"), description="Approximate edge length of the cells."
    )


class BoxMesh(_Filled):
    """Box (3D) with one corner at the origin. Sets: left, right, bottom, top, back,
    front, surface.
    """

    built_by: ClassVar[str] = "softsim.robots.block:box"
    generator: Literal["box"] = Field(description="Name of the mesh generator.")
    length: PositiveLength = Field(description="Size along x.")
    width: PositiveLength = Field(description="Size along z.")
    height: PositiveLength = Field(description="Size along y.")
    element_size: PositiveLength = Field(
        description="Longest edge of the hexahedra, before they are divided into tetrahedra."
    )


class PfrMeridianMesh(_PfrSkin):
    """Axisymmetric half section of the PFR's skin: x is the radius, y the axis.
    Rings represent the spikes.
    """

    built_by: ClassVar[str] = "softsim.robots.pfr:pfr_meridian"
    generator: Literal["pfr_meridian"] = Field(description="Name of the mesh generator.")
    ring_rows: WholeNumber = Field(default=0, ge=0, le=100, description="Number of rings.")
    ring_pitch: PositiveLength = Field(
        default=written("6 mm"), description="Distance between rings."
    )
    ring_height: PositiveLength = Field(
        default=written("5 mm"), description="Height of a ring above the skin."
    )
    ring_thickness: PositiveLength = Field(
        default=written("3 mm"), description="Thickness of a ring along the axis."
    )
    element_size: PositiveLength = Field(
        default=written("0.25 mm"), description="Approximate edge length of the cells."
    )


class PfrSolidMesh(_PfrSkin, _SpikedInSpace):
    """The PFR's skin with its curved spikes (3D). The axis is x."""

    built_by: ClassVar[str] = "softsim.robots.pfr:pfr_solid"
    generator: Literal["pfr_solid"] = Field(description="Name of the mesh generator.")
    spikes_around: WholeNumber = Field(
        default=14, ge=1, le=100, description="Number of spikes in a row."
    )


class SpikePatchMesh(_Skin, _SpikedInSpace):
    """Flat piece of the PFR's skin with curved spikes (3D), a specimen for a press. The underside
    is at y = 0; the spikes point up and lean towards -x.
    """

    built_by: ClassVar[str] = "softsim.robots.spikes:spike_patch"
    generator: Literal["spike_patch"] = Field(description="Name of the mesh generator.")
    cells: CellKind = Field(
        default="quad", description="Cell type. quad: hexahedra. simplex: tetrahedra."
    )
    rows: WholeNumber = Field(
        default=5, ge=1, le=100, description="Number of rows of spikes along x."
    )
    columns: WholeNumber = Field(
        default=3, ge=1, le=100, description="Number of spikes in a row, along z."
    )
    column_pitch: PositiveLength = Field(
        default=written("3.59 mm"),
        description="Distance between columns. Default: that of the PFR halfway through its skin, "
        "16 mm pi / 14.",
    )
    skin_thickness: PositiveLength = Field(
        default=written("1 mm"), description="Thickness of the skin."
    )


class _Leafbot(_CurvedFin):
    length: PositiveLength = Field(default=written("64 mm"), description="Length of the backbone.")
    thickness: PositiveLength = Field(
        default=written("2 mm"), description="Thickness of the backbone."
    )
    rows: WholeNumber = Field(default=5, ge=1, le=100, description="Number of rows of limbs.")
    limb_pitch: PositiveLength = Field(
        default=written("14 mm"), description="Distance between rows of limbs."
    )
    limb_height: PositiveLength = Field(
        default=written("5 mm"), description="Height of the limbs below the backbone."
    )
    root_thickness: PositiveLength = Field(
        default=written("4 mm"), description="Thickness of a limb at its root, along x."
    )
    element_size: PositiveLength = Field(
        default=written("1 mm"), description="Approximate edge length of the cells."
    )
    backbone_rows: WholeNumber | None = Field(
        default=None,
        ge=1,
        le=100,
        description="Number of quadrilaterals or hexahedra through the backbone. Default: from "
        "`element_size`.",
    )
    limb_columns: WholeNumber | None = Field(
        default=None,
        ge=1,
        le=100,
        description="Number of quadrilaterals or hexahedra across a limb, along x. Default: from "
        "`element_size`.",
    )


class LeafbotSectionMesh(_Leafbot):
    """Longitudinal section of Leafbot (2D): a backbone on rows of limbs, with the
    tips at y = 0.
    """

    built_by: ClassVar[str] = "softsim.robots.leafbot:leafbot_section"
    generator: Literal["leafbot_section"] = Field(description="Name of the mesh generator.")
    cells: CellKind = Field(
        default="quad", description="Cell type. quad: quadrilaterals. simplex: triangles."
    )
    rows_under_head: WholeNumber = Field(
        default=2, ge=1, le=100, description="Number of rows, from the front, below the head."
    )


class LeafbotSolidMesh(_Leafbot):
    """Leafbot (3D) with two motors: a backbone on rows of limbs, with the tips at y = 0. The left
    side (z < 0) and the right side each have two limbs per row and a head.
    """

    built_by: ClassVar[str] = "softsim.robots.leafbot:leafbot_solid"
    generator: Literal["leafbot_solid"] = Field(description="Name of the mesh generator.")
    cells: CellKind = Field(
        default="quad", description="Cell type. quad: hexahedra. simplex: tetrahedra."
    )
    width: PositiveLength = Field(
        default=written("45 mm"), description="Width of the backbone along z."
    )
    side_distance: PositiveLength = Field(
        default=written("30 mm"), description="Distance between the centres of the two sides."
    )
    limb_width: PositiveLength = Field(
        default=written("2 mm"), description="Width of a limb along z."
    )
    limb_distance: PositiveLength = Field(
        default=written("13 mm"),
        description="Distance between the centres of the two limbs of a row on one side.",
    )
    head_row: WholeNumber = Field(
        default=3, ge=1, le=100, description="First row below the heads, counted from the front."
    )
    rows_under_head: WholeNumber = Field(
        default=1, ge=1, le=100, description="Number of rows below each head."
    )
    limb_layers: WholeNumber | None = Field(
        default=None,
        ge=1,
        le=100,
        description="Number of hexahedra across the width of a limb. Default: from `element_size`.",
    )


class _Pneunet(_Filled):
    cells: CellKind = Field(
        default="quad", description="Cell type. quad: hexahedra. simplex: tetrahedra."
    )
    height: PositiveLength = Field(
        default=written("14 mm"), description="Height of the whole actuator."
    )
    roof_thickness: PositiveLength = Field(
        default=written("2 mm"), description="Thickness of the roof above the chambers."
    )
    base_thickness: PositiveLength = Field(
        default=written("2 mm"), description="Thickness of the base below the chambers."
    )
    channel_height: PositiveLength = Field(
        default=written("2 mm"), description="Height of the channel that connects the chambers."
    )
    bridge_thickness: PositiveLength = Field(
        default=written("2 mm"),
        description="Thickness of the material above the channel between two chambers.",
    )


class PneunetMesh(_Pneunet):
    """Half of a pneu-net actuator (3D): a row of chambers on a common channel along x, with its
    root at x = 0, its underside at y = 0 and its plane of symmetry at z = 0. Sets: bottom, root,
    end, middle, chamber (the inside), tip.
    """

    built_by: ClassVar[str] = "softsim.robots.pneunet:pneunet"
    generator: Literal["pneunet"] = Field(description="Name of the mesh generator.")
    chambers: WholeNumber = Field(default=6, ge=1, le=100, description="Number of chambers.")
    chamber_length: PositiveLength = Field(
        default=written("5 mm"), description="Inner length of a chamber along x."
    )
    wall_thickness: PositiveLength = Field(
        default=written("1.5 mm"), description="Thickness of the chamber walls."
    )
    gap: PositiveLength = Field(default=written("1 mm"), description="Gap between two chambers.")
    width: PositiveLength = Field(
        default=written("15 mm"), description="Width of the whole actuator along z."
    )
    element_size: PositiveLength = Field(
        default=written("1.5 mm"), description="Longest edge of the cells."
    )


class QuadrupedMesh(_Pneunet):
    """Quadruped (3D): a torso with two pneu-nets as legs along x at its front (+x) and two at its
    rear, at the left (-z) and the right of z = 0, with its underside at y = 0. Sets: bottom, torso,
    front_left, front_right, rear_left, rear_right (the inside of a leg), tip_front_left ... (the
    lower edge of a leg's tip).
    """

    built_by: ClassVar[str] = "softsim.robots.pneunet:quadruped"
    generator: Literal["quadruped"] = Field(description="Name of the mesh generator.")
    chambers: WholeNumber = Field(default=4, ge=1, le=100, description="Chambers of a leg.")
    chamber_length: PositiveLength = Field(
        default=written("6 mm"), description="Inner length of a chamber along x."
    )
    wall_thickness: PositiveLength = Field(
        default=written("2 mm"), description="Thickness of the chamber walls."
    )
    gap: PositiveLength = Field(default=written("2 mm"), description="Gap between two chambers.")
    leg_width: PositiveLength = Field(
        default=written("16 mm"), description="Width of a leg along z."
    )
    leg_distance: PositiveLength = Field(
        default=written("12 mm"), description="Gap along z between the left and the right leg."
    )
    torso_length: PositiveLength = Field(
        default=written("20 mm"), description="Length of the torso between front and rear legs."
    )
    element_size: PositiveLength = Field(
        default=written("3 mm"), description="Longest edge of the cells."
    )


class _Bellows(GeneratedMesh):
    convolutions: WholeNumber = Field(
        default=4, ge=1, le=100, description="Number of convolutions, of two rings each."
    )
    root_radius: PositiveLength = Field(
        default=written("10 mm"), description="Radius at which the flat rings begin."
    )
    crown_radius: PositiveLength = Field(
        default=written("16 mm"), description="Radius at which the flat rings end."
    )
    ring_spacing: PositiveLength = Field(
        default=written("4 mm"),
        description="Distance between the middle planes of two rings, which half circles join.",
    )
    wall_thickness: PositiveLength = Field(
        default=written("1.5 mm"), description="Thickness of the wall."
    )
    lid_thickness: PositiveLength = Field(
        default=written("3.5 mm"), description="Thickness of the lid at the top."
    )


class BellowsSectionMesh(_Bellows):
    """Half section of a bellows with flat rings, to be revolved (2D, axisymmetric): open at its
    base at y = 0, with a lid at the top. Sets: base, chamber (the inside), folds (all that can
    touch), top.
    """

    built_by: ClassVar[str] = "softsim.robots.revolved:bellows_section"
    generator: Literal["bellows_section"] = Field(description="Name of the mesh generator.")
    element_size: PositiveLength = Field(
        default=written("0.55 mm"), description="Longest edge of the cells along the wall."
    )


class BellowsSolidMesh(_Bellows):
    """Bellows with flat rings (3D) along y: open at its base at y = 0, with a lid at the top. Sets:
    base, chamber (the inside), folds (all that can touch), top.
    """

    built_by: ClassVar[str] = "softsim.robots.revolved:bellows_solid"
    generator: Literal["bellows_solid"] = Field(description="Name of the mesh generator.")
    element_size: PositiveLength = Field(
        default=written("1.5 mm"), description="Longest edge of the cells along the wall."
    )


class BendingActuatorMesh(GeneratedMesh):
    """Tube along x (3D) from x = 0, closed by a plug at its tip. Fibres around it and a strip on
    its bottom make it bend. Sets: root, chamber (the inside), tip (the end face of the plug),
    outside, bottom (the quarter of the outside that faces -y).
    """

    built_by: ClassVar[str] = "softsim.robots.revolved:bending_actuator"
    generator: Literal["bending_actuator"] = Field(description="Name of the mesh generator.")
    length: PositiveLength = Field(
        default=written("60 mm"), description="Length of the chamber along x."
    )
    inner_radius: PositiveLength = Field(
        default=written("8 mm"), description="Radius of the chamber."
    )
    wall_thickness: PositiveLength = Field(
        default=written("2 mm"), description="Thickness of the wall of the tube."
    )
    plug_thickness: PositiveLength = Field(
        default=written("4 mm"), description="Thickness of the plug at the tip."
    )
    element_size: PositiveLength = Field(
        default=written("2 mm"), description="Longest edge of the cells along the tube."
    )


class FileMesh(Spec):
    """Mesh file (gmsh .msh, VTK .vtu, ABAQUS .inp) with linear cells, or geometry (STEP, IGES,
    BREP, STL) that is meshed with `size`.
    """

    file: Text = Field(description="Path, relative to the file in which it is given.")
    size: PositiveLength | None = Field(
        default=None,
        description="Approximate longest edge of the cells, for geometry only. Needs the package "
        "gmsh.",
    )
    cells: CellKind = Field(
        default="simplex",
        description="Cell type, for geometry only. simplex: tetrahedra. quad: hexahedra, of a "
        "solid with a constant section along x, y or z.",
    )
    length_unit: PositiveLength = Field(
        default=written("1 mm"), description="Length of one unit in the file."
    )
    instance: Text | None = Field(
        default=None,
        description="Name of the *INSTANCE to read from an ABAQUS file with several. It is placed "
        "as in the assembly.",
    )
    reduce_order: bool = Field(
        default=False,
        description="Read second-order cells as linear ones, without their mid-side nodes.",
    )


def _mesh_kind(value: Any) -> str | None:
    if isinstance(value, FileMesh) or (isinstance(value, dict) and "file" in value):
        return "file"
    if isinstance(value, dict):
        value = value.get("generator")
        return value if isinstance(value, str) else None
    return getattr(value, "generator", None)


MeshSource = Annotated[
    Annotated[BlockMesh, Tag("block")]
    | Annotated[PfrSectionMesh, Tag("pfr_section")]
    | Annotated[BoxMesh, Tag("box")]
    | Annotated[PfrMeridianMesh, Tag("pfr_meridian")]
    | Annotated[PfrSolidMesh, Tag("pfr_solid")]
    | Annotated[LeafbotSectionMesh, Tag("leafbot_section")]
    | Annotated[LeafbotSolidMesh, Tag("leafbot_solid")]
    | Annotated[SpikePatchMesh, Tag("spike_patch")]
    | Annotated[PneunetMesh, Tag("pneunet")]
    | Annotated[QuadrupedMesh, Tag("quadruped")]
    | Annotated[BellowsSectionMesh, Tag("bellows_section")]
    | Annotated[BellowsSolidMesh, Tag("bellows_solid")]
    | Annotated[BendingActuatorMesh, Tag("bending_actuator")]
    | Annotated[FileMesh, Tag("file")],
    Discriminator(_mesh_kind),
]
