import pytest
import yaml
from pydantic import ValidationError

from softsim.apps.chain.scene import ChainScene
from softsim.scene import bodies, meshes, outputs, profiles, schema, walls
from softsim.scene.materials import MooneyRivlinMaterial, OgdenMaterial, YeohMaterial
from softsim.scene.quantities import NotNegativePressure, json_schema
from softsim.scene.schema import Scene, scene_json_schema
from softsim.study.schema import study_json_schema

YEOH = {"law": "yeoh", "C10": "36 kPa", "density": "1070 kg/m^3"}
MOONEY_RIVLIN = {"law": "mooney_rivlin", "C10": "30 kPa", "C01": "6 kPa", "density": "1 g/cm^3"}
OGDEN = {"law": "ogden", "mu": ["60 kPa", "-10 kPa"], "alpha": [1.3, -2.5], "density": "1 g/cm^3"}
CYCLES = {
    "kind": "cycles",
    "highest": "23 kPa",
    "inflation_rate": "5 kPa/s",
    "deflation_rate": "1.3 kPa/s",
    "lowest": "9 kPa",
}
NATURAL = {
    "kind": "natural_deflation",
    "highest": "23 kPa",
    "inflation_rate": "5 kPa/s",
    "time_constant": "1 s",
    "lowest": "9 kPa",
}


def test_the_length_of_a_direction_does_not_matter():
    """Ordinary ones stay as they are written; where squares overflow or vanish they are scaled."""
    for written, held in (([3, 4], (3, 4)), ([0, 1e200], (0, 1)), ([-1e-200, 5e-201], (-1, 0.5))):
        wall = walls.PlaneWall(kind="plane", normal=written)
        assert wall.normal == held
    assert refused(walls.PlaneWall, kind="plane", normal=[0.0, -0.0]) == {"normal"}


def test_every_key_and_class_has_a_description_and_a_short_name():
    """In the schemas as editors get them."""
    for described in (scene_json_schema(), study_json_schema(), json_schema(ChainScene)):
        models = {**described["$defs"], "": described}
        parts = models | {
            f"{name}.{key}": part
            for name, model in models.items()
            for key, part in model["properties"].items()
            if "$ref" not in part  # pydantic leaves out a description that its class has too
        }
        told = {name: part.get("description", "") for name, part in parts.items()}
        assert [name for name, text in told.items() if not text.endswith((".", '".'))] == []
        assert [name for name in models if name and not name.isalnum()] == []
    assert "PressureTable" in scene_json_schema()["$defs"]


def smallest(**changes):
    mesh = {"generator": "block", "length": "1 mm", "height": "1 mm", "element_size": "1 mm"}
    body = {
        "mesh": mesh,
        "formulation": "plane_strain",
        "thickness": "1 mm",
        "material": "soft",
    }
    return {"bodies": {"block": body}, "time": {"end": "1 s"}, **changes}


def refused(part, **values):
    with pytest.raises(ValidationError) as caught:
        part.model_validate(values)
    return {".".join(map(str, error["loc"])) for error in caught.value.errors()}


def test_defaults_are_read_like_given_values():
    scene = Scene.model_validate(smallest())
    assert scene.environment.gravity == 9.81
    assert scene.output.frame_interval == 0.1
    assert scene.bodies["block"].position == (0.0, 0.0)
    skin = meshes.PfrSectionMesh(generator="pfr_section")
    assert (skin.free_length, skin.rear_radius, skin.element_size) == (0.030, 0.0035, 0.00035)


def test_a_scene_is_frozen():
    scene = Scene.model_validate(smallest())
    with pytest.raises(ValidationError):
        scene.title = "another"


def test_compressibility_is_given_once():
    assert YeohMaterial.model_validate(YEOH).bulk_modulus is None
    both = {"D1": "1/MPa", "bulk_modulus": "1 MPa"}
    assert refused(YeohMaterial, **YEOH, **both) == {"D1"}
    assert refused(YeohMaterial, **YEOH, D1="1/MPa", poisson_ratio=0.4) == {"poisson_ratio"}
    assert refused(YeohMaterial, **YEOH, poisson_ratio=0.5) == {"poisson_ratio"}


