"""Statements of the thesis that the scripts examine, in the order of the page.

Claims of the scripts are sub-claims of these. A statement without any is listed as not examined.
"""

from dataclasses import dataclass
from functools import partial


@dataclass(frozen=True)
class Statement:
    """Statement of the thesis.

    group: question of a reader that it belongs to; text: one plain sentence, unique; value: number
    of the thesis and tolerance of the comparison; where: section, figure or table; fitted: True if
    a constant of the scenes, the stiffness of the sleeve, was chosen so that this statement comes
    out.
    """

    group: str
    text: str
    value: str
    where: str
    fitted: bool = False


_inflation = partial(Statement, "Inflation of the skin")
SIZE = _inflation(
    "At its working pressure the robot is 1.5 times as wide as at rest, in free air.",
    "1.5 OD_S at 20 to 26 kPa",
    "4.2.3, 4.2.4, Fig 4.9",
    fitted=True,
)
GROWTH = _inflation("The skin can grow to 2.5 times OD_S.", "2.5 OD_S", "4.2.3")
WHITENING = _inflation("White regions appear on the stretched skin.", "at 30 kPa", "4.2.3")
SLEEVE = _inflation(
    "A harder silicone hinders the inflation of the skin; Shore 10A (Dragon Skin 10) is the most "
    "suitable.",
    "10A, of 00-10 to 30A",
    "3.2.2.2",
    fitted=True,
)

_contact = partial(Statement, "Contact and pull in a pipe")
CONTACT_ROWS = _contact(
    "Four of five rows of spikes touch the 30 mm pipe, two to three the 36 and 41 mm pipes; as "
    "many at 26 as at 23 kPa.",
    "4 (30 mm), 2 to 3 (36, 41 mm)",
    "4.2.4, Fig 4.12",
    fitted=True,
)
PULL = _contact(
    "Held by a tendon, the robot pulls at most 20 to 35 times its weight.",
    "1.96 to 3.43 N",
    "4.2.4, Fig 4.11",
    fitted=True,
)
PULL_PIPE = _contact("It pulls most in the 30 mm pipe.", "30 mm", "4.2.4", fitted=True)
PULL_PRESSURE = _contact(
    "The pull at 26 kPa is about that at 23 kPa.", "within 15 %", "4.2.4", fitted=True
)
PULL_NOISE = _contact(
    "The pull is smooth during inflation and noisy at the end of deflation, in the wide pipes "
    "more and earlier at higher frequency.",
    "",
    "4.2.4, Fig 4.11",
)

_mode3 = partial(Statement, "Walking with pressure and vibration (Mode 3)")
STANDSTILL = _mode3(
    "The robot stands still while the pressure is above a threshold, P_M3^B.",
    "below 23 kPa",
    "4.2.1.3, Fig 6.5",
)
FALLING = _mode3("It moves while the pressure falls, not while it rises.", "", "4.2.1.3, Fig 6.5")
STOP = _mode3(
    "Motion stops at P_M3^S, where the spikes lose the wall.",
    "9, 11, 12.5 kPa within 15 % (30, 36, 41 mm)",
    "6.4, Table 6.2",
)
TOUCH = _mode3(
    "At P_M3^S the spikes barely touch the wall.",
    "9, 11 to 12, 12.5 to 13 kPa (30, 36, 41 mm)",
    "6.4, Fig 6.6, Table 6.2",
    fitted=True,
)
FREQUENCY = _mode3(
    "It travels farther per cycle at higher frequency; at 64 Hz it barely moves.",
    "64, 137, 160, 192 Hz",
    "6.3.1, Fig 6.5",
)
NATURAL = _mode3(
    "With natural deflation it travels farther in the 36 and 41 mm pipes than in the 30 mm pipe.",
    "",
    "6.3.1, Fig 6.5",
)

_rate = partial(Statement, "Deflation rate and lowest pressure")
RATE = _rate(
    "It travels farthest per cycle when the pressure falls at about 1.3 kPa/s.",
    "1.3 kPa/s",
    "6.4, Fig 6.6 A to C",
)
RATE_LIMIT = _rate(
    "The displacement decreases as the rate grows, to nothing above about 6 kPa/s.",
    "6 kPa/s",
    "4.2.1.3, 6.4, Fig 6.6 A to C",
)
RATE_PIPE = _rate(
    "At 1.3 kPa/s it travels farthest in the 30 mm pipe.", "30 mm", "6.4, Fig 6.6 A to C"
)
LOWEST_LEVEL = _rate(
    "A lowest pressure set too high leaves little motion.", "", "6.4, Fig 6.6 D to F"
)

