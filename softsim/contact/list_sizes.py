"""How far Verlet lists look, and how long they may get: known before any kernel is."""

import numpy as np

# The margin over the mean side. Wider: more to look at in each increment. Narrower: made anew more
# often. With DEPTH it is less than NEIGHBOURHOOD, so that lists are empty at rest.
MARGIN = 1.5
# Facets that a node may have near it, nodes that a facet may, in facets of equal length: those of
# both sides of a fin pressed to half its length, twice over, in the plane; in space as many across.
MOST_FACETS = {2: 32, 3: 128}
MOST_NODES = {2: 32, 3: 96}


def margin_and_room(facet_size: np.ndarray) -> tuple[float, float, int]:
    """Margin and longest side [m] for facets of these sides (f,) [m], and how much more room lists
    need than between facets of equal sides.
    """
    mean, longest = float(facet_size.mean()), float(facet_size.max())
    return MARGIN * mean, longest, int(np.ceil(longest / mean))
