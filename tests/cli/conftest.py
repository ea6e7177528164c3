"""The command line, as tests call it."""

import pytest
from typer.testing import CliRunner

from softsim.cli import app


@pytest.fixture(scope="session")
def softsim(kernel_folder):
    """A command in this process, which has imported Taichi already: its exit code, what it printed.

    Whatever the command does not tell its user as an error of theirs is raised.
    """
    runner = CliRunner(env={"SOFTSIM_CACHE": kernel_folder})
    return lambda *arguments: runner.invoke(app, list(map(str, arguments)), catch_exceptions=False)
