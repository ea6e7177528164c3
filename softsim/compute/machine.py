"""Hardware of the machine, and the choice of device and threads.

Nothing here starts Taichi, so that a command fails at once if the hardware is missing.
"""

import ctypes
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import psutil
import pynvml

from softsim.errors import DeviceError

AUTO = "auto"
DEVICES = (AUTO, "cpu", "cuda")

# From so many corners of elements on, those of 5,000 triangles or 1,900 hexahedra, `auto` takes
# every processor. Two threads are hardly faster than one for 1,654 triangles and contact, 1.4 times
# as fast for 2,600, 1.9 times for 20,000 (measured): below, the other core does more good in a
# second run.
CORNERS_FOR_THREADS = 15_000
# From so many on, those of 2,000 tetrahedra or 1,000 hexahedra, `auto` takes a graphics card. An
# increment of the robot's section (432 corners) takes one thread of a Xeon 9 us and an H200 25 us,
# one of the robot in space (9,072) one thread 510 us, 8 threads 110 to 130 us, and the H200 77 us;
# and a card takes some ten seconds more to start.
CORNERS_FOR_GPU = 8_000


@dataclass(frozen=True)
class Memory:
    """Free and total memory [bytes]."""

    free: int
    total: int


class ComputeDevice(Protocol):
    """Hardware with a name and its own memory, which can hold fields."""

    @property
    def name(self) -> str:
        """Product name."""

    @property
    def memory(self) -> Memory:
        """Current memory."""


@dataclass(frozen=True)
class Processor:
    """CPU: its name, the cores this process may use, the machine's memory."""

    name: str
    cores: int
    memory: Memory


@dataclass(frozen=True)
class GraphicsCard:
    """First NVIDIA card this process may use."""

    name: str
    driver: str
    memory: Memory


@dataclass(frozen=True)
class Choice:
    """Device and threads of runs.

    `device` is "cpu", "cuda" or, if there is a card, `auto`; `threads` is a number or None for
    `auto`.

    Raises DeviceError: several threads on the GPU.
    """

    device: str
    threads: int | None

    def __post_init__(self) -> None:
        if self.device == "cuda" and self.threads not in (None, 1):
            raise DeviceError(
                f"--threads {self.threads} applies to the CPU, and this run uses the GPU",
                hint=f"use --device cpu --threads {self.threads}, or leave --threads out",
            )

    def device_for(self, corner_count: int) -> str:
        """Return "cpu" or "cuda" for a model with `corner_count` element nodes.

        `auto` selects the card for a large model, unless several threads were requested.
        """
        if self.device != AUTO:
            return self.device
        is_large = corner_count >= CORNERS_FOR_GPU
        return "cuda" if is_large and self.threads in (None, 1) else "cpu"

    def allows(self, device: str) -> bool:
        """Return True if a run started on `device`, "cpu" or "cuda", may continue on it."""
        return self.device in (AUTO, device)

    def threads_for(self, corner_count: int) -> int:
        """Return the number of CPU threads for a model with `corner_count` element nodes."""
        if self.threads is not None:
            return self.threads
        is_large = corner_count >= CORNERS_FOR_THREADS
        return processor_count() if is_large and self.device_for(corner_count) == "cpu" else 1


def choose(device: str = AUTO, threads: int | str = AUTO) -> Choice:
    """Return the device and threads of runs on this machine.

    device: "auto" (depends on the model, see `Choice.device_for`), "cpu" or "cuda".
    threads: a number, or "auto".

    Raises DeviceError, with the available hardware, for a request that cannot be met.
    """
    taken = chosen_device(device)
    is_open = device == AUTO and taken == "cuda"
    return Choice(AUTO if is_open else taken, asked_threads(threads))


def chosen_device(device: str) -> str:
    """Return "cpu" or "cuda" for `device` (one of DEVICES); "auto" is the card if there is one.

    Raises DeviceError: no such device.
    """
    if device not in DEVICES:
        raise DeviceError(f"unknown device '{device}'", hint=f"one of: {', '.join(DEVICES)}")
    if device == "cuda" and cuda_device_count() == 0:
        cpu = processor()
        raise DeviceError(
            "no CUDA device was found on this machine",
            hint=f"use the CPU ({cores(cpu.cores)}, {cpu.name}): --device cpu, or let softsim "
            "choose: --device auto",
        )
    if device == AUTO:
        return "cuda" if cuda_device_count() else "cpu"
    return device


