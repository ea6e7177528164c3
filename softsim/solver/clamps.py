"""Warnings of nearly incompressible bodies that long elements at a clamp make too stiff.

An element with one point keeps its volume there. At a clamp the nodes of one face are held, so an
element that is pulled off the clamp can narrow at its far face only, by twice as much as it should,
and the next column would have to swell again, which its hourglass modes resist. The pressure of the
first column is too large by half, and the body too stiff: a strip of 8 heights, clamped at one end,
bends less by 6 % with 8 x 2 elements, 3 % with 16 x 4, 1 % with 32 x 4 (Poisson's ratio 0.475,
linear). With a column of length h and a body that reaches L from the clamp, h / (2 L) of its
deflection is missing, whatever its height. With one element through the height there is no such
error, as its point is not strained in bending, nor with a clamp that lets the body narrow.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from softsim.elements.region import Region
from softsim.model import Model

LARGEST_ERROR = 0.03
"""Estimated missing fraction of the deflection above which a warning is given."""
SLENDER = 2.0
"""Least reach of a body from a clamp, over the clamp's height: shorter bodies hardly bend."""
LEAST_POISSON_RATIO = 0.4
"""Lowest Poisson's ratio at small strain for which a warning is given: with less the effect is
below 2 % where it is 3 % at 0.475."""


def clamp_doubts(model: Model) -> dict[str, str]:
    """Return warnings, kind -> text, of clamped elements that are too long."""
    held = ~np.any(model.is_free, axis=1)
    found: dict[str, str] = {}
    for region in model.regions:
        law, kappa = region.material.law, region.material.bulk_modulus
        mu = law.initial_shear_modulus
        poisson_ratio = (3.0 * kappa - 2.0 * mu) / (6.0 * kappa + 2.0 * mu)
        if not region.has_hourglass_modes or poisson_ratio < LEAST_POISSON_RATIO:
            continue
        missing = missing_deflection(region, held[region.nodes])
        if missing > LARGEST_ERROR:
            found[f"clamp of {region.body}"] = (
                f"body '{region.body}': at a clamp, the elements are long and there are several "
                "through the height. A nearly incompressible body then bends too little, "
                f"here by about {100.0 * missing:.0f} %. Use shorter elements at the clamp, "
                "or one element through the height"
            )
    return found


def missing_deflection(region: Region, held: np.ndarray) -> float:
    """Return the largest estimate h / (2 L) of the missing fraction of a body's deflection.

    Parameters
    ----------
    region : Region
        Quadrilaterals or hexahedra.
    held : np.ndarray
        True for nodes of the body that are held in every direction, (n,).

    Returns
    -------
    float
        Largest over the clamps that have two elements or more through their height; 0 without one.
        A clamp is a connected face of elements; its height is its smaller extent.
    """
    dimension = region.points.shape[1]
    clamped = region.cells[held[region.cells].sum(axis=1) == 2 ** (dimension - 1)]
    if len(clamped) == 0:
        return 0.0
    on_clamp = held[clamped]
    count = len(clamped)
    rows = np.repeat(np.arange(count), on_clamp.sum(axis=1))
    meets = coo_matrix((np.ones(len(rows)), (rows, clamped[on_clamp])), (count, len(held)))
    pieces, piece_of = connected_components(meets @ meets.T, directed=False)
    return max(_missing(region.points, clamped[piece_of == k], held) for k in range(pieces))


def _missing(points: np.ndarray, cells: np.ndarray, held: np.ndarray) -> float:
    """Return the estimate for one clamp; 0 with one element through its height."""
    on_clamp = held[cells]
    corners = points[cells]
    near = np.where(on_clamp[..., None], corners, 0.0).sum(axis=1) / on_clamp.sum(axis=1)[:, None]
    far = np.where(on_clamp[..., None], 0.0, corners).sum(axis=1)
    far /= (~on_clamp).sum(axis=1)[:, None]
    length = float(np.linalg.norm(far - near, axis=1).mean())
    face = points[np.unique(cells[on_clamp])]
    # Principal directions of the face, the largest first; the last one of all is across it.
    directions = np.linalg.svd(face - face.mean(axis=0), full_matrices=True)[2]
    upright = directions[points.shape[1] - 2]
    height = float(np.ptp(face @ upright))
    along = np.where(on_clamp, corners @ upright, np.nan)
    side = float(np.mean(np.nanmax(along, axis=1) - np.nanmin(along, axis=1)))
    reach = float(np.linalg.norm(points - face.mean(axis=0), axis=1).max())
    bends = height > 1.5 * side and reach > SLENDER * height
    return 0.5 * length / reach if bends else 0.0
