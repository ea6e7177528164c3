"""Reports that are stopped while they are drawn."""

import os
import signal

import pytest

from softsim.cli.reporting import drawing_can_stop
from softsim.errors import Interrupted
from softsim.output.folder import replacing


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_while_figures_are_drawn_names_what_draws_the_rest(tmp_path, number):
    before = signal.getsignal(signal.SIGTERM)
    with (
        pytest.raises(Interrupted, match=f"numerical results in {tmp_path} are") as stopped,
        drawing_can_stop(tmp_path),
        replacing(tmp_path / "snapshots.png") as partial,
    ):
        partial.write_bytes(b"half a picture")
        os.kill(os.getpid(), number)
    assert f"softsim report {tmp_path}" in stopped.value.hint
    assert list(tmp_path.iterdir()) == []
    assert signal.getsignal(signal.SIGTERM) is before
