"""Where the mesh of a body comes from: a generator with its sizes, or a file."""

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from softsim.mesh.band import CellKind
from softsim.scene.part import Part
from softsim.scene.quantities import Length, PositiveLength, Text, WholeNumber, written


class _Filled(Part):
    cells: CellKind = Field(
        default="simplex",
        description="simplex: triangles or tetrahedra. quad: quadrilaterals or hexahedra.",
    )


class BlockMesh(_Filled):
    """A rectangle; sets bottom, top, left, right, surface."""

    generator: Literal["block"] = Field(description="Which generator makes the mesh.")
    length: PositiveLength = Field(description="Size along x.")
    height: PositiveLength = Field(description="Size along y, from y = 0 upwards.")
    element_size: PositiveLength = Field(
        description="Longest side of the cells, before they are cut into triangles."
    )


class _Skin(_Filled):
    skin_rows: WholeNumber | None = Field(
        default=None,
        ge=1,
        le=100,
        description="Quadrilaterals or hexahedra through the skin; else by element_size.",
    )


class _PfrSkin(_Skin):
    inner_diameter: PositiveLength = Field(default=written("15 mm"), description="Of the skin.")
    outer_diameter: PositiveLength = Field(
        default=written("17 mm"), description="Of the skin, no spikes or rings."
    )
    free_length: PositiveLength = Field(
        default=written("30 mm"), description="Skin between the knots."
    )


class _CurvedFin(_Filled):
    front_radius: PositiveLength = Field(
        default=written("5 mm"),
        description="Of the front edge of a spike or limb; large: it is straight.",
    )
    rear_radius: PositiveLength = Field(default=written("3.5 mm"), description="Of its rear edge.")
    tip_thickness: PositiveLength = Field(default=written("1 mm"), description="Of it at its tip.")
    lean: Length = Field(
        default=written("2.5 mm"), description="How far the tip lies behind the root."
    )


class _Spiked(_CurvedFin):
    spike_pitch: PositiveLength = Field(
        default=written("6 mm"), description="Distance between rows."
    )
    spike_height: PositiveLength = Field(default=written("5 mm"), description="Above the skin.")
    root_thickness: PositiveLength = Field(
        default=written("3 mm"), description="Spike at its root, along x; a broad root matches "
        "the measured stiffness better than a thin arc."
    )  # fmt: skip
    spike_columns: WholeNumber | None = Field(
        default=None,
        ge=1,
        le=100,
        description="Quadrilaterals or hexahedra across a spike, along the axis; else by "
        "element_size.",
    )


class _SpikedInSpace(_Spiked):
    rows: WholeNumber = Field(default=5, ge=0, le=100, description="Rows of spikes.")
    spike_width: PositiveLength = Field(
        default=written("2 mm"), description="Spike across, around the skin."
    )
    element_size: PositiveLength = Field(
        default=written("0.7 mm"), description="Edge length of the cells, about."
    )
    spike_layers: WholeNumber | None = Field(
        default=None,
        ge=1,
        le=100,
        description="Hexahedra across the width of a spike; else by element_size.",
    )


class PfrSectionMesh(_PfrSkin, _Spiked):
    """The PufferFace Robot's section along its axis: two skin strips with curved spikes."""

    generator: Literal["pfr_section"] = Field(description="Which generator makes the mesh.")
    spikes_per_strip: WholeNumber = Field(default=5, ge=0, le=100, description="Rows of spikes.")
    element_size: PositiveLength = Field(
        default=written("0.35 mm"), description="Edge length of the cells, about."
    )


class BoxMesh(_Filled):
    """A block in space, from the origin; sets left, right, bottom, top, back, front, surface."""

    generator: Literal["box"] = Field(description="Which generator makes the mesh.")
    length: PositiveLength = Field(description="Size along x.")
    width: PositiveLength = Field(description="Size along z.")
    height: PositiveLength = Field(description="Size along y.")
    element_size: PositiveLength = Field(description="Longest edge of the bricks, split or not.")


class PfrMeridianMesh(_PfrSkin):
    """The PFR's skin as a half section: x is the radius, y the axis; rings stand for spikes."""

    generator: Literal["pfr_meridian"] = Field(description="Which generator makes the mesh.")
    ring_rows: WholeNumber = Field(default=0, ge=0, le=100, description="Rows of rings.")
    ring_pitch: PositiveLength = Field(
        default=written("6 mm"), description="Distance between rows."
    )
    ring_height: PositiveLength = Field(default=written("5 mm"), description="Above the skin.")
    ring_thickness: PositiveLength = Field(
        default=written("3 mm"), description="Of a ring along the axis."
    )
    element_size: PositiveLength = Field(
        default=written("0.25 mm"), description="Edge length of the cells, about."
    )


class PfrSolidMesh(_PfrSkin, _SpikedInSpace):
    """The PFR's skin in space with its curved spikes; the axis is x."""

    generator: Literal["pfr_solid"] = Field(description="Which generator makes the mesh.")
    spikes_around: WholeNumber = Field(default=14, ge=1, le=100, description="Spikes in a row.")


class SpikePatchMesh(_Skin, _SpikedInSpace):
    """A flat piece of the PFR's skin in space with its curved spikes: a sample for a press. The
    underside is on y = 0, spikes point up and lean towards -x.
    """

    generator: Literal["spike_patch"] = Field(description="Which generator makes the mesh.")
    cells: CellKind = Field(default="quad", description="quad: hexahedra; simplex: tetrahedra.")
    rows: WholeNumber = Field(default=5, ge=1, le=100, description="Rows of spikes, along x.")
    columns: WholeNumber = Field(default=3, ge=1, le=100, description="Spikes in a row, along z.")
    column_pitch: PositiveLength = Field(
        default=written("3.59 mm"),
        description="Distance between columns: the PFR's, 16 mm pi / 14 halfway through its skin.",
    )
    skin_thickness: PositiveLength = Field(default=written("1 mm"), description="Of the skin.")


