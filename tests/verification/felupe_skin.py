"""The pipe robot's inflated skin, computed by FElupe: an independent finite-element answer.

A tube of inner radius 7.5 mm, outer radius 8.5 mm and length 30 mm, all displacements of both end
faces held, follower pressure inside, axisymmetric. Dragon Skin 10 by Yeoh's law,
W(I1_bar) + (kappa/2)(J - 1)^2, C10 36 kPa, C20 0.25 kPa, C30 0.023 kPa, kappa = 20 mu0.
Static, so below the limit point (between 8.35 and 8.4 kPa) only: beyond it Newton fails.

Found with 4, 6, 8 and 12 cells through the thickness, outer radius [mm]:
3 kPa 9.3583, 9.3584, 9.3584, 9.3584; 6 kPa 10.9042, 10.9045, 10.9046, 10.9047;
8 kPa 13.4535, 13.4579, 13.4601, 13.4623. What remains comes from the corners of the clamp.
An incompressible membrane reaches 9.30, 10.74 and 12.87 mm: the bulk modulus makes the difference
(with kappa a thousand times as large FElupe has 9.315, 10.727 and 12.678 mm).

FElupe's law needs its extra package tensortrax: tests take this module through
`pytest.importorskip("felupe")` and `pytest.importorskip("tensortrax")`.
"""

import felupe as fem
import numpy as np
from felupe.constitution.tensortrax import Hyperelastic
from felupe.constitution.tensortrax.models.hyperelastic import yeoh

INNER_RADIUS = 7.5e-3
OUTER_RADIUS = 8.5e-3
LENGTH = 30e-3
C10, C20, C30 = 36e3, 250.0, 23.0
BULK_MODULUS = 40.0 * C10

# The largest step in pressure that Newton is given [Pa]: it converges in a few rounds up to 8 kPa.
PRESSURE_STEP = 0.5e3


def outer_radius(pressures, cells_through_thickness=6):
    """Outer radius [m] at mid length at each of the rising `pressures` [Pa], as an array.

    Half the length, symmetric at mid length. Square bilinear cells with one pressure and one volume
    ratio a cell (mean dilatation), which do not lock in volume; square, so that bending of the wall
    at the clamp does not lock in shear either.
    """
    thickness = OUTER_RADIUS - INNER_RADIUS
    cells_along = round(cells_through_thickness * 0.5 * LENGTH / thickness)
    mesh = fem.Rectangle(  # x along the axis from the clamp to mid length, y the radius
        a=(0.0, INNER_RADIUS),
        b=(0.5 * LENGTH, OUTER_RADIUS),
        n=(cells_along + 1, cells_through_thickness + 1),
    )
    displacement = fem.FieldAxisymmetric(fem.RegionQuad(mesh), dim=2)
    field = fem.FieldContainer([displacement])
    boundaries = {
        "clamp": fem.Boundary(displacement, fx=0.0),
        "mid_length": fem.Boundary(displacement, fx=0.5 * LENGTH, skip=(False, True)),
    }
    held, free = fem.dof.partition(field, boundaries)

    skin = fem.SolidBodyNearlyIncompressible(
        Hyperelastic(yeoh, C10=C10, C20=C20, C30=C30), field, bulk=BULK_MODULUS
    )
    inner_face = fem.RegionQuadBoundary(
        mesh, only_surface=True, mask=np.isclose(mesh.y, INNER_RADIUS), ensure_3d=True
    )
    inner_field = fem.FieldContainer([fem.FieldAxisymmetric(inner_face, dim=2)])
    load = fem.SolidBodyPressure(inner_field)
    mid_outer = np.flatnonzero(
        np.isclose(mesh.x, 0.5 * LENGTH) & np.isclose(mesh.y, OUTER_RADIUS)
    ).item()

    radii = []
    reached = 0.0
    for pressure in pressures:
        steps = max(1, int(np.ceil(abs(pressure - reached) / PRESSURE_STEP)))
        for step in np.linspace(reached, pressure, steps + 1)[1:]:
            load.update(step)
            field = fem.newtonraphson(
                x0=field,
                items=[skin, load],
                dof0=held,
                dof1=free,
                ext0=np.zeros(held.size),
                verbose=0,
            ).x
        reached = pressure
        radii.append(OUTER_RADIUS + field[0].values[mid_outer, 1])
    return np.array(radii)
