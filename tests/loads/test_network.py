"""Networks of rigid volumes, without a mesh, against closed forms.

All networks have one structure, so that they are scenarios of one kernel: a source 0, vessels 1 and
2, a syringe 3; edges 0-1, 1-2, 2-3 and 1 to the surroundings. What a case does not need is closed.
"""

import dataclasses

import numpy as np
import pytest

from softsim.compute import fields
from softsim.loads.network import (
    LEAST_VOLUME,
    NO_SUPPLY,
    NOTHING,
    Fluid,
    Network,
    NetworkEdge,
    NetworkNode,
    Supply,
)
from softsim.loads.profile import constant, sine

AMBIENT = 101325.0
GAS = Fluid(True, AMBIENT, 1.81e-5)
ALWAYS = constant(1.0, 0.0)
TUBE = GAS.tube_conductance(length=0.5, bore=1e-3)
VALVE = GAS.valve_conductance(flow=30e-6, pressure=20e3)
SAMPLES = 10


def network(volumes, pressures=(0.0, 0.0, 0.0), tubes=(0.0, 0.0, 0.0), **more):
    """A gas network: volumes [m^3] of nodes, pressures [Pa] of 0 to 2, K of edges 0-1, 1-2, 2-3.

    more: supply of node 0, displaced by the syringe, and leak, opening, pulses of the last edge.
    """
    supply = more.get("supply", NO_SUPPLY)
    displaced = more.get("displaced", NOTHING)
    nodes = tuple(
        NetworkNode(
            f"n{k}", volume, pressure, 0.0, k == 0, supply if k == 0 else NO_SUPPLY, k == 3,
            displaced if k == 3 else NOTHING,
        )
        for k, (volume, pressure) in enumerate(zip(volumes, (*pressures, 0.0), strict=True))
    )  # fmt: skip
    edges = [
        NetworkEdge(f"e{k}", (k, k + 1), conductance, ALWAYS, 0.0)
        for k, conductance in enumerate(tubes)
    ]
    leak = NetworkEdge(
        "leak", (1, 4), more.get("leak", 0.0), more.get("opening", ALWAYS),
        more.get("pulses", 0.0),
    )  # fmt: skip
    return Network(GAS, nodes, (*edges, leak), (), ())


def regulator(flow, pressure, droop, least=0.0):
    """Return a regulator; least -1: a relieving one."""
    return Supply(flow, constant(pressure, 0.0), droop, least, 1.0, ALWAYS)


def vacuum_pump(flow, stall):
    return Supply(flow, constant(stall, 0.0), abs(stall), -1.0, 0.0, ALWAYS)


ML = 1e-6
TWO = network((ML, 5 * ML, 12 * ML, ML), (0.0, 20e3, 0.0), (0.0, TUBE, 0.0))
CHAIN = network(
    (ML, 5 * ML, LEAST_VOLUME, 12 * ML), (0.0, 20e3, 0.0), (0.0, 3.0 * TUBE, 1.5 * TUBE)
)
STIFF = network(
    (ML, 5 * ML, LEAST_VOLUME, 12 * ML), (0.0, 20e3, 0.0), (0.0, 1e6 * TUBE, 1e5 * TUBE)
)
FILLED = network((5 * ML, ML, ML, ML), supply=regulator(20 * ML, 40e3, 2e3))
OVERFILLED = (5 * ML, ML, ML, ML), (40e3, 0.0, 0.0)
RELIEVED = network(*OVERFILLED, supply=regulator(20 * ML, 10e3, 20e3, least=-1.0))
HELD = network(*OVERFILLED, supply=regulator(20 * ML, 10e3, 20e3))
EVACUATED = network((5 * ML, ML, ML, ML), (20e3, 0.0, 0.0), supply=vacuum_pump(20 * ML, -60e3))
CLOSED = network((LEAST_VOLUME, ML, ML, ML), supply=regulator(20 * ML, 40e3, 2e3))
BOTTLE = network((ML, 7 * ML, ML, ML), (0.0, 300e3, 0.0), leak=VALVE)
PULSED = network((ML, 1.0, ML, ML), (0.0, 20e3, 0.0), leak=VALVE, opening=constant(0.37, 0.0),
                 pulses=33.0)  # fmt: skip