def test_softening_has_a_width_and_leaves_some_stress():
    mullins = {"r": 2, "beta": 0.1}
    assert YeohMaterial.model_validate({**YEOH, "mullins": mullins}).mullins.m == 0.0
    assert refused(YeohMaterial, **YEOH, mullins={"r": 2}) == {"mullins"}
    assert refused(YeohMaterial, **YEOH, mullins={**mullins, "r": 1}) == {"mullins.r"}
    assert refused(YeohMaterial, **YEOH, mullins={**mullins, "m": -1.0}) == {"mullins.m"}


def test_a_prony_series_leaves_some_stiffness():
    term = {"g": 0.5, "relaxation_time": "2 ms"}
    assert len(YeohMaterial.model_validate({**YEOH, "prony": [term]}).prony) == 1
    assert refused(YeohMaterial, **YEOH, prony=[term, term]) == {"prony"}
    assert refused(YeohMaterial, **YEOH, prony=[{**term, "g": 1}]) == {"prony.0.g"}


def test_times_of_a_table_rise():
    points = [["0 s", "0 kPa"], ["1 s", "9 kPa"], ["1 s", "8 kPa"]]
    assert refused(profiles.TableSpec[NotNegativePressure], kind="table", points=points) == {
        "points"
    }
    valid = {"kind": "table", "points": points[:2]}
    assert len(profiles.TableSpec[NotNegativePressure].model_validate(valid).points) == 2


@pytest.mark.parametrize(
    ("profile", "values"),
    [(profiles.CyclesProfile, CYCLES), (profiles.NaturalDeflationProfile, NATURAL)],
)
def test_the_lowest_pressure_is_below_the_highest(profile, values):
    assert profile.model_validate(values).count == 1
    assert refused(profile, **{**values, "lowest": "23 kPa"}) == {"lowest"}
    assert refused(profile, **{**values, "count": 0}) == {"count"}


def test_an_exponential_fall_ends_above_zero():
    assert refused(profiles.NaturalDeflationProfile, **{**NATURAL, "lowest": "0 kPa"}) == {"lowest"}
    assert profiles.CyclesProfile.model_validate({**CYCLES, "lowest": "0 kPa"}).lowest == 0.0


def test_numbers_are_no_truth_values_and_finite():
    for wrong in (True, "0.5", float("nan"), float("inf"), None, 10**400):
        assert refused(walls.Contact, friction_coefficient=wrong) == {"friction_coefficient"}
    assert walls.Contact(friction_coefficient=1).friction_coefficient == 1.0


def test_quantities_are_no_numbers():
    wrong: object
    for wrong in (3, 3.0, True, None, ["3 s"], {}, float("inf"), 10**400):
        assert refused(schema.TimeSpec, end=wrong) == {"end"}


def test_auto_or_a_positive_quantity():
    assert walls.Contact(penalty_stiffness="auto").penalty_stiffness == "auto"
    stiff = walls.Contact.model_validate({"penalty_stiffness": "2 N/mm"})
    assert stiff.penalty_stiffness == 2000.0
    assert refused(walls.Contact, penalty_stiffness="0 N/m") == {"penalty_stiffness"}


def test_directions_are_not_zero():
    assert refused(walls.PlaneWall, kind="plane", normal=[0, 0]) == {"normal"}


def test_ranges_have_a_limit_and_room():
    assert refused(outputs.LengthRange) == {""}
    assert refused(outputs.LengthRange, min="2 mm", max="1 mm") == {""}
    assert outputs.NumberRange(min=1, max=1).max == 1.0


