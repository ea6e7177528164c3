"""Numbers of the thesis that several scripts hold the simulation against, with their sections."""

STATED = (36.0, 0.25, 0.023)  # kPa, C10, C20, C30 of Dragon Skin 10 (4.2.3)
PIPES = (30, 36, 41)  # mm, inner diameters (4.2.4)
FREQUENCIES = (64, 137, 160, 192)  # Hz, of the motor (4.2.4)
HIGHEST = 23.0  # kPa, the best highest pressure (6.3.1)
HIGHESTS = (20.0, 23.0, 26.0)  # kPa, highest pressures tried (4.2.4)
BEST_FREQUENCY = 192  # Hz, of Mode 3 (6.3.1)
BEST_RATE = 1.3  # kPa/s, Df_r^a of the farthest displacement a cycle (6.4)
STOP_RATE = 6.0  # kPa/s, above which nothing moves (4.2.1.3, 6.4)
RING = 2.0  # spikes of a ring that push along the axis, over those of the section: 14 over 7
WEIGHT = 10e-3 * 9.81  # N (10 g, 4.2.1.2)

LOWEST = {30: 9.0, 36: 11.0, 41: 12.5}
"""Pipe [mm] -> P_M3^S [kPa] (Table 6.2), where the spikes barely touch; Fig 6.6 has 9, 12, 13."""

EFFECTIVE_RATE = {30: 1.4, 36: 1.3, 41: 1.3}
"""Pipe [mm] -> Df_r^a [kPa/s], the most effective (Table 6.2)."""

LOWEST_VERTICAL = {30: 9.0, 36: 12.0, 41: 13.0}
"""Pipe [mm] -> P_M3^S [kPa], the lowest at which it does not fall (Fig 6.6 G to I)."""

LOWEST_SPREAD = 0.15
"""Share by which the thesis's own values of P_M3^S may be off: Table 6.2 and Fig 6.6 differ by 9 %,
and both are read off a falling curve."""
