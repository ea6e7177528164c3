"""Structures: cables, fibres, layers, ties. Pulled cables stand in scene/loads.py."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from softsim.scene.quantities import (
    Angle,
    Axis,
    Name,
    NotNegativeBendingStiffness,
    NotNegativeForce,
    NotNegativeLength,
    Number,
    Point,
    PositiveDensity,
    PositiveForce,
    PositiveLength,
    PositiveLineDensity,
    PositivePressure,
    SetReference,
    Spec,
    written,
)


class CableSpec(Spec):
    """Cable (tube, wire, thread) with stretching and bending stiffness, without torsional
    stiffness, stress-free when straight. It touches walls, but no bodies. Its node sets are
    NAME.start and NAME.end (the ends), NAME.start_segment and NAME.end_segment (two nodes, which
    also hold the direction of an end), and NAME.all. The history gets a column NAME_tension, the
    tension of the first segment that is not held.
    """

    points: Annotated[tuple[Point, ...], Field(min_length=2)] = Field(
        description="Vertices of the line along which the cable lies at the start, unstretched."
    )
    segment_length: PositiveLength = Field(
        description="Approximate distance between nodes; the number of segments is rounded."
    )
    diameter: PositiveLength = Field(description="Outer diameter, used for contact with walls.")
    mass_per_length: PositiveLineDensity = Field(description="Mass per length.")
    stretching_stiffness: PositiveForce = Field(description="Axial stiffness E A.")
    bending_stiffness: NotNegativeBendingStiffness = Field(
        description="Bending stiffness E I; for a tube E pi (D^4 - d^4) / 64."
    )
    friction_coefficient: Number | None = Field(
        default=None,
        ge=0.0,
        description="Friction coefficient on walls. Default: `contact.friction_coefficient`.",
    )
    end_drag: NotNegativeForce = Field(
        default=written("0 N"),
        description="Coulomb friction along the cable at its end, which represents a continuation "
        "that is not simulated. At rest it resists up to this force.",
    )


# -------------------------------------------------------------------------------------------------
# Fibres in bodies: threads, wires.


class Helix(Spec):
    """Helix about an axis along x, y or z. With zero pitch it is a ring."""

    center: Point = Field(description="Point on the axis at which the helix starts.")
    direction: Axis = Field(description="Direction of the axis.")
    radius: PositiveLength = Field(description="Radius of the helix.")
    pitch: NotNegativeLength = Field(
        description="Advance along the axis per turn; 0 mm for a ring. The angle to the axis has "
        "the tangent 2 pi radius / pitch."
    )
    turns: Number = Field(gt=0.0, description="Number of turns, which need not be an integer.")
    handedness: Literal["right", "left"] = Field(
        default="right", description="right: right-handed, like a common screw. left: left-handed."
    )
    start_angle: Angle = Field(
        default=written("0 deg"),
        description="Angle of the start about the axis, measured from y if the axis is x, from z "
        "if it is y, from x if it is z.",
    )


class FibreSpec(Spec):
    """Fibre (thread, wire) embedded in a body or wound on it. It follows Hooke's law in the
    engineering strain, has no bending stiffness and by default goes slack under compression. The
    history gets a column NAME_tension, the largest tension along the fibre.
    """

    body: Name = Field(description="Body in which the fibre lies.")
    points: Annotated[tuple[Point, ...], Field(min_length=2)] | None = Field(
        default=None, description="Vertices of the line along which the fibre lies, unstretched."
    )
    helix: Helix | None = Field(
        default=None, description="Helix along which the fibre lies, instead of `points`."
    )
    spacing: PositiveLength = Field(
        description="Approximate distance between the points at which the fibre is attached to "
        "the elements; choose about half the element size. The number of segments is rounded."
    )
    tolerance: PositiveLength | None = Field(
        default=None,
        description="Largest distance of the fibre outside the body, onto which it is moved. "
        "Default: 5 % of the mean edge of the body's surface facets.",
    )
    diameter: PositiveLength = Field(
        description="Diameter of the circular cross section. It is ignored by contact."
    )
    youngs_modulus: PositivePressure = Field(description="Young's modulus.")
    density: PositiveDensity = Field(description="Mass density.")
    bears_compression: bool = Field(
        default=False,
        strict=True,
        description="True if the fibre also resists compression, like a wire that cannot buckle.",
    )

    @model_validator(mode="after")
    def _has_one_line(self) -> "FibreSpec":
        if (self.points is None) == (self.helix is None):
            raise ValueError("needs either points or a helix: give one of them")
        return self


# -------------------------------------------------------------------------------------------------
# Layers on surfaces, and ties.


class Tie(Spec):
    """Tie constraint between nodes and a surface with a non-matching mesh, as if glued. The nodes
    are moved onto the facets before the start. If the meshes differ in size, tie the nodes of the
    finer mesh to the facets of the coarser.
    """

    nodes: SetReference = Field(description='Node set that is tied: "paper.top".')
    facets: SetReference = Field(
        description='Facet set to which the nodes are tied: "finger.bottom".'
    )
    tolerance: PositiveLength | None = Field(
        default=None,
        description="Largest distance of a node from the facets. Default: 5 % of the mean facet "
        "edge.",
    )


class LayerSpec(Spec):
    """Thin layer (paper, cloth, film) bonded to the surface of a body. It is a membrane of St.
    Venant-Kirchhoff material for small strains, without bending stiffness. Its thickness is
    ignored by contact.
    """

    facets: SetReference = Field(description='Facet set that the layer covers: "finger.bottom".')
    thickness: PositiveLength = Field(description="Thickness at rest.")
    youngs_modulus: PositivePressure = Field(description="Young's modulus.")
    poisson_ratio: Number = Field(default=0.3, ge=0.0, lt=0.5, description="Poisson's ratio.")
    density: PositiveDensity = Field(description="Mass density.")


STRUCTURES = {
    "cables": "softsim.structures.cable:cables",
    "layers": "softsim.structures.layer:layers",
    "fibres": "softsim.structures.fibre:fibres",
}
"""Key of a scene -> entry point of the function that builds its structures.

The order is that of their forces in a sum.
"""