def device_of_trials(device: str) -> str:
    """Return "cpu" or "cuda" for `device` (one of DEVICES) in trial runs; "auto" is the CPU.

    Workers compute the runs one by one: a CPU has many workers, a card has one.

    Raises DeviceError: no such device.
    """
    return "cpu" if device == AUTO else chosen_device(device)


def asked_threads(threads: int | str) -> int | None:
    """Return the requested number of threads, None for "auto".

    Raises DeviceError: no whole number, less than one, or more than there are processors.
    """
    if threads == AUTO:
        return None
    try:
        number = int(threads)
    except ValueError:
        raise DeviceError(
            f"--threads {threads}: must be a whole number, or auto",
            hint=f"use 1 to {processor_count()} on this machine",
        ) from None
    available = processor_count()
    if number < 1:
        raise DeviceError(
            f"--threads {number}: at least one thread is needed",
            hint=f"use 1 to {available} on this machine",
        )
    if number > available:
        there_are = "there is 1" if available == 1 else f"there are {available}"
        raise DeviceError(
            f"--threads {number} is more than the number of processors available to this process",
            hint=f"{there_are}; use --threads {available} or less",
        )
    return number


def processor_count() -> int:
    """Return the number of processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def cores(count: int) -> str:
    """Return "1 core", "2 cores" and so on."""
    return f"{count} core{'s' if count != 1 else ''}"


def processor() -> Processor:
    """Return the CPU of this machine."""
    memory = psutil.virtual_memory()
    return Processor(processor_name(), processor_count(), Memory(memory.available, memory.total))


def processor_name() -> str:
    """Return the product name of the CPU as the operating system reports it."""
    facts = Path("/proc/cpuinfo")  # Linux, where `platform` knows the architecture only
    if facts.is_file():
        for line in facts.read_text("utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name":
                return value.strip()
    return platform.processor() or platform.machine()


def cuda_device_count() -> int:
    """Return the number of cards that the CUDA driver reports; zero without a driver."""
    try:
        driver = ctypes.CDLL("nvcuda.dll" if os.name == "nt" else "libcuda.so.1")
    except OSError:  # no driver: Taichi would find the same, with a mere warning
        return 0
    count = ctypes.c_int(0)
    answers = driver.cuInit(0) == 0 and driver.cuDeviceGetCount(ctypes.byref(count)) == 0
    return count.value if answers else 0


def graphics_card() -> GraphicsCard | None:
    """Return the first NVIDIA card this process may use; None without a driver.

    Raises DeviceError: there is a driver, and it reports a fault.
    """
    try:
        with _management_library():
            handle = _first_visible_card()
            memory = pynvml.nvmlDeviceGetMemoryInfo(handle)
            return GraphicsCard(
                pynvml.nvmlDeviceGetName(handle),
                pynvml.nvmlSystemGetDriverVersion(),
                Memory(memory.free, memory.total),
            )
    except (pynvml.NVMLError_LibraryNotFound, pynvml.NVMLError_DriverNotLoaded):
        return None
    except pynvml.NVMLError as fault:
        raise DeviceError(f"the NVIDIA driver reports: {fault}") from fault


def _first_visible_card() -> object:
    """Return NVML's handle of CUDA device 0, which follows CUDA_VISIBLE_DEVICES, unlike NVML.

    Without that variable CUDA puts the fastest card first and NVML the lowest slot: on a machine
    with different cards the two may differ.
    """
    visible = os.environ.get("CUDA_VISIBLE_DEVICES", "").split(",")[0].strip() or "0"
    if visible.isdecimal():
        return pynvml.nvmlDeviceGetHandleByIndex(int(visible))
    return pynvml.nvmlDeviceGetHandleByUUID(visible)


@contextmanager
def _management_library() -> Iterator[None]:
    """Open NVML, NVIDIA's management library, for the block."""
    pynvml.nvmlInit()
    try:
        yield
    finally:
        pynvml.nvmlShutdown()


def memory_of(device: str) -> ComputeDevice | None:
    """Return the hardware whose memory holds fields on "cpu" or "cuda", or None if unknown.

    It is None if the driver reports no memory, without NVML, permission or support; CUDA may work
    nevertheless.
    """
    if device == "cpu":
        return processor()
    try:
        return graphics_card()
    except DeviceError:
        return None