_vertical = partial(Statement, "Inclined and vertical pipes")
CLIMBS = _vertical("It climbs inclined and vertical pipes.", "", "6.4, Fig 6.6, 6.7")
HOLDS = _vertical(
    "In a vertical pipe it holds down to a lowest pressure, below which it falls.",
    "9, 12, 13 kPa (30, 36, 41 mm)",
    "6.4, Fig 6.6 G to I",
)
STEEPER = _vertical("It is slower the steeper the pipe.", "", "Fig 6.7 (figure only)")
WIDER = _vertical("It is slower in larger pipes.", "30, 36, 41 mm", "6.4, 6.6, Fig 6.7")

_mode1 = partial(Statement, "Vibration only (Mode 1)")
MODE1_FORWARD = _mode1(
    "Vibration moves the robot forward in a level pipe as wide as itself.",
    "",
    "4.2.1.1, Fig 4.8",
)
MODE1_WIDE = _mode1(
    "Vibration alone does not climb in pipes wider than the robot.", "no motion", "4.2.1.1"
)
MODE1_BEST = _mode1("It is fastest at 64 Hz.", "64 Hz", "6.3.1, Fig 4.8")
MODE1_SLOW = _mode1("It is slow at 192 Hz.", "below 5 mm/s", "6.3.1, Fig 4.8")

_mode2 = partial(Statement, "Pressure only (Mode 2)")
MODE2_STEP = _mode2(
    "Each cycle with rapid deflation gives a net step forward.",
    "at 10 to 15 kPa/s",
    "4.2.1.2, Fig 4.6 C",
)
MODE2_SPEED = _mode2(
    "Its speed is about 0.5 mm/s, far below that of Mode 3.", "within a factor of 2", "4.2.1.2"
)
MODE2_RATE = _mode2(
    "A net step needs a deflation of 10 to 15 kPa/s; a slower one gives a smaller step.",
    "",
    "4.2.1.2",
)

_layouts = partial(Statement, "Bends, transitions and branches")
BENDS = _layouts(
    "It passes elbows of 90 degrees and C-shaped bends, also against gravity.",
    "passed",
    "6.6, Fig 6.9 A to C, I to K",
)
TRANSITIONS = _layouts(
    "It passes transitions between pipes of 30 and 41 mm, level and upwards.",
    "passed",
    "6.6, Fig 6.9 D to H",
)
EASIER = _layouts(
    "Small to large is easier than large to small, level is easier than upwards.", "", "6.6"
)
BRANCH = _layouts(
    "It passes a level T branch; the motor's direction of rotation chooses the exit.",
    "passed, by both exits",
    "6.6",
)
BRANCH_UP = _layouts("It cannot pass a T branch in a vertical plane.", "not passed", "6.6, 7.2.4")

_reach = partial(Statement, "Reach with a tether")
REACH_UP = _reach(
    "How far it climbs is limited by the mass of the tether.",
    "derived: 6.5, 6.5, 3.5 m (30, 36, 41 mm)",
    "6.5, Fig 6.8",
)
REACH_LEVEL = _reach(
    "How far it goes in a level pipe is limited by the friction of the tether.",
    "8.45 to 13 m (30, 36 mm), 4.5 to 7 m (41 mm)",
    "6.5",
)
LOADED = _reach("It climbs slower the more it carries.", "", "6.5, Fig 6.8")

_sensing = partial(Statement, "The pressure gauge as a sensor")
SLOPE = _sensing(
    "During inflation the slope of the pressure decreases near its top, more in a larger pipe.",
    "order of 30, 36, 41 mm",
    "4.2.4, 6.3.1",
)
FALL_TIME = _sensing("Natural deflation is shortest in the 30 mm pipe.", "30 mm", "6.3.1")
RECOGNITION = _sensing(
    "The pressure curve identifies the size of the pipe.", "30, 36, 41 mm", "7.2.2"
)