BREATHING = network((ML, 5 * ML, 12 * ML, 9 * ML), (0.0, 20e3, 3e3), (TUBE, TUBE, 50.0 * TUBE),
                    displaced=sine(4 * ML, 5.0, 0.0, None, 3.0))  # fmt: skip
EVERYTHING = network(
    (2 * ML, 5 * ML, LEAST_VOLUME, 9 * ML), (0.0, 20e3, 0.0), (10.0 * TUBE, TUBE, TUBE),
    supply=regulator(50 * ML, 30e3, 1e3), displaced=sine(4 * ML, 5.0, 0.0, None, 3.0), leak=VALVE,
    opening=constant(0.5, 0.0), pulses=40.0,
)  # fmt: skip
# Name -> network, end [s], number of increments: a multiple of the samples.
CASES = {
    **{f"two {n}": (TWO, 0.02, n) for n in (200, 400, 800)},
    **{f"breathing {n}": (BREATHING, 0.06, n) for n in (120, 240, 7680)},
    "chain": (CHAIN, 0.02, 20_000),
    "stiff": (STIFF, 0.01, 10),
    "filled": (FILLED, 0.12, 12_000),
    "relieved": (RELIEVED, 0.3, 12_000),
    "held": (HELD, 0.3, 12_000),
    "evacuated": (EVACUATED, 0.9, 12_000),
    "closed": (CLOSED, 0.01, 100),
    "bottle": (BOTTLE, 0.05, 5000),
    "pulsed": (PULSED, 10 / 33, 170),
    "breathing long": (BREATHING, 3.0, 20_000),
    "everything": (EVERYTHING, 0.5, 10_000),
}


@dataclasses.dataclass
class Course:
    """Times [s] and, for each of them, pressures [Pa], contents and what has flowed [m^3]."""

    times: np.ndarray
    pressure: np.ndarray
    content: np.ndarray
    moved: np.ndarray
    supplied: np.ndarray