class _Leafbot(_CurvedFin):
    length: PositiveLength = Field(default=written("64 mm"), description="Of the backbone.")
    thickness: PositiveLength = Field(default=written("2 mm"), description="Of the backbone.")
    rows: WholeNumber = Field(default=5, ge=1, le=100, description="Rows of limbs.")
    limb_pitch: PositiveLength = Field(
        default=written("14 mm"), description="Distance between rows."
    )
    limb_height: PositiveLength = Field(default=written("5 mm"), description="Below the backbone.")
    root_thickness: PositiveLength = Field(
        default=written("4 mm"), description="Limb at its root, along x."
    )
    element_size: PositiveLength = Field(
        default=written("1 mm"), description="Edge length of the cells, about."
    )
    backbone_rows: WholeNumber | None = Field(
        default=None, ge=1, le=100, description="Quadrilaterals or hexahedra through the backbone; "
        "else by element_size.",
    )  # fmt: skip
    limb_columns: WholeNumber | None = Field(
        default=None, ge=1, le=100, description="Quadrilaterals or hexahedra across a limb, along "
        "x; else by element_size.",
    )  # fmt: skip


class LeafbotSectionMesh(_Leafbot):
    """Leafbot's section along its length: a backbone on rows of limbs, tips on y = 0."""

    generator: Literal["leafbot_section"] = Field(description="Which generator makes the mesh.")
    cells: CellKind = Field(default="quad", description="quad: quadrilaterals; simplex: triangles.")
    rows_under_head: WholeNumber = Field(
        default=2, ge=1, le=100, description="Rows, from the front, over which the head stands."
    )


class LeafbotSolidMesh(_Leafbot):
    """Leafbot in space, widened for two motors: a backbone on rows of limbs, tips on y = 0, a left
    side (z < 0) and a right one, each with two limbs a row and a head.
    """

    generator: Literal["leafbot_solid"] = Field(description="Which generator makes the mesh.")
    cells: CellKind = Field(default="quad", description="quad: hexahedra; simplex: tetrahedra.")
    width: PositiveLength = Field(default=written("45 mm"), description="Of the backbone, along z.")
    side_distance: PositiveLength = Field(
        default=written("30 mm"), description="Between the middles of both sides."
    )
    limb_width: PositiveLength = Field(default=written("2 mm"), description="Of a limb, along z.")
    limb_distance: PositiveLength = Field(
        default=written("13 mm"), description="Between the middles of the two limbs of a row and "
        "side."
    )  # fmt: skip
    head_row: WholeNumber = Field(
        default=3, ge=1, le=100, description="First row under the heads, counted from the front."
    )
    rows_under_head: WholeNumber = Field(
        default=1, ge=1, le=100, description="Rows over which each head stands."
    )
    limb_layers: WholeNumber | None = Field(
        default=None, ge=1, le=100, description="Hexahedra across the width of a limb; else by "
        "element_size.",
    )  # fmt: skip


class PneunetMesh(_Filled):
    """Half of a pneu-net in space, a row of chambers on a common channel, from x = 0 on, underside
    on y = 0, its plane of symmetry z = 0. Sets bottom, root, end, middle, chamber (the inside),
    tip.
    """

    generator: Literal["pneunet"] = Field(description="Which generator makes the mesh.")
    cells: CellKind = Field(default="quad", description="quad: hexahedra; simplex: tetrahedra.")
    chambers: WholeNumber = Field(default=6, ge=1, le=100, description="In a row.")
    chamber_length: PositiveLength = Field(default=written("5 mm"), description="Inside, along x.")
    wall_thickness: PositiveLength = Field(
        default=written("1.5 mm"), description="Of the walls around the chambers."
    )
    width: PositiveLength = Field(default=written("15 mm"), description="Of the whole, along z.")
    gap: PositiveLength = Field(default=written("1 mm"), description="Between two chambers.")
    height: PositiveLength = Field(default=written("14 mm"), description="Of all of it.")
    roof_thickness: PositiveLength = Field(default=written("2 mm"), description="Above chambers.")
    base_thickness: PositiveLength = Field(default=written("2 mm"), description="Below them.")
    channel_height: PositiveLength = Field(
        default=written("2 mm"), description="Of the channel that joins the chambers."
    )
    bridge_thickness: PositiveLength = Field(
        default=written("2 mm"), description="Over the channel, between two chambers."
    )
    element_size: PositiveLength = Field(
        default=written("1.5 mm"), description="Longest side of the cells."
    )


class FileMesh(Part):
    """A mesh of linear cells from a file (gmsh .msh, VTK .vtu, ABAQUS .inp)."""

    file: Text = Field(description="Path, relative to the file that says so.")
    length_unit: PositiveLength = Field(
        default=written("1 mm"), description="Length of one unit in the file."
    )
    instance: Text | None = Field(
        default=None,
        description="Which *INSTANCE of an ABAQUS file, where the assembly has it.",
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


GeneratedMesh = (
    BlockMesh
    | PfrSectionMesh
    | BoxMesh
    | PfrMeridianMesh
    | PfrSolidMesh
    | LeafbotSectionMesh
    | LeafbotSolidMesh
    | SpikePatchMesh
    | PneunetMesh
)
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
    | Annotated[FileMesh, Tag("file")],
    Discriminator(_mesh_kind),
]
