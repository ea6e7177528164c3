"""What this machine has, and what a run may take of it."""

import io

import pynvml
import pytest
from rich.console import Console

from softsim.compute.machine import (
    AUTO,
    CORNERS_FOR_GPU,
    CORNERS_FOR_THREADS,
    Choice,
    asked_threads,
    choose,
    cuda_device_count,
    graphics_card,
    memory_of,
    processor,
    processor_count,
)
from softsim.errors import DeviceError


@pytest.mark.parametrize("asked", ["0", "-1", "two", "1.5", 0])
def test_threads_that_are_no_number_of_workers_are_refused(asked):
    with pytest.raises(DeviceError, match=f"--threads {asked}") as caught:
        asked_threads(asked)
    assert f"1 to {processor_count()} on this machine" in caught.value.hint


def test_more_threads_than_processors_are_refused_with_what_fits():
    there = processor_count()
    with pytest.raises(DeviceError) as caught:
        asked_threads(there + 1)
    assert f"use --threads {there} or less" in caught.value.hint
    assert asked_threads(str(there)) == there


def test_several_threads_on_the_gpu_are_refused():
    with pytest.raises(DeviceError, match="uses the GPU") as caught:
        Choice("cuda", 2)
    assert "--device cpu --threads 2" in caught.value.hint
    assert Choice("cuda", 1).threads_for(10**6) == 1


def test_auto_takes_every_processor_for_a_large_model_only():
    choice = choose("cpu", "auto")
    assert choice.threads_for(CORNERS_FOR_THREADS - 1) == 1
    assert choice.threads_for(CORNERS_FOR_THREADS) == processor_count()
    assert choose("cpu", 1).threads_for(10**6) == 1
    assert Choice("cuda", None).threads_for(10**6) == 1


def test_auto_takes_a_card_for_a_large_model_only():
    """And never where several threads are asked for, which count processors."""
    open_choice = Choice(AUTO, None)
    assert open_choice.device_for(CORNERS_FOR_GPU - 1) == "cpu"
    assert open_choice.device_for(CORNERS_FOR_GPU) == "cuda"
    assert open_choice.threads_for(CORNERS_FOR_THREADS) == 1
    assert Choice(AUTO, 2).device_for(CORNERS_FOR_GPU) == "cpu"
    assert open_choice.allows("cpu") and open_choice.allows("cuda")
    assert not Choice("cpu", None).allows("cuda")
    assert choose("auto").device == (AUTO if cuda_device_count() else "cpu")


def test_a_missing_gpu_is_refused_with_what_there_is():
    if cuda_device_count():
        pytest.skip("this machine has a CUDA device")
    with pytest.raises(DeviceError, match="no CUDA device was found") as caught:
        choose("cuda")
    assert processor().name in caught.value.hint
    assert choose("auto").device == "cpu"


def test_a_machine_without_a_driver_has_no_graphics_card():
    if cuda_device_count():
        pytest.skip("this machine has a CUDA device")
    assert graphics_card() is None


def test_the_processor_has_a_name_and_memory():
    cpu = processor()
    assert cpu.name
    assert cpu.cores >= 1
    assert 0 < cpu.memory.free <= cpu.memory.total


FAULTS = {
    "not supported": pynvml.NVML_ERROR_NOT_SUPPORTED,
    "no permission": pynvml.NVML_ERROR_NO_PERMISSION,
    "not found": pynvml.NVML_ERROR_NOT_FOUND,
}


@pytest.fixture(params=list(FAULTS))
def faulty_driver(request, monkeypatch):
    """A driver that opens and then answers every question about a card with a fault."""
    fault = pynvml.NVMLError(FAULTS[request.param])

    def refuse(*_):
        raise fault

    for name in ("nvmlInit", "nvmlShutdown"):
        monkeypatch.setattr(pynvml, name, lambda: None)
    for name in ("nvmlDeviceGetHandleByIndex", "nvmlDeviceGetHandleByUUID"):
        monkeypatch.setattr(pynvml, name, lambda _: object())
    monkeypatch.setattr(pynvml, "nvmlDeviceGetMemoryInfo", refuse)
    return str(fault)


def test_memory_that_the_driver_does_not_tell_is_unknown(faulty_driver):
    assert memory_of("cuda") is None


def test_devices_shows_what_the_driver_reports(faulty_driver, monkeypatch):
    from softsim.cli import about

    monkeypatch.setattr(about, "cuda_device_count", lambda: 1)
    console = Console(file=io.StringIO(), width=200)
    about.print_devices(console, 0.0)
    said = console.file.getvalue()
    assert f"the NVIDIA driver reports: {faulty_driver}" in said
    assert "the driver reports no name" in said
