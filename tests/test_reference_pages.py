"""The reference pages that docs/site/reference.py generates."""

import re
import sys
from importlib.util import module_from_spec, spec_from_file_location

import pytest
from pages import ROOT
from typer.main import get_command

from softsim.analysis.catalogue import MEASURES
from softsim.cli import app
from softsim.scene.schema import scene_json_schema


@pytest.fixture(scope="module")
def reference():
    """The hook."""
    spec = spec_from_file_location("reference", ROOT / "docs" / "site" / "reference.py")
    sys.modules["reference"] = hook = module_from_spec(spec)
    spec.loader.exec_module(hook)
    return hook


@pytest.fixture(scope="module")
def scene_page(reference):
    """The generated part of the page of scene keys."""
    return "\n".join(reference.SceneReference().lines())


def test_every_class_of_the_schema_has_a_heading_and_every_key_a_row(reference, scene_page):
    schema = scene_json_schema()
    headed = re.findall(r"^### .* \{ #(\w+) \}$", scene_page, re.MULTILINE)
    assert sorted(headed) == sorted({reference.target(name) for name in schema["$defs"]})
    parts = re.split(r"^### .* \{ #(\w+) \}$", scene_page, flags=re.MULTILINE)[1:]
    for name, text in zip(parts[::2], parts[1::2], strict=True):
        keys = re.findall(r"^\| `(\w+)` \|", text.partition("\n## ")[0], re.MULTILINE)
        assert sorted(keys) == sorted(schema["$defs"][name]["properties"])


def test_every_link_of_the_page_of_scene_keys_leads_to_a_heading(scene_page):
    anchors = set(re.findall(r"\{ #(\w+) \}$", scene_page, re.MULTILINE))
    anchors |= {name.lower() for name in re.findall(r"^## (\w+)$", scene_page, re.MULTILINE)}
    links = set(re.findall(r"\]\(#(\w+)\)", scene_page))
    assert len(links) > 80 and links <= anchors


def test_tables_have_four_columns(scene_page):
    rows = [line for line in scene_page.splitlines() if line.startswith("|")]
    assert {len(re.findall(r"(?<!\\)\|", row)) for row in rows} == {5}


def test_a_profile_is_described_once_and_linked_with_its_unit(scene_page):
    assert "| `pull_profile` | [profile](#profiles) of `36 mm` |" in scene_page
    assert scene_page.count("### `smooth_step`") == 1


def test_every_command_is_described_in_full(reference):
    page = reference.commands()
    names = get_command(app).commands
    assert all(f"### `softsim {name}`" in page for name in names)
    listed = re.findall(r"^\* `[\w-]+`: (.*)$", page, re.MULTILINE)[: len(names)]
    assert all(text.endswith(".") and not text.endswith("...") for text in listed)


def test_every_measure_of_the_catalogue_has_a_row_with_a_meaning(reference):
    rows = [line for line in reference.measures() if line.startswith("| `")]
    assert [row.split("`")[1] for row in rows] == [measure.name for measure in MEASURES]
    assert all(re.fullmatch(r"\| `[\w.]+` \| [^|]+ \| [A-Z`][^|]+\. \|", row) for row in rows)


def test_a_page_without_the_mark_stays_as_it_is(reference):
    class File:
        src_uri = "reference/scene.md"

    class Page:
        file = File

    assert reference.on_page_markdown("# Scene keys", Page) == "# Scene keys"
    assert "### `yeoh`" in reference.on_page_markdown(reference.MARK, Page)
    File.src_uri = "reference/commands.md"
    assert "softsim run" in reference.on_page_markdown(reference.MARK, Page)
    File.src_uri = "reference/results.md"
    marks = reference.MARK_OF_MEASURES + reference.MARK_OF_COLUMNS
    page = reference.on_page_markdown(marks, Page)
    assert "| `peak_pull` | N |" in page and "| `rear_x`, `front_x` | m |" in page
    File.src_uri = "index.md"
    assert reference.on_page_markdown(reference.MARK, Page) == reference.MARK
