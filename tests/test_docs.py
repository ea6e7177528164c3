"""README and docs/: command lines are such as softsim takes, links lead somewhere, scenes load."""

import ast
import re
import shlex
import shutil
import sys
from importlib.util import module_from_spec, spec_from_file_location

import pytest
import yaml
from pages import BLOCK, PAGES, ROOT, blocks, first_scene, inline_fragments, name
from typer.main import get_command

from softsim import __version__
from softsim.apps.chain.scene import load_chain
from softsim.builder import build_model
from softsim.cli import app
from softsim.cli.about import examples_folder
from softsim.scene.loading import load_layout, load_scene
from softsim.scene.schema import Scene
from softsim.scene.steps import load_steps
from softsim.study.loading import load_study

LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#+ (.*)", re.MULTILINE)
CALLABLE = re.compile(r"^::: (\S+)", re.MULTILINE)
OF_ARGUMENT = {"N": "4", "X": "0.5", "...": "auto"}  # of a word in a table of commands


def command_lines(page):
    """Every `softsim ...` of a page, in a block or in the text, as it would be typed."""
    shell = "\n".join(blocks(page, "")).replace("\\\n", " ").splitlines()
    inline = re.findall(r"`(softsim [^`]+)`", BLOCK.sub("", page.read_text()))
    for line in [*shell, *inline]:
        yield from (part.strip() for part in line.split("&&") if part.strip()[:8] == "softsim ")


def typed(line):
    """The words after `softsim`, options in brackets taken, of alternatives the first."""
    words = shlex.split(re.sub(r"\](\.\.\.)?", " ", line.replace("[", " ").replace("\\|", "|")))
    return [OF_ARGUMENT.get(word, word) for word in (w.split("|")[0] for w in words[1:])]


LINES = [(name(page), line) for page in PAGES for line in command_lines(page)]


def test_there_are_pages_and_commands():
    assert len(PAGES) > 10 and len(LINES) > 30


def of_no_command(line):
    """Whether a line names no command: `softsim COMMAND --help`, `softsim --version`."""
    return typed(line)[0].startswith("-") or typed(line)[0].isupper()


@pytest.mark.parametrize("page, line", [entry for entry in LINES if not of_no_command(entry[1])])
def test_a_command_line_is_one_that_softsim_takes(page, line):
    called, *words = typed(line)
    command = get_command(app).commands[called]
    if not words:  # named in the text, not told how to call
        return
    given = command.make_context(called, words).params
    scene = given.get("scene")
    if called == "chain" and not given["robot"].isupper():
        load_chain(given["robot"], given["overrides"] or [])
    if scene is not None and (ROOT / scene).is_file():
        given_overrides = given["overrides"] or []
        load_steps(ROOT / scene, given_overrides) or load_scene(ROOT / scene, given_overrides)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_files_that_a_page_names_exist(page):
    named = re.findall(r"\bscenes/[\w/]+\.yaml", page.read_text())
    assert [path for path in named if not (ROOT / path).is_file()] == []


def anchors(page):
    """What the headings of a page are called in links."""
    words = (re.sub(r"[^\w\- ]", "", heading).strip().lower() for heading in HEADING.findall(page))
    return {text.replace(" ", "-") for text in words}


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page):
    for link in LINK.findall(BLOCK.sub("", page.read_text())):
        if re.match(r"https?://", link):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        assert target.is_file(), link
        assert not anchor or anchor in anchors(target.read_text()), link


YAML_BLOCKS = [(name(page), text) for page in PAGES for text in blocks(page, "yaml")]


@pytest.mark.parametrize("page, text", YAML_BLOCKS)
def test_whole_files_load(page, text, tmp_path):
    """Scenes, layouts and studies."""
    scenes = tmp_path / "scenes"
    shutil.copytree(examples_folder(), scenes)
    keys = set(yaml.safe_load(text))
    if "factors" in keys:
        load_study(written(scenes / "studies" / "here.yaml", text))
    elif "pipe_path" in text:
        load_layout(written(scenes / "here.yaml", text), "pfr", [])
    elif "robot:chain/" in text:
        load_chain(written(scenes / "here.yaml", text))
    elif {"bodies", "steps"} <= keys:
        load_steps(written(scenes / "here.yaml", text))
    elif {"bodies", "time"} <= keys:
        load_scene(written(scenes / "here.yaml", text))


FROM_OTHERS = ["docs/how_to/from_abaqus.md", "docs/how_to/from_sofa.md"]
FRAGMENTS = [
    (name(page), text)
    for page in PAGES
    for text in [*blocks(page, "yaml"), *inline_fragments(page)]
    if yaml.safe_load(text).keys() <= {*Scene.model_fields, "include", "steps"}
]
COMPLETED = """
bodies: {skin: {mesh: {generator: pfr_solid}, formulation: solid, material: dragon_skin_10}}
rigid_bodies: {frame: {mass: 10 g, inertia: 1 g*mm^2}}
time: {end: 1 s}
"""