_spikes = partial(Statement, "Spikes, prototypes and motor")
PATTERN = _spikes(
    "The force of a pattern of spikes is linear in the depth and in their number.",
    "3 x 5, 5 x 5, 7 x 5",
    "6.2, Fig 6.4",
)
SPIKE_STIFFNESS = _spikes(
    "A spike is as stiff as Leafbot's limb would be of the same silicone, with half as much "
    "horizontal as vertical force.",
    "derived: 94 N/m within 25 %; 0.4 to 0.6",
    "Eq 5.22, Table B.1",
)
MOTOR_FORCE = _spikes(
    "The plane model needs a much smaller motor force, in proportion to its stiffness.",
    "1/186",
    "6.2, Table 6.1",
)
PROTOTYPES = _spikes(
    "The robot with 10 x 3 spikes does not move, that with 14 x 5 moves, that with 18 x 5 on a "
    "wider body moves slowly.",
    "",
    "3.2.2.2, Table 3.2",
)
HARDER_SPIKES = _spikes(
    "Harder spikes on the same skin do not hinder inflation and travel farther.",
    "Dragon Skin 30 on 10",
    "7.2.1",
)
MOTOR = _spikes(
    "Voltage, current and frequency of the motor follow the law of a direct current motor (our "
    "check of the data).",
    "3 to 5 V, 120 to 191 Hz",
    "Table 4.1, 5.1",
)

_leafbot = partial(Statement, "Leafbot")
LIMB = _leafbot(
    "A limb has a vertical stiffness, and half as much horizontal as vertical force.",
    "250 N/m within 10 %; 0.4 to 0.6",
    "Eq 5.22, Table B.1",
)
SPEED = _leafbot(
    "With five rows the speed grows with the frequency and settles after about 1 s.",
    "200, 220, 300 mm/s within 20 % at 132, 142, 186 Hz",
    "5.2",
)
NODES = _leafbot(
    "All nodes jump at the motor's frequency; the head moves little, and comes to rest on the "
    "ground between steps.",
    "head below 2 mm",
    "5.2, 3.2.1.2",
)
LIMB_ROWS = _leafbot(
    "At 3 V three rows are faster than five, and five than nine; three rows are slower at 186 "
    "and 191 Hz than at 132 Hz.",
    "",
    "5.2",
)
RADIUS = _leafbot(
    "Limbs with a front radius of 5 mm are the fastest of three.", "5 mm", "3.2.1.2, Fig 3.7"
)
FLAT_SLOPE = _leafbot("No design climbs a flat slope of 30 deg or more.", "30 deg", "5.3")
RAMPS = _leafbot(
    "Curved limbs climb steeper ramps than straight ones, with fewer contacts.",
    "70 against 40 deg, within 10 deg",
    "3.2.1.2, Fig 3.6, App. A",
)
OBSTACLES = _leafbot(
    "Five rows pass higher ramps than three and nine; nine rows pass the largest semicircles.",
    "fraction of passes within 0.3",
    "5.3, Fig 5.12, 5.13",
)
FIELDS_OF_STEPS = _leafbot(
    "Three rows fail on fields of steps, five and nine pass; on the rougher field nine are faster "
    "and steadier than five, on the smoother one both are equally fast.",
    "fraction of passes within 0.3",
    "5.3, Fig 5.15",
)
CURVATURE = _leafbot(
    "With motors in the middle, Leafbot-X5 turns on arcs that hardly depend on the frequency.",
    "0.014, 0.0145, 0.016 1/mm within 30 % at 95, 115, 150 Hz",
    "5.4, Table 5.1",
)
TURNING = _leafbot(
    "Leafbot-X5 turns away from the running or stronger motor, and runs straight with both; left "
    "and right differ with motors at the ends.",
    "",
    "5.4, Table 5.1",
)

_own = partial(Statement, "Checks of the simulation itself (not in the thesis)", where="")
MEMBRANE = _own("The inflated skin equals the closed form of a membrane.", "within 5 %")
CONVERGENCE = _own(
    "Results do not depend on mesh, mass scaling, time step and contact stiffness.",
    "within 5 %, patches of spikes 10 %",
)

STATEMENTS = tuple(value for value in globals().values() if isinstance(value, Statement))
