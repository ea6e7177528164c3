"""Contact laws: spring and dashpot along the normal, Coulomb friction with memory.

Friction is a spring and a dashpot from a slip anchor, limited to mu N. It is written as
elastoplasticity (Wriggers, Computational Contact Mechanics, ch. 5): the path of a node along the
surface is the sum of the elastic slip s, which a spring and a dashpot resist, and the plastic slip,
which begins where their force reaches mu N and moves the anchor:

    T = k_t s + c_t ds/dt,  |T| <= mu N.

A node that sticks is held by a spring, so it cannot creep, as it would under a velocity-regularised
law. The dashpot acts on the elastic slip alone (as ABAQUS/Explicit's contact damping), so it does
not act on a node that slides steadily.

With a limit that follows N at once, an elastic body without damping excites itself while sliding:
slip coincides with small N, and oscillations of mesh and body grow (Adams 1995; Renardy 1992). A
limit with memory prevents this (Prakash and Clifton 1993; Cochard and Rice 2000; Rubin and Ampuero
2007),

    dL/dt = (mu N - L) (1 / t* + |V| / d)   while in contact,  |T| <= L,

with a time t* at rest and a slip length d at the speed V; it starts as the mean of mu N.
"""

import taichi as ti

BEFORE_START = -1e30
"""Time of events that have not happened yet [s], before any time of a run."""


@ti.func
def normal_force(gap, gap_rate, penalty_stiffness, damping):
    """Return N = max(0, -k_n g - c_n dg/dt) where g < 0, else 0 [N]."""
    force = gap * 0.0
    if gap < 0.0:
        force = ti.max(0.0, -penalty_stiffness * gap - damping * gap_rate)
    return force


@ti.func
def shear_force(stretch, before, stiffness, damping_rate):
    """Return k_t s + c_t (s - s_0) / dt [N] of the elastic slip s [m], s_0 one increment ago.

    The force pulls the node back. damping_rate: c_t / dt [N/m].
    """
    return stiffness * stretch + damping_rate * (stretch - before)


@ti.func
def slip(stretch, before, stiffness, damping_rate, friction_limit):
    """Return the slip vector [m] by which the anchor follows so that |T| is at its limit.

    It is zero when sticking. stretch: elastic slip without it [m]; before: one increment ago.
    """
    trial = shear_force(stretch, before, stiffness, damping_rate)
    size = trial.norm()
    result = stretch * 0.0
    if size > friction_limit:
        result = trial * ((1.0 - friction_limit / size) / (stiffness + damping_rate))
    return result


@ti.func
def limit_with_memory(last, instant, age, memory, slip_length, speed, dt):
    """Return the friction limit L [N] after an increment.

    last: L before it. instant: mu N. age: time in contact [s], this increment included. memory: t*
    [s], zero where L is mu N. slip_length: d [m].
    """
    forgets_in = memory / (1.0 + memory * speed / slip_length)
    return last + (instant - last) * (dt / ti.max(dt, ti.min(forgets_in, age)))