def test_supports_need_an_outline():
    body = {"mass": "8 g", "inertia": "1 kg*mm^2", "supports": ["skin.inner"]}
    assert refused(bodies.RigidBody, **body) == {"supports"}
    outline = {"length": "33 mm", "height": "15 mm"}
    assert bodies.RigidBody.model_validate({**body, "outline": outline}).supports


def test_a_rigid_body_has_one_mass():
    body = {"inertia": "1 kg*mm^2"}
    assert refused(bodies.RigidBody, **body) == {""}
    assert refused(bodies.RigidBody, **body, mass="8 g", total_mass="10 g") == {""}
    assert bodies.RigidBody.model_validate({**body, "total_mass": "10 g"}).mass is None


@pytest.mark.parametrize("name", ["a.b", "", "1a", "ä", "a b"])
def test_names_can_be_part_of_a_reference(name):
    assert refused(Scene, **smallest(materials={name: YEOH})) == {f"materials.{name}.[key]"}


def test_the_json_schema_describes_texts_with_examples():
    described = scene_json_schema()
    end = described["$defs"]["Time"]["properties"]["end"]
    assert end["type"] == "string" and end["examples"] == ["24 s"] and end["description"]
    assert "include" in described["properties"]
    pfr = described["$defs"]["PfrSectionMesh"]["properties"]
    assert pfr["lean"]["default"] == "2.5 mm"
    assert yaml.safe_load(yaml.safe_dump(described)) == described


@pytest.mark.parametrize(
    ("probes", "column"),
    [
        ({"time": {"kind": "volume", "facets": ["b.surface"]}}, "column time"),
        ({"frame": {"kind": "displacement", "nodes": "b.top"}}, "column frame_x"),
        ({"a": {"kind": "reaction", "nodes": "b.top"},
          "a_x": {"kind": "radius", "nodes": "b.top"}}, "column a_x of the probe 'a_x'"),
    ],
)  # fmt: skip
def test_a_probe_must_not_take_a_column_that_is_there(probes, column):
    with pytest.raises(ValidationError, match=column):
        outputs.Output.model_validate({"probes": probes})


@pytest.mark.parametrize(
    ("written", "read"),
    [("2 kg*mm^2", 1), (["1 kg*mm^2", "2 kg*mm^2", "3 kg*mm^2"], 3)],
)
def test_inertia_is_one_number_or_three(written, read):
    body = bodies.RigidBody.model_validate({"mass": "1 g", "inertia": written})
    assert len(body.inertia) == read


@pytest.mark.parametrize("wrong", ["2 mm", ["1 kg*mm^2", "2 kg*mm^2"], ["1 kg*mm^2"] * 4, []])
def test_another_inertia_is_refused_without_words_of_the_library(wrong):
    with pytest.raises(ValidationError) as caught:
        bodies.RigidBody.model_validate({"mass": "1 g", "inertia": wrong})
    assert all(item["loc"][0] == "inertia" for item in caught.value.errors())
    assert not any("function" in str(part) for e in caught.value.errors() for part in e["loc"])


def test_an_ogden_solid_has_an_exponent_for_each_modulus():
    assert OgdenMaterial.model_validate(OGDEN).constants == ((60e3, -10e3), (1.3, -2.5))
    assert refused(OgdenMaterial, **{**OGDEN, "alpha": [1.3]}) == {"alpha"}
    assert refused(OgdenMaterial, **{**OGDEN, "alpha": [1.3, 0]}) == {"alpha.1"}
    assert refused(OgdenMaterial, **{**OGDEN, "mu": ["60 kPa", "-60 kPa"]}) == {"mu"}
    assert refused(OgdenMaterial, **{**OGDEN, "mu": [], "alpha": []}) == {"mu"}


def test_a_mooney_rivlin_solid_is_stiff_at_rest():
    assert MooneyRivlinMaterial.model_validate(MOONEY_RIVLIN).constants == (30e3, 6e3)
    assert refused(MooneyRivlinMaterial, **{**MOONEY_RIVLIN, "C01": "-30 kPa"}) == {"C01"}