class Rig:
    """Terms of the networks of some cases, each of which goes through its increments."""

    def __init__(self, names):
        import taichi as ti

        from softsim.compute import backend
        from softsim.loads.network import NetworkTerm

        self.cases = [CASES[name] for name in names]
        self.term = term = NetworkTerm([case[0] for case in self.cases])
        self.dt = np.array([end / count for _, end, count in self.cases])
        self.counts = np.array([count for *_, count in self.cases])
        steps, scenarios = fields.real_field(self.dt), len(names)
        assert backend.real == ti.f64

        @ti.kernel
        def go(s: ti.i32, first: ti.i32, last: ti.i32):
            ti.loop_config(serialize=True)
            for k in range(first, last):
                for scenario in range(scenarios):
                    if scenario == s:
                        term.follow(scenario, 0, k * steps[s], steps[s])

        self.go = go

    def sample(self, number):
        """Go through the `number`th tenth of all increments; the first starts at t = 0."""
        for s, count in enumerate(self.counts):
            begin = 0 if number == 0 else number * count // SAMPLES + 1
            self.go(s, begin, (number + 1) * count // SAMPLES + 1)
        found = (self.term.pressure, self.term.content, self.term.moved, self.term.supplied)
        return [fields.read(field) for field in found]

    def state(self):
        return {name: fields.read(f).copy() for name, f in self.term.state_fields().items()}


CACHE: dict[str, Course] = {}


@pytest.fixture
def courses(restart):
    """The courses of all cases by name, computed once."""
    if not CACHE:
        restart()
        rig = Rig(list(CASES))
        samples = [rig.sample(number) for number in range(SAMPLES)]
        for s, (name, (_, end, _)) in enumerate(CASES.items()):
            rows = (np.array([sample[k][s] for sample in samples]) for k in range(4))
            CACHE[name] = Course(end * (np.arange(SAMPLES) + 1) / SAMPLES, *rows)
        assert not rig.state()["unsolved"].any()
    return CACHE


def difference(t, conductance, volumes, pressures):
    """p_1 - p_2 of two vessels that a tube joins, as in loads/air_line.py."""
    a_1, a_2 = (AMBIENT / volume for volume in volumes)
    p_1, p_2 = (AMBIENT + pressure for pressure in pressures)
    final = (p_1 * a_2 + p_2 * a_1) / (a_1 + a_2)
    rate, skew = 2.0 * conductance * final * (a_1 + a_2), conductance * (a_1 - a_2)
    decay = np.exp(-rate * t)
    return (p_1 - p_2) * decay / (1.0 + skew / rate * (p_1 - p_2) * (1.0 - decay))


@pytest.mark.starts(1)
def test_two_vessels_to_first_order(courses, record_verification):
    errors = []
    for count in (200, 400, 800):
        course = courses[f"two {count}"]
        exact = difference(course.times, TUBE, (5 * ML, 12 * ML), (20e3, 0.0))
        computed = course.pressure[:, 1] - course.pressure[:, 2]
        errors.append(np.abs(computed - exact).max())
    assert exact[-1] < 0.3 * exact[0]
    assert errors[2] < 1e-3 * 20e3
    order = np.log2(errors[1] / errors[2])
    record_verification("vessels joined by a tube [Pa]", exact[-1], computed[-1], order)
    assert order == pytest.approx(1.0, abs=0.05)


def test_moving_piston_to_first_order(courses):
    finest = courses["breathing 7680"].pressure
    coarse, fine = (np.abs(courses[f"breathing {n}"].pressure - finest).max() for n in (120, 240))
    assert np.log2(coarse / fine) == pytest.approx(1.0, abs=0.1)


def test_junction_without_a_volume(courses):
    """Resistances of two tubes in a row add up: K_1 K_2 / (K_1 + K_2) = K."""
    course = courses["chain"]
    exact = difference(course.times, TUBE, (5 * ML, 12 * ML), (20e3, 0.0))
    computed = course.pressure[:, 1] - course.pressure[:, 3]
    np.testing.assert_allclose(computed, exact, atol=3e-5 * 20e3)
    squares = course.pressure[:, 1:4] ** 2
    middle = (2.0 * squares[:, 0] + squares[:, 2]) / 3.0
    np.testing.assert_allclose(squares[:, 1], middle, rtol=2e-6)


def test_tubes_without_resistance(courses):
    """Increments of 10,000 time constants: one common pressure, without a swing."""
    pressure = courses["stiff"].pressure[:, 1:4] - AMBIENT
    common = 20e3 * 5 / 17
    assert (np.diff(pressure[:, 0]) <= 1.0).all() and (pressure[:, 0] > common - 1.0).all()
    np.testing.assert_allclose(pressure[1:], common, atol=0.1)


def supplied(t, rate, start, final, droop):
    """Return the pressure [Pa] of a vessel at times t (n,) [s] after it had `start` [Pa].

    At its largest flow a supply changes the pressure by `rate` [Pa/s]; within `droop` [Pa] of
    `final` the pressure approaches it exponentially.
    """
    above = start - final
    full = max(abs(above) - droop, 0.0) / rate
    left = np.sign(above) * min(abs(above), droop)
    decay = np.exp(-rate / droop * np.maximum(t - full, 0.0))
    return np.where(t < full, start - np.sign(above) * rate * t, final + left * decay)


SUPPLIED = {
    "filled": ("regulator fills a vessel [Pa]", 0.0, 40e3, 2e3),
    "relieved": ("relieving regulator vents a vessel [Pa]", 40e3, 10e3, 20e3),
    "evacuated": ("vacuum pump evacuates a vessel [Pa]", 20e3, -60e3, 60e3),
}


@pytest.mark.parametrize("name", SUPPLIED)
def test_supply_of_a_vessel(courses, record_verification, name):
    """Check the linear and then exponential change of the pressure up to its final value."""
    course, (title, start, final, droop) = courses[name], SUPPLIED[name]
    exact = supplied(course.times, AMBIENT * 20 * ML / (5 * ML), start, final, droop)
    assert abs(exact[-1] - final) < 0.01 * abs(start - final) < 0.9 * abs(exact[0] - final)
    computed = course.pressure[:, 0] - AMBIENT
    np.testing.assert_allclose(computed, exact, atol=2e-4 * abs(start - final))
    middle = np.abs(np.abs(exact - final) - 0.5 * droop).argmin()
    record_verification(title, exact[middle], computed[middle])


def test_regulator_that_does_not_relieve_holds(courses):
    """Check that nothing flows back through a regulator above its set pressure."""
    course = courses["held"]
    assert (course.supplied == 0.0).all()
    np.testing.assert_allclose(course.pressure[:, 0], AMBIENT + 40e3, rtol=1e-15)


def test_regulator_before_a_closed_junction(courses):
    """It could fill 0.1 mm^3 20 times within an increment, and stops at its pressure."""
    shown = courses["closed"].pressure[:, 0] - AMBIENT
    assert (shown < 40e3 + 1e-3).all()
    assert shown[-1] == pytest.approx(40e3, rel=1e-6)


def test_bottle_empties(courses, record_verification):
    """p' = -G p_a (p^2 - p_a^2) / V: p = p_a coth(G p_a^2 t / V + c)."""
    course = courses["bottle"]
    rate = VALVE * AMBIENT**2 / (7 * ML)
    exact = AMBIENT / np.tanh(rate * course.times + np.arctanh(AMBIENT / (AMBIENT + 300e3)))
    assert exact[-1] - AMBIENT < 0.3 * 300e3
    np.testing.assert_allclose(course.pressure[:, 1], exact, rtol=2e-4)
    record_verification("bottle empties [Pa]", exact[-1], course.pressure[-1, 1])


def test_mean_flow_of_a_pulsed_valve(courses):
    """Increments that do not fit into the period of the pulses: 17 in each."""
    flow = 0.37 * VALVE * ((AMBIENT + 20e3) ** 2 - AMBIENT**2)
    assert courses["pulsed"].moved[-1, 3] == pytest.approx(flow * 10 / 33, rel=1e-4)


def test_content_is_conserved(courses):
    """20,000 increments of a breathing piston, all closed outside: round-off."""
    total = courses["breathing long"].content.sum(axis=1)
    start = ((AMBIENT + 20e3) * 5 + (AMBIENT + 3e3) * 12 + AMBIENT * 10) * ML / AMBIENT
    np.testing.assert_allclose(total, start, rtol=1e-12)


def test_content_is_what_flows_in_and_out(courses):
    """A regulator, a pulsed leak, a junction and a piston at once."""
    course = courses["everything"]
    start = (16.0 + LEAST_VOLUME / ML + 5 * 20e3 / AMBIENT) * ML
    gained = course.supplied.sum(axis=1) - course.moved[:, 3]
    assert gained[-1] > ML and course.moved[-1, 3] > 10 * ML
    np.testing.assert_allclose(course.content.sum(axis=1), start + gained, rtol=1e-12)


def test_resumed_course_has_the_same_bits(courses, restart):
    names = list(CASES)
    restart()
    rig = Rig(names)
    for number in range(5):
        rig.sample(number)
    state = rig.state()
    for number in range(5, SAMPLES):
        rig.sample(number)
    whole = rig.state()
    for name, field in rig.term.state_fields().items():
        fields.write(field, state[name])
    for number in range(5, SAMPLES):
        rig.sample(number)
    for name, values in rig.state().items():
        np.testing.assert_array_equal(values, whole[name])
    np.testing.assert_array_equal(whole["content"][-1], courses["everything"].content[-1])


def test_scenario_alone_has_the_same_bits(courses, restart):
    restart()
    rig = Rig(["everything"])
    last = [rig.sample(number) for number in range(SAMPLES)][-1]
    np.testing.assert_array_equal(last[1][0], courses["everything"].content[-1])


def test_faster_loads():
    """A network that is played faster has the same pressures at proportionally earlier times."""
    fast = EVERYTHING.time_scaled(10.0)
    assert fast.edges[1].conductance == 10.0 * TUBE
    assert fast.edges[3].pulse_frequency == 400.0
    assert fast.nodes[0].supply.flow == 500 * ML
    assert fast.last_change == EVERYTHING.last_change / 10.0
    piston, faster = EVERYTHING.nodes[3].displaced, fast.nodes[3].displaced
    assert faster.at(0.033) == pytest.approx(piston.at(0.33), rel=1e-9)
