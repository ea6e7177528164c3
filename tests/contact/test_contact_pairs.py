"""Contact by pairs of surfaces: which touch, with which friction, what is refused."""

import numpy as np
import pytest

from softsim.builder import build_model
from softsim.cli.run_tables import acting
from softsim.compute import fields
from softsim.errors import SceneError
from softsim.scene.loading import load_scene
from softsim.solver.plausibility import are_in_contact

BLOCK = "formulation: plane_strain, thickness: 5 mm, material: dragon_skin_30"
PIECE = "{mesh: {generator: block, length: 2 mm, height: 2 mm, element_size: 1 mm}, " + BLOCK
SCENE = f"""
bodies:
  base: {{mesh: {{generator: block, length: 16 mm, height: 1 mm, element_size: 1 mm}}, {BLOCK},
         fixed: [bottom]}}
  slow: {PIECE}, position: [-5 mm, 1.02 mm], initial_velocity: [1 m/s, -0.2 m/s]}}
  fast: {PIECE}, position: [0 mm, 1.02 mm], initial_velocity: [1 m/s, -0.2 m/s]}}
  ghost: {PIECE}, position: [2.2 mm, 1.5 mm], initial_velocity: [-2 m/s, 0 m/s]}}
contact:
  self_contact: [base.top, slow, fast]
  self_friction_coefficient: 0.6
  pairs:
    - {{between: [fast, base.top], friction_coefficient: 0.1}}
    - {{between: [base.top, ghost.bottom]}}
environment: {{gravity: 0 m/s^2}}
time: {{end: 1 s}}
"""


def table(model):
    """Friction coefficient between two bodies by name, negative where they do not touch."""
    data = model.self_contact
    body_of = np.repeat([b.name for b in model.bodies], [len(b.points) for b in model.bodies])
    groups = dict(zip(body_of[data.nodes], data.point_group, strict=False))
    return lambda one, other: data.friction_coefficient[groups[one], groups[other]]


def test_pairs_make_a_table(build):
    """Symmetric; the last pair counts; surfaces of pairs alone touch nothing else."""
    model = build(SCENE)
    mu = table(model)
    assert (
        model.self_contact.friction_coefficient == model.self_contact.friction_coefficient.T
    ).all()
    assert mu("fast", "base") == mu("base", "fast") == 0.1
    assert mu("slow", "base") == mu("slow", "fast") == mu("slow", "slow") == 0.6
    assert mu("ghost", "base") == 0.6
    assert mu("ghost", "fast") == mu("ghost", "ghost") == -1.0
    nodes = {body.name: body.nodes for body in model.bodies}
    assert are_in_contact(model, nodes["ghost"], nodes["base"])
    assert not are_in_contact(model, nodes["ghost"], nodes["fast"])
    last = (
        "contact.pairs=[{between: [fast, base], friction_coefficient: 0.1}, "
        "{between: [base, fast], friction_coefficient: 0.3}]"
    )
    assert table(build(SCENE, last))("fast", "base") == 0.3


def test_pairs_alone_are_contact(build):
    model = build(SCENE, "contact.self_contact=[]")
    mu = table(model)
    assert mu("fast", "base") == 0.1
    assert mu("base", "base") == mu("ghost", "fast") == -1.0
    assert not np.isin(np.r_[model.bodies[1].nodes], model.self_contact.nodes).any()


def test_friction_is_that_of_the_pair(build, start):
    """Sliding bodies rub with their own coefficient; one that meets a body with which it makes no
    pair passes through it and feels nothing.
    """
    model = build(SCENE)
    solver = start(model)
    contact, data = solver.terms.self_contacts[0], model.self_contact
    body_of = np.repeat(np.arange(4), [len(b.points) for b in model.bodies])
    owner = np.concatenate([body_of[data.nodes], body_of[data.facets[:, 0]]])
    ratios = {1: [], 2: []}
    while solver.time < 0.6e-3:
        solver.advance(5)
        pressing, friction = (fields.read(f)[0] for f in (contact.pressing, contact.friction))
        for body, found in ratios.items():
            own = (owner == body) & (pressing > 0.0)
            found += list(np.linalg.norm(friction[own], axis=1) / pressing[own])
        assert not (fields.read(contact.facet)[0][owner == 3] >= 0).any()
    assert max(ratios[1]) == pytest.approx(0.6)
    assert max(ratios[2]) == pytest.approx(0.1)
    x = solver.positions()[0]
    ghost, fast = x[model.bodies[3].nodes, 0], x[model.bodies[2].nodes, 0]
    assert ghost.min() < fast.max() - 0.5e-3  # far inside the other
    np.testing.assert_allclose(
        fields.read(solver.terms.nodes.velocity)[0][model.bodies[3].nodes],
        [[-2.0, 0.0]] * len(ghost),
        atol=1e-9,
    )


def test_check_lists_pairs(write_scene):
    loaded = load_scene(write_scene(SCENE))
    rows = dict(acting(loaded, build_model(loaded)))
    assert (
        "base.top, slow, fast with themselves and each other; fast with base.top" in rows["contact"]
    )
    assert "mu 0.6 in self_contact, mu 0.1 between fast and base.top" in rows["friction"]


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        ("{between: [fast, floor], friction_coefficient: 0.1}", "there is no body 'floor'"),
        ("{between: [fast, base.up]}", "there is no facet set 'base.up'"),
        ("{between: [fast]}", "between"),
        ("{between: [fast, base], friction_coefficient: -1}", "friction_coefficient"),
    ],
)
def test_what_is_refused(write_scene, pair, message):
    with pytest.raises(SceneError) as refused:
        build_model(load_scene(write_scene(SCENE), [f"contact.pairs=[{pair}]"]))
    assert message in str(refused.value)
