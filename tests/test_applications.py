"""Entry points of the applications: each leads somewhere, and nothing else leads to them."""

import subprocess
import sys
from pathlib import Path

import pytest
from typer.main import get_command

import softsim
from softsim.applications import COMMANDS, DRAWINGS, STUDY_MODELS, entry
from softsim.cli import app
from softsim.study.cases import Source, source_class

PACKAGE = Path(softsim.__file__).parent


def test_only_the_entry_points_name_applications():
    """Import-linter does not see modules that are named in text."""
    outside = (path for path in PACKAGE.rglob("*.py") if PACKAGE / "apps" not in path.parents)
    naming = [path.name for path in outside if "softsim.apps" in path.read_text(encoding="utf-8")]
    assert naming == ["applications.py"]


def test_commands_are_on_the_command_line():
    known = get_command(app).commands
    for point in COMMANDS:
        assert known[entry(point).__name__.replace("_", "-")].callback is not None


@pytest.mark.parametrize("model", STUDY_MODELS)
def test_a_model_of_studies_brings_its_program_and_a_command(model):
    kind = source_class(model)
    assert issubclass(kind, Source) and kind is not Source
    source = kind(Path("robot.yaml"))
    assert callable(source.program)
    assert source.command[:2] == ("softsim", model) and model in get_command(app).commands


def test_scenes_of_the_engine_have_no_program():
    assert source_class("finite_elements")(Path("robot.yaml")).program is None


def test_drawings_leave_other_folders_alone(tmp_path):
    assert [entry(point)(tmp_path) for point in DRAWINGS] == [None] * len(DRAWINGS)


def test_a_chain_is_run_and_drawn_without_taichi(tmp_path):
    code = (
        "import sys; from softsim.cli import app\n"
        f"command = ['chain', 'leafbot3', '--set', 'time.end=20 ms', '--out', {str(tmp_path)!r}]\n"
        f"for arguments in (command, ['report', {str(tmp_path)!r}], ['schema', 'chain']):\n"
        "    app(arguments, standalone_mode=False)\n"
        "    assert 'taichi' not in sys.modules, arguments\n"
        "import softsim.apps.calibration.experiments\n"
        "assert 'taichi' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "chain.png").is_file()
