"""`python -m validation`: all scripts, one page for the thesis and one for published data."""

from validation import (
    adhesion,
    contact_rows,
    convergence,
    critical_zones,
    deflation_rate,
    displacement,
    inclination,
    inflation_radius,
    leafbot,
    leafbot_chain,
    leafbot_ramps,
    leafbot_terrain,
    leafbot_x5,
    lowest_pressure,
    materials,
    mode1_speed,
    mode2_speed,
    motor,
    propulsion_force,
    prototypes,
    reach,
    sensing,
    sleeve_hypotheses,
    sleeve_stiffness,
    space,
    spike_patches,
)
from validation.command import command
from validation.published import __main__ as published

SCRIPTS = [
    inflation_radius.SCRIPT,
    sleeve_stiffness.SCRIPT,
    sleeve_hypotheses.SCRIPT,
    mode1_speed.SCRIPT,
    mode2_speed.SCRIPT,
    propulsion_force.SCRIPT,
    contact_rows.SCRIPT,
    displacement.SCRIPT,
    deflation_rate.SCRIPT,
    lowest_pressure.SCRIPT,
    inclination.SCRIPT,
    prototypes.SCRIPT,
    critical_zones.SCRIPT,
    reach.SCRIPT,
    sensing.SCRIPT,
    space.SCRIPT,
    adhesion.SCRIPT,
    spike_patches.SCRIPT,
    materials.SCRIPT,
    leafbot.SCRIPT,
    leafbot_chain.SCRIPT,
    leafbot_x5.SCRIPT,
    leafbot_ramps.SCRIPT,
    leafbot_terrain.SCRIPT,
    motor.SCRIPT,
    convergence.SCRIPT,
]

if __name__ == "__main__":
    command([*SCRIPTS, *published.SCRIPTS])
