"""Coulomb friction with memory: a spring from a slip anchor, cut back to mu N.

Written as elastoplasticity (Wriggers, Computational Contact Mechanics, ch. 5): the trial force is
that of the spring between the point where the node sticks (the anchor) and where it is; beyond
mu N the node slips and the anchor is dragged along. A node that sticks is held by a spring, so it
cannot creep, as it would under a velocity-regularised law.
"""

import taichi as ti


@ti.func
def slip(stretch, tangential_stiffness, friction_limit):
    """Slip vector [m] that brings the spring force k_t |stretch| back to mu N; zero when sticking.

    `stretch` is the tangential vector from the anchor to the node [m].
    """
    length = stretch.norm()
    excess = length - friction_limit / tangential_stiffness
    result = stretch * 0.0
    if excess > 0.0:
        result = stretch * (excess / length)
    return result
