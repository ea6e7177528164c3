"""The process that shows how long kernels are compiled, and says so if that is stopped."""

import json
import subprocess
import sys

import pytest

from softsim.output import compiling


def watched(folder, text):
    """Run the watching process with `text` as the word of the compiling one."""
    command = [sys.executable, "-S", compiling.__file__, "0", str(folder)]
    return subprocess.run(command, input=text, capture_output=True, text=True)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "summary.json").write_text('{"status": "starting", "title": "a block"}')
    return tmp_path


def test_kernels_that_are_ready_soon_are_not_worth_a_word(folder):
    ended = watched(folder, compiling.READY)
    assert (ended.stdout, ended.stderr) == ("", "")
    assert json.loads((folder / "summary.json").read_text())["status"] == "starting"


def test_a_process_that_ends_while_it_compiles_is_noted(folder):
    ended = watched(folder, "")
    assert ended.stderr == f"error: {compiling.ENDED}\n"
    summary = json.loads((folder / "summary.json").read_text())
    assert (summary["status"], summary["title"]) == ("interrupted", "a block")
    assert compiling.ENDED in (folder / "run.log").read_text()
