"""Networks of scenes: their numbers in the model, and what is refused where."""

import numpy as np
import pytest

from softsim.errors import SceneError
from softsim.loads.network import LEAST_VOLUME, Network, NetworkChamber

SCENE = """
bodies:
  one: {mesh: {generator: block, length: 1 mm, height: 5 mm, element_size: 1 mm},
        formulation: axisymmetric, material: dragon_skin_10, position: [4 mm, 0 mm],
        fixed: [bottom, top]}
  two: {mesh: {generator: block, length: 1 mm, height: 8 mm, element_size: 1 mm},
        formulation: axisymmetric, material: dragon_skin_10, position: [4 mm, 20 mm],
        fixed: [bottom, top]}
pneumatics:
  nodes:
    supply: {kind: regulator, profile: {kind: constant, value: 8 kPa}, flow: 20 ml/s}
    tank: {kind: vessel, volume: 10 ml, pressure: 5 kPa}
    a: {kind: chamber, facets: [one.left], dead_volume: 1 ml}
    b: {kind: chamber, facets: [two.left]}
  edges:
    feed: {kind: valve, between: [supply, a], flow: 10 ml/s, pressure: 10 kPa,
           opening: {kind: cycles, period: 20 ms, rise: 1 ms, hold: 9 ms, fall: 1 ms}}
    join: {kind: tube, between: [a, b], length: 20 cm, bore: 1 mm}
    fill: {kind: tube, between: [tank, b], length: 10 cm, bore: 1 mm}
    vent: {kind: valve, between: [b, ambient], flow: 10 ml/s, pressure: 10 kPa, pulses: 50 Hz}
environment: {gravity: 0 m/s^2}
time: {end: 60 ms}
"""
LIQUID = "pneumatics.fluid={kind: liquid}"


def network_of(model) -> Network:
    [network] = model.of_kind(Network)
    return network


def test_numbers_of_a_network(build):
    network = network_of(build(SCENE))
    supply, tank, a, b = network.nodes
    half_tube = 0.5 * np.pi / 4.0 * 1e-6 * np.array([0.2, 0.1])
    assert supply.volume == LEAST_VOLUME
    assert tank.volume == pytest.approx(10e-6 + half_tube[1])
    assert a.volume == pytest.approx(1e-6 + half_tube[0])
    assert b.volume == pytest.approx(half_tube.sum())
    assert tank.pressure == 5e3 and a.pressure == 0.0
    assert [edge.ends for edge in network.edges] == [(0, 2), (2, 3), (1, 3), (3, 4)]
    feed, join, _, vent = network.edges
    ambient = 101325.0
    assert feed.conductance * ((ambient + 10e3) ** 2 - ambient**2) == pytest.approx(10e-6)
    laminar = np.pi * 1e-12 / (256 * 1.81e-5 * 0.2 * ambient)
    assert join.conductance == pytest.approx(laminar)
    assert vent.pulse_frequency == 50.0 and feed.opening.at(0.005) == 1.0


def test_chambers_of_a_network_are_pressures(build):
    model = build(SCENE)
    assert [load.name for load in model.pressures] == ["a", "b"]
    sources = [load.source for load in model.pressures]
    assert all(isinstance(source, NetworkChamber) and not source.warnings() for source in sources)
    for source in sources:
        volume = source.initial_volume
        assert source.stiffness(volume) == pytest.approx(
            (101325.0 + 8e3) / (volume + source.node.volume)
        )


def test_chamber_of_a_half_model_counts_twice(build):
    model = build(SCENE, "pneumatics.nodes.b.volume_ratio=2")
    a, b = (load.source for load in model.pressures)
    volume = b.initial_volume
    assert b.stiffness(volume) == pytest.approx(
        2.0 * (101325.0 + 8e3) / (2.0 * volume + b.node.volume)
    )
    assert [node.volume_ratio for node in network_of(model).nodes] == [1.0, 1.0, 1.0, 2.0]
    assert a.node.volume_ratio == 1.0 and network_of(model).nodes[3].volume == b.node.volume


def test_supplies_of_a_network(build):
    """Check the flow and its bounds of a relieving regulator and of a vacuum pump."""
    relieving = "pneumatics.nodes.supply.relieving=true"
    vacuum = "pneumatics.nodes.tank={kind: pump, flow: 3 ml/s, stall: -40 kPa}"
    plain = network_of(build(SCENE)).nodes[0].supply
    supply, tank, *_ = network_of(build(SCENE, relieving, vacuum)).nodes
    assert (plain.least, plain.most) == (0.0, 1.0)
    assert (supply.supply.least, supply.supply.most, supply.supply.droop) == (-1.0, 1.0, 500.0)
    assert (tank.supply.least, tank.supply.most, tank.supply.droop) == (-1.0, 0.0, 40e3)
    assert tank.supply.flow == pytest.approx(3e-6) and tank.supply.set_pressure.at(0.0) == -40e3


