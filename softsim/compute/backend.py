"""Start of Taichi: device, precision, lanes, cache folder.

A *lane vector* holds one number for each of `lanes()` neighbouring elements. LLVM vectorises
arithmetic on it, which it does not do for loops over Taichi fields; on a GPU, where the threads
are the lanes, it has length one. Both use the same source of the physics.
"""

import contextlib
import io
import os
from dataclasses import dataclass
from pathlib import Path

import taichi as ti

from softsim.compute.machine import chosen_device, processor_count
from softsim.compute.taichi_internals import remove_stale_lock
from softsim.errors import DeviceError

# -------------------------------------------------------------------------------------------------
# Number of threads for the next increments: all, unless a single one was faster recently.
#
# Threads wait for each other by polling, many times per increment. That is quick while each has a
# core of its own; if another program takes one, the others wait for that thread to be scheduled,
# and all together can be many times slower than one alone. Therefore both are timed, in turns.

# Turns in a row together, or alone after that was faster: a look at the other way may be slow.
MANY_TURNS = 50
# Calls make up a turn once they took so long [s]: a processor that is away for some milliseconds,
# as those of virtual machines are, must not decide.
TURN = 20e-3
# So many turns in a row slower than alone, or one that took so many times as long, are enough.
SLOW_TURNS = 3
MUCH_SLOWER = 2.0


class ThreadCount:
    """Choice between one and `size` threads. workers: number of threads for the next call."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.workers = 1
        self._turns_left = 1
        self._slow_turns = 0
        self._alone = 0.0  # seconds an increment of one worker, when last seen
        self._increment_count, self._seconds = 0, 0.0  # of this turn

    def note(self, increment_count: int, seconds: float) -> None:
        """Record the wall time [s] of the last call and its number of increments."""
        if self.size == 1:
            return
        self._increment_count += increment_count
        self._seconds += seconds
        if self._seconds >= TURN:
            self._end_turn(self._seconds / self._increment_count)
            self._increment_count, self._seconds = 0, 0.0

    def _end_turn(self, pace: float) -> None:
        """Choose the number of threads of the next turn after one at `pace` [s/increment]."""
        self._turns_left -= 1
        if self.workers == 1:
            self._alone = pace
            if self._turns_left == 0:
                self.workers, self._turns_left = self.size, MANY_TURNS
            return
        self._slow_turns = self._slow_turns + 1 if pace > self._alone else 0
        if self._slow_turns == SLOW_TURNS or pace > MUCH_SLOWER * self._alone:
            self.workers, self._turns_left, self._slow_turns = 1, MANY_TURNS, 0
        elif self._turns_left == 0:
            self.workers, self._turns_left = 1, 1


# -------------------------------------------------------------------------------------------------
# The device in use.

# Measured: of triangles and tetrahedra 8 and 16 f64 lanes are equally fast, 4 slower by a fifth; of
# quadrilaterals 4 are as fast as 8, of hexahedra faster by a tenth, and both compile in half the
# time.
CPU_LANES, QUAD_LANES = 8, 4
# A row of the history of 1,100 hexahedra took 6 ms while one thread of an H200 summed all energies.
GPU_PARTS = 128
real = ti.f64


@dataclass(frozen=True)
class Device:
    """Device that kernels run on: `name` is "cpu" or "cuda", `lanes` the elements of a lane vector.

    threads: CPU threads that share an increment; 1 on a GPU. parts: number of partial sums of an
    energy, one for each thread of a GPU that sums.
    """

    name: str
    precision: str
    lanes: int
    threads: int = 1
    parts: int = 1


_device: Device | None = None


def start(
    device: str = "auto", cache: Path | None = None, threads: int = 1, most_lanes: int = CPU_LANES
) -> Device:
    """Start or restart Taichi and return the device in use.

    Parameters
    ----------
    device: "cpu", "cuda" or "auto": CUDA where present.
    cache: folder of compiled kernels; the user's cache folder by default.
    threads: CPU threads that share an increment; see `softsim.compute.machine.choose`.
    most_lanes: elements in a lane vector of a CPU, CPU_LANES at most; see `Model.most_lanes`.

    Raises
    ------
    DeviceError: "cuda" was asked for and none answers or starts (Taichi alone would only warn).
    """
    global _device
    name = chosen_device(device)
    if threads > processor_count():  # Taichi would start fewer, and these wait for the others
        raise DeviceError(
            f"{threads} threads were requested, but there are {processor_count()} processors",
            hint=f"at most {processor_count()} threads",
        )
    folder = cache or default_cache_folder()
    folder.mkdir(parents=True, exist_ok=True)
    remove_stale_lock(folder)
    with contextlib.redirect_stdout(io.StringIO()):  # Taichi announces itself on every start
        start_taichi(name, folder, threads)
    if name == "cuda" and ti.cfg.arch != ti.cuda:
        raise DeviceError(
            "a CUDA device was found, but Taichi could not start on it",
            hint="the driver may be too old, or the card may have no free memory: see `softsim "
            "devices`, or run with --device cpu",
        )
    on_cpu = name == "cpu"
    lanes = min(most_lanes, CPU_LANES) if on_cpu else 1
    _device = Device(name, "f64", lanes, threads if on_cpu else 1, 1 if on_cpu else GPU_PARTS)
    return _device


def start_taichi(name: str, folder: Path, threads: int) -> None:
    """Call ti.init with the settings of this solver."""
    ti.init(
        arch=ti.cuda if name == "cuda" else ti.cpu,
        default_fp=real,
        default_ip=ti.i32,
        cpu_max_num_threads=threads,
        fast_math=name == "cpu",  # on CUDA it makes the f64 square root single-accurate
        # LLVM does the same again: 3 times the time to compile, and kernels no faster for it.
        cfg_optimization=False,
        # Taichi 1.7.4 caches a[s, 0] across a store to a[s, r]: wrong inside our serial kernels.
        cache_loop_invariant_global_vars=False,
        offline_cache=True,
        offline_cache_file_path=str(folder),
        log_level=ti.WARN,
    )


def default_cache_folder() -> Path:
    """Return the folder of compiled kernels: $SOFTSIM_CACHE, else the user's cache folder."""
    given = os.environ.get("SOFTSIM_CACHE")
    if given:
        return Path(given)
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "softsim" / "kernels"


def device() -> Device:
    """Return the device in use.

    Raises
    ------
    DeviceError: `start` was not called.
    """
    if _device is None:
        raise DeviceError(
            "Taichi has not been started", hint="call softsim.compute.backend.start() first"
        )
    return _device


def lanes() -> int:
    """Return the number of elements in one lane vector on this device."""
    return device().lanes


def lane_vector() -> type:
    """Return the Taichi type of one number per lane."""
    return ti.types.vector(lanes(), real)


def lane_blocks(count: int) -> int:
    """Return the number of lane vectors for `count` elements (the last one may be padded)."""
    return -(-count // lanes())
