"""The shipped bellows, computed by FElupe: an independent finite-element answer.

On the sides of the scene's own mesh, but with other elements: biquadratic quadrilaterals of nine
nodes, fully integrated: they bend and shear without hourglass modes, and with a Poisson's ratio of
0.475 they hardly lock. (With one pressure each, as in felupe_skin.py, they are too soft: what a
bent cell resists in volume, on one side more than on the other, is lost.)
Dragon Skin 30 by Yeoh's law, W(I1_bar) + (kappa/2)(J - 1)^2, C10 96 kPa, C20 9.5 kPa,
kappa = 20 mu0, axisymmetric, follower pressure inside, static, without contact: folds that touch
are not for it.

FElupe's law needs its extra package tensortrax: tests take this module through
`pytest.importorskip("felupe")` and `pytest.importorskip("tensortrax")`.
"""

import felupe as fem
import numpy as np
from felupe.constitution.tensortrax import Hyperelastic
from felupe.constitution.tensortrax.models.hyperelastic import yeoh
from tensortrax.math import sqrt
from tensortrax.math.linalg import det

C10, C20 = 96e3, 9.5e3
BULK_MODULUS = 40.0 * C10

# The largest step in pressure that Newton is given [Pa].
PRESSURE_STEP = 250.0


def compressible_yeoh(C):
    """W of the right Cauchy-Green tensor [Pa]."""
    return yeoh(C, C10, C20, 0.0) + 0.5 * BULK_MODULUS * (sqrt(det(C)) - 1.0) ** 2


def response(bellows, pressure, top_is_held):
    """Mean displacement [m] of the corners on top along the axis at a pressure [Pa], and the force
    [N] that holds the top, if it does.

    bellows: softsim's mesh, its radius along x, with facet sets base, which is held, top, chamber.
    """
    # FElupe has the axis along x: the section is mirrored, and its cells are turned.
    corners = bellows.points[:, ::-1]
    mesh = fem.Mesh(corners, bellows.cells[:, ::-1], "quad").convert(
        order=2, calc_points=True, calc_midfaces=True
    )
    displacement = fem.FieldAxisymmetric(fem.RegionBiQuadraticQuad(mesh), dim=2)
    field = fem.FieldContainer([displacement])

    def on(name):
        """Which points lie on the facets of a set: their corners and middles."""
        ends = corners[bellows.facet_sets[name]]
        places = np.concatenate([ends[:, 0], ends[:, 1], ends.mean(axis=1)])
        apart = np.linalg.norm(mesh.points[:, None] - places, axis=2).min(axis=1)
        return apart < 1e-6 * np.ptp(corners)

    boundaries = {
        "base": fem.Boundary(displacement, mask=on("base")),
        "axis": fem.Boundary(displacement, fy=0.0, skip=(True, False)),
    }
    if top_is_held:
        boundaries["top"] = fem.Boundary(displacement, mask=on("top"))
    held, free = fem.dof.partition(field, boundaries)
    silicone = fem.SolidBody(Hyperelastic(compressible_yeoh), field)
    inner_face = fem.RegionBiQuadraticQuadBoundary(
        mesh, only_surface=True, mask=on("chamber"), ensure_3d=True
    )
    load = fem.SolidBodyPressure(fem.FieldContainer([fem.FieldAxisymmetric(inner_face, dim=2)]))
    for step in np.linspace(0.0, pressure, int(np.ceil(pressure / PRESSURE_STEP)) + 1)[1:]:
        load.update(step)
        field = fem.newtonraphson(
            x0=field,
            items=[silicone, load],
            dof0=held,
            dof1=free,
            ext0=np.zeros(held.size),
            verbose=0,
        ).x
    top = np.unique(bellows.facet_sets["top"])  # corners keep their numbers
    extension = field[0].values[top, 0].mean()
    pull = silicone.assemble.vector().toarray().reshape(-1, 2)[on("top"), 0].sum()
    return extension, -pull