def test_a_syringe_that_is_drawn_first_compresses_more(build):
    drawn = (
        "pneumatics.nodes.supply={kind: syringe, volume: 10 ml, profile: {kind: table, "
        "points: [[0 s, 0 ml], [20 ms, -40 ml], [40 ms, 8 ml]]}}"
    )
    source = build(SCENE, drawn).pressures[0].source
    assert source.highest == pytest.approx((101325.0 + 5e3) * 50.0 / 2.0)


def test_liquid_is_as_stiff_as_an_added_volume(build):
    model = build(SCENE, LIQUID, "pneumatics.nodes.a.dead_volume=0 ml")
    alone = build(
        SCENE, "pneumatics=~",
        "loads.a={kind: added_volume, facets: [one.left], "
        "profile: {kind: ramp, value: 1 ul, duration: 1 ms}}",
    )  # fmt: skip
    stiffnesses = [m.pressures[0].source.stiffness(0.0) for m in (model, alone)]
    assert stiffnesses[0] == pytest.approx(stiffnesses[1])
    join = network_of(model).edges[1]
    assert join.conductance == pytest.approx(np.pi * 1e-12 / (128 * 1e-3 * 0.2))


def test_scenarios_of_a_batch(build):
    other = build(
        SCENE, "pneumatics.nodes.supply.flow=5 ml/s", "pneumatics.edges.join.bore=2 mm",
        "pneumatics.edges.vent.pulses=70 Hz", "pneumatics.nodes.tank.volume=3 ml",
    )  # fmt: skip
    assert build(SCENE).can_share(other)
    rewired = build(SCENE, "pneumatics.edges.feed.between=[supply, b]")
    assert not build(SCENE).can_share(rewired)


def test_network_without_a_source_warns(build):
    model = build(
        SCENE, "pneumatics.nodes.tank.pressure=0 kPa",
        "pneumatics.nodes.supply={kind: vessel, volume: 1 ml}",
    )  # fmt: skip
    assert "no regulator" in model.pressures[0].source.warnings()["supply"]


# Change of the text -> text of the error, place in the file.
WRONG = {
    "unknown node": (
        ("between: [a, b]", "between: [a, c]"), "there is no node 'c'", "between: [a, c]"
    ),
    "loop": (("between: [a, b]", "between: [a, a]"), "leads from 'a' to itself", "[a, a]"),
    "chamber twice": (("[two.left]", "[one.left]"), "a facet of 'b' also belongs to 'a'", "left]}"),
    "alone": (
        ("between: [tank, b]", "between: [supply, b]"), "no path leads from 'tank'", "tank:"
    ),
    "static": (("end: 60 ms", "end: 60 ms, procedure: static"), "static procedure", "nodes:"),
    "opening": (("rise: 1 ms", "highest: 2, rise: 1 ms"), "varies between 0 and 2", "opening:"),
    "vacuum": (("pressure: 5 kPa", "pressure: -2 bar"), "-200 kPa is below vacuum", "tank:"),
    "ambient": (("tank: {kind", "ambient: {kind"), "'ambient' is the surroundings", "nodes:"),
    "stall": (
        ("kind: regulator, profile: {kind: constant, value: 8 kPa}", "kind: pump, stall: -2 bar"),
        "-200 kPa is below vacuum", "supply:",
    ),
    "probe": (
        ("time:", "output: {probes: {flow_join: {kind: radius, nodes: one.left}}}\ntime:"),
        "the network already has a column 'flow_join'", "flow_join",
    ),
    "load": (
        ("time:", "loads: {a: {kind: follower_pressure, facets: [one.right], profile: "
         "{kind: constant, value: 1 kPa}}}\ntime:"),
        "a load is also called 'a'", "a: {kind: chamber",
    ),
    "pressed twice": (
        ("time:", "loads: {air: {kind: follower_pressure, facets: [one.left], profile: "
         "{kind: constant, value: 1 kPa}}}\ntime:"),
        "also belongs to 'air'", "one.left], dead",
    ),
    "piston": (
        ("tank: {kind: vessel, volume: 10 ml, pressure: 5 kPa}",
         "tank: {kind: syringe, volume: 1 ml, profile: {kind: ramp, value: 2 ml, duration: 1 ms}}"),
        "the piston displaces 2 ml", "tank:",
    ),
    "no chamber": (
        ("a: {kind: chamber, facets: [one.left], dead_volume: 1 ml}\n"
         "    b: {kind: chamber, facets: [two.left]}",
         "a: {kind: vessel}\n    b: {kind: vessel}"),
        "no node is a chamber", "supply:",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_refused(build, name):
    (before, after), message, line = WRONG[name]
    text = SCENE.replace(before, after, 1)
    assert text != SCENE
    with pytest.raises(SceneError, match=r"scene\.yaml:") as caught:
        build(text)
    assert message in str(caught.value)
    number = int(str(caught.value.location).rsplit(":", 2)[1])
    nearby = "\n".join(text.splitlines()[number - 2 : number])
    assert line in nearby


def test_a_chamber_without_an_edge_is_refused(build):
    text = SCENE.replace("between: [a, b]", "between: [tank, b]").replace(
        "between: [supply, a]", "between: [supply, b]"
    )
    with pytest.raises(SceneError, match="no edge leads to chamber 'a'"):
        build(text)
