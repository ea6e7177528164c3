"""The log of a run on a disk that refuses."""

import logging
import shutil

import pytest

from softsim.errors import OutputError
from softsim.run.record import RunLog


def test_a_line_for_a_log_whose_folder_is_gone_is_an_error_with_its_name(tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    record = logging.LogRecord("softsim", logging.INFO, "", 0, "starts", None, None)
    log = RunLog(folder / "run.log")
    log.handle(record)
    assert (folder / "run.log").read_text().endswith(" INFO starts\n")
    shutil.rmtree(folder)
    with pytest.raises(OutputError, match=r"cannot write .*run\.log.*does not exist"):
        log.handle(record)
