"""Taichi beside its public interface: names that softsim needs exist and behave as it needs."""

import os
import time
from importlib import metadata
from types import SimpleNamespace

import numpy as np
import pytest
import taichi as ti

from softsim.compute import backend, fields, taichi_internals
from softsim.compute.machine import processor_count
from softsim.compute.taichi_internals import SHARE, Barrier, Launch, offset_in_block
from softsim.errors import DeviceError

THREADS = 2


def test_the_installed_taichi_is_the_version_with_these_names():
    assert metadata.version("taichi") == taichi_internals.VERSION


def test_a_missing_name_says_which_version_has_it():
    moved = SimpleNamespace(__name__="taichi.lang.impl")
    wanted = r"Taichi 1\.7\.4 has no 'get_traceback' in 'taichi.lang.impl', which softsim needs"
    with pytest.raises(DeviceError, match=wanted) as caught:
        taichi_internals.replace(moved, "get_traceback", str)
    assert f"taichi=={taichi_internals.VERSION}" in caught.value.hint
    assert not hasattr(moved, "get_traceback")


def test_an_error_in_a_kernel_shows_its_source_line(fresh_taichi):
    @ti.kernel
    def wrong():
        for _ in range(2):
            print(name_that_is_nowhere)  # noqa: F821 (its error is tested)

    with pytest.raises(ti.TaichiNameError) as caught:
        wrong()
    assert "print(name_that_is_nowhere)" in str(caught.value)
    assert __file__ in str(caught.value)


@ti.data_oriented
class Sums:
    def __init__(self):
        self.numbers = fields.real_field(np.arange(4.0))

    @ti.kernel
    def add(self, first: ti.i32, factors: ti.types.ndarray(ti.f64, ndim=1)):
        ti.loop_config(serialize=True)
        for k in range(first, 4):
            self.numbers[k] = self.numbers[k] + factors[k]
            factors[k] = self.numbers[k]


def test_a_launch_is_a_call_of_the_kernel(restart):
    restart()
    sums, factors = Sums(), np.array([10.0, 20.0, 30.0, 40.0])
    launch = Launch(sums.add, 0, factors)
    assert fields.read(sums.numbers).tolist() == [0.0, 1.0, 2.0, 3.0]  # only compiled
    launch(2, factors)
    launch(3, other := np.full(4, 0.5))
    assert fields.read(sums.numbers).tolist() == [0.0, 1.0, 32.0, 43.5]
    assert factors.tolist() == [10.0, 20.0, 32.0, 43.0]
    assert other.tolist() == [0.5, 0.5, 0.5, 43.5]
    restart()
    assert backend.device().name == "cpu"
    with pytest.raises(DeviceError, match="started again"):
        launch(0, factors)


def test_fields_lie_at_their_offsets_in_one_block(fresh_taichi):
    with fields.together():
        first, second = fields.real_field(np.ones((2, 5))), fields.vector_field(np.ones((3, 2)))

    @ti.kernel
    def apart() -> ti.i64:
        return ti.cast(ti.get_addr(second, [0]) - ti.get_addr(first, [0, 0]), ti.i64)

    assert apart() == offset_in_block(second) - offset_in_block(first) >= 80


def test_an_old_lock_goes_and_a_fresh_one_stays(tmp_path):
    old, fresh = tmp_path / "a" / "ticache.lock", tmp_path / "b" / "ticache.lock"
    for lock in (old, fresh):
        lock.parent.mkdir()
        lock.touch()
    os.utime(old, (time.time() - 3600,) * 2)
    taichi_internals.remove_stale_lock(tmp_path)
    assert not old.exists()
    assert fresh.exists()


@ti.data_oriented
class Rounds:
    """Each worker notes the round; after the barrier it counts whom it sees in the same round."""

    def __init__(self):
        self.barrier = Barrier(*(fields.index_field(np.zeros(1, dtype=int)) for _ in range(2)))
        self.now, self.seen = (fields.index_field(np.zeros(THREADS, dtype=int)) for _ in range(2))

    @ti.kernel
    def run(self, rounds: ti.i32, workers: ti.i32, zero: ti.i32) -> ti.i32:
        self.barrier.reset()
        for share in range(THREADS * SHARE):
            worker = share // SHARE
            if share % SHARE == 0:
                met = 0
                for k in range(rounds):
                    self.now[worker] = k + 1
                    met = self.barrier.meet(met, workers, zero)
                    for other in range(THREADS):
                        if self.now[other] == k + 1:
                            self.seen[worker] += 1
                    met = self.barrier.meet(met, workers, zero)
        return self.barrier.lost[0]


@pytest.mark.skipif(processor_count() < THREADS, reason="needs two processors")
def test_threads_wait_for_each_other_and_not_for_ever(restart, monkeypatch):
    restart(threads=THREADS, device="cpu")
    rounds = Rounds()
    assert rounds.run(200, THREADS, 0) == 0
    assert fields.read(rounds.seen).tolist() == [200 * THREADS] * THREADS
    monkeypatch.setattr(taichi_internals, "MOST_LOOKS", 1000)  # written into the next kernel
    assert Rounds().run(1, THREADS + 1, 0) == 1  # one that never comes