@pytest.mark.parametrize("page, text", [f for f in FRAGMENTS if f[0] not in FROM_OTHERS])
def test_parts_of_scenes_fit_the_schema(page, text, tmp_path):
    """Beside a robot and the first whole scene of their page."""
    written(tmp_path / "robot.yaml", COMPLETED)
    written(tmp_path / "example.yaml", first_scene(ROOT / page) or COMPLETED)
    said = yaml.safe_load(text)
    include = said.get("include", [])
    own = [include] if isinstance(include, str) else include
    said["include"] = ["robot.yaml", "example.yaml", *own]
    path = written(tmp_path / "here.yaml", yaml.safe_dump(said))
    load_steps(path, []) or load_scene(path)


@pytest.mark.parametrize("page, text", [f for f in FRAGMENTS if f[0] in FROM_OTHERS])
def test_parts_of_scenes_are_accepted_beside_the_example_of_their_page(page, text, tmp_path):
    """With all names of sets, bodies, walls that they use."""
    for deck in (body for body in blocks(ROOT / page, "text") if "*NODE" in body):
        written(tmp_path / "ring.inp", deck)
    example = first_scene(ROOT / page)
    written(tmp_path / "example.yaml", example)
    path = tmp_path / "here.yaml"
    written(path, text if text == example else f"include: example.yaml\n{text}")
    steps = load_steps(path, [])
    build_model(steps[0].loaded if steps else load_scene(path))


def written(path, text):
    """`path`, that now holds `text`."""
    path.write_text(text)
    return path


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_python_in_a_page_is_python(page):
    for text in blocks(page, "python"):
        ast.parse(text)


def test_the_api_page_names_what_there_is():
    from pkgutil import resolve_name

    names = CALLABLE.findall((ROOT / "docs" / "reference" / "api.md").read_text())
    assert names and all(resolve_name(public) for public in names)


def test_the_gallery_has_the_pictures_that_its_command_makes():
    """Each of a section with its command and figure, none besides, all small."""
    path = ROOT / "docs" / "site" / "gallery.py"
    spec = spec_from_file_location("gallery", path)
    sys.modules["gallery"] = gallery = module_from_spec(spec)
    spec.loader.exec_module(gallery)
    found = [entry.picture for entry in gallery.entries(gallery.PAGE.read_text())]
    assert sorted(found) == sorted((gallery.PAGE.parent / "gallery").iterdir())
    assert max(picture.stat().st_size for picture in found) <= gallery.LARGEST
    with pytest.raises(ValueError, match="'Second' has not one picture, one command and one"):
        gallery.entries("# Gallery\n\n## Second\n\nnothing\n")


def test_the_table_of_materials_has_the_constants_of_the_library():
    text = (ROOT / "softsim" / "materials" / "library.yaml").read_text()
    constants = ("C10", "C20", "C30", "density")
    library = {
        name: [float(str(entry.get(key, 0)).split()[0]) for key in constants]
        for name, entry in yaml.safe_load(text)["materials"].items()
    }
    page = (ROOT / "docs" / "reference" / "materials.md").read_text()
    rows = re.findall(r"^\| `(\w+)` \| (.*)", page, re.MULTILINE)
    assert {name: [float(c) for c in row.split(" | ")[:4]] for name, row in rows} == library


def test_the_page_of_examples_lists_every_scene():
    page = (ROOT / "docs" / "reference" / "examples.md").read_text()
    scenes = sorted(str(path.relative_to(ROOT)) for path in (ROOT / "scenes").rglob("*.yaml"))
    assert [path for path in scenes if f"`{path}`" not in page] == []


def test_every_page_is_in_the_site():
    docs = ROOT / "docs"
    parts = yaml.safe_load((docs / "site" / "mkdocs.yml").read_text())["nav"]
    entries = [entry for part in parts for entry in part.values()]
    names = [page for e in entries for page in (e if isinstance(e, list) else [e])]
    notebooks = [path.with_suffix(".md") for path in docs.rglob("*.ipynb")]
    pages = [str(path.relative_to(docs)) for path in [*PAGES[1:], *notebooks]]
    assert sorted(names) == sorted(pages)


def test_readme_is_two_pages():
    assert len((ROOT / "README.md").read_text().splitlines()) <= 160


def test_ci_runs_the_test_command_of_the_readme():
    (command,) = (
        line for text in blocks(PAGES[0], "") for line in [text.strip()] if "pytest" in line
    )
    assert command in (ROOT / ".ci" / "run").read_text()


def test_the_citation_and_the_changelog_name_the_version():
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert {"cff-version", "message", "title", "authors", "license", "abstract"} <= cited.keys()
    notes = (ROOT / "docs" / "developers" / "changelog.md").read_text()
    assert cited["version"] == __version__ and f"\n## {__version__}" in notes
