"""Normal contact law: a spring on the penetration with a dashpot that never pulls."""

import taichi as ti


@ti.func
def normal_force(gap, gap_rate, penalty_stiffness, damping):
    """N = max(0, -k_n g - c_n dg/dt) where g < 0, else 0 [N]."""
    force = gap * 0.0
    if gap < 0.0:
        force = ti.max(0.0, -penalty_stiffness * gap - damping * gap_rate)
    return force
