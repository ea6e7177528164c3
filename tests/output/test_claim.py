"""A folder has one writer at a time, and a dead one keeps nobody out."""

import os
import subprocess
import sys

import pytest

from softsim.errors import OutputError
from softsim.output.folder import OWNER, claimed


def test_a_second_claim_is_refused_with_the_name_of_the_first(tmp_path):
    with (
        claimed(tmp_path),
        pytest.raises(
            OutputError, match=f"process {os.getpid()} on .* is using the folder"
        ) as refused,
        claimed(tmp_path),
    ):
        pass
    assert "--out" in refused.value.hint
    assert refused.value.exit_code == 2


def test_a_claim_that_has_ended_leaves_the_folder_free(tmp_path):
    for _ in range(2):
        with claimed(tmp_path):
            pass
        assert not (tmp_path / OWNER).exists()


def test_a_killed_process_keeps_nobody_out(tmp_path):
    """kill -9 leaves the name of the owner, not its claim."""
    code = (
        "import sys; from pathlib import Path; from softsim.output.folder import claimed\n"
        f"with claimed(Path({str(tmp_path)!r})):\n"
        "    print('claimed', flush=True); sys.stdin.read()"
    )
    holder = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout.readline() == "claimed\n"
    with pytest.raises(OutputError, match=f"process {holder.pid} on"), claimed(tmp_path):
        pass
    holder.kill()
    holder.communicate(timeout=60)
    with claimed(tmp_path):
        assert str(os.getpid()) in (tmp_path / OWNER).read_text()
