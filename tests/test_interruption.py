"""Signals that come while nothing of the run is there yet."""

import os
import subprocess
import sys

SWALLOWING = """
import os, signal
try:
    os.kill(os.getpid(), signal.SIGINT)
except:  # as Taichi's decorators do
    pass
"""


def test_ctrl_c_during_an_import_that_swallows_it_ends_the_command(tmp_path):
    (tmp_path / "swallowing.py").write_text(SWALLOWING)
    code = "import softsim.interruption as i; i.become_command(); import swallowing; print('lost')"
    paths = os.pathsep.join([str(tmp_path), *sys.path])
    ended = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
    )
    assert (ended.returncode, ended.stdout, ended.stderr) == (130, "", "stopped by SIGINT\n")


def test_a_signal_during_an_import_interrupts_a_block_after_it(tmp_path):
    """An import would lose it, as above."""
    (tmp_path / "swallowing.py").write_text(SWALLOWING)
    code = """
import time
from softsim.interruption import interrupted_by_signals
with interrupted_by_signals():
    try:
        import swallowing
        print("imported", flush=True)
        time.sleep(60)
    except KeyboardInterrupt as stop:
        print(stop)
"""
    ended = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])},
        capture_output=True,
        text=True,
        timeout=30.0,
    )
    assert ended.stdout == "imported\nSIGINT\n"
