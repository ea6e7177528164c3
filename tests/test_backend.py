"""Starting Taichi: what is asked for is what is used, or it is said."""

import os
import time

import pytest

from softsim import backend, machine
from softsim.errors import DeviceError


def test_auto_takes_what_is_there(kernel_cache, tmp_path):
    device = backend.start("auto", cache=tmp_path)
    assert device.name == ("cuda" if machine.cuda_device_count() else "cpu")


def test_an_unknown_device_is_refused():
    with pytest.raises(DeviceError, match="unknown device 'tpu'"):
        backend.start("tpu")


def test_an_old_lock_goes_and_a_fresh_one_stays(tmp_path):
    old, fresh = tmp_path / "a" / "ticache.lock", tmp_path / "b" / "ticache.lock"
    for lock in (old, fresh):
        lock.parent.mkdir()
        lock.touch()
    os.utime(old, (time.time() - 3600,) * 2)
    backend.remove_stale_lock(tmp_path)
    assert not old.exists()
    assert fresh.exists()


def test_lane_blocks_round_up(cpu):
    assert backend.lane_blocks(1) == 1
    assert backend.lane_blocks(backend.CPU_LANES + 1) == 2
