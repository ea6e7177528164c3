"""The laws of contact: a spring on the penetration and a dashpot along the normal; Coulomb friction
with memory, a spring and a dashpot from a slip anchor, cut back to mu N.

Friction is written as elastoplasticity (Wriggers, Computational Contact Mechanics, ch. 5): the way
of a node along the surface is elastic slip s, which a spring and a dashpot resist, and slip proper,
which begins where their force reaches mu N and drags the anchor along:
    T = k_t s + c_t ds/dt,  |T| <= mu N.
A node that sticks is held by a spring, so it cannot creep, as it would under a velocity-regularised
law. The dashpot acts on the elastic slip alone (as ABAQUS/Explicit's contact damping): a node that
slides steadily does not feel it.

Sliding under a limit that follows N at once, an elastic body without damping excites itself: slip
falls together with small N, and mesh and body swing ever more (Adams 1995; Renardy 1992). The cure
is a limit with memory (Prakash and Clifton 1993; Cochard and Rice 2000; Rubin and Ampuero 2007),
    dL/dt = (mu N - L) (1 / t* + |V| / d)   while in contact,  |T| <= L,
of a time t* at rest and a slip d at the speed V; it begins as the mean of mu N.
"""

import taichi as ti

BEFORE_START = -1e30
"""Time of what has not happened yet [s], before any time of a run."""


@ti.func
def normal_force(gap, gap_rate, penalty_stiffness, damping):
    """N = max(0, -k_n g - c_n dg/dt) where g < 0, else 0 [N]."""
    force = gap * 0.0
    if gap < 0.0:
        force = ti.max(0.0, -penalty_stiffness * gap - damping * gap_rate)
    return force


@ti.func
def shear_force(stretch, before, stiffness, damping_rate):
    """k_t s + c_t (s - s_0) / dt [N] of the elastic slip s [m], s_0 one increment ago; it pulls the
    node back. damping_rate: c_t / dt [N/m].
    """
    return stiffness * stretch + damping_rate * (stretch - before)


@ti.func
def slip(stretch, before, stiffness, damping_rate, friction_limit):
    """Slip vector [m] by which the anchor follows so that |T| is at its limit; zero when sticking.

    stretch: the elastic slip that there would be without [m]; before: one increment ago.
    """
    trial = shear_force(stretch, before, stiffness, damping_rate)
    size = trial.norm()
    result = stretch * 0.0
    if size > friction_limit:
        result = trial * ((1.0 - friction_limit / size) / (stiffness + damping_rate))
    return result


@ti.func
def limit_with_memory(last, instant, age, memory, slip_length, speed, dt):
    """L [N] after an increment in which mu N is `instant`; `last`: before. age: time in contact
    [s], this increment included; memory: t* [s], zero where L is mu N; slip_length: d [m].
    """
    forgets_in = memory / (1.0 + memory * speed / slip_length)
    return last + (instant - last) * (dt / ti.max(dt, ti.min(forgets_in, age)))
