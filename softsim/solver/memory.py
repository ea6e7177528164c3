"""Check that a model fits the free memory of the device that runs it."""

from softsim import backend, fields
from softsim.errors import DeviceError
from softsim.machine import Place, memory_of
from softsim.model import Model
from softsim.solver.terms import Terms

# What a process takes beside its fields: bytes, and bytes an element. CPU: Python, Taichi and
# compiled kernels; working arrays of the start, the guards and frames (both measured, the second at
# 208,000 triangles). CUDA: a context of some 0.5 GB and Taichi's own pool of 1 GiB (its
# device_memory_GB); working arrays live in the CPU's memory.
BESIDE = {"cpu": (300e6, 1000.0), "cuda": (1.6e9, 0.0)}

# More than any element takes [bytes]: what fits with this needs no count, which takes a second.
PLENTY = 20_000.0


def field_bytes(model: Model, scenarios: int) -> int:
    """Return the size [bytes] of all fields of a model's terms, without allocating them.

    The terms are built for this, which takes half a second for 30,000 tetrahedra; the result
    depends on the lanes of the backend, which must have been started.
    """
    with fields.counted(scenarios) as made:
        Terms([model] * scenarios)
    return made.size


def refuse_before_start(model: Model, device: str) -> None:
    """Raise DeviceError if a model does not fit the free memory of a device ("cpu" or "cuda").

    Called before files of an earlier run are changed. The error gives the number of elements that
    would fit.
    """
    place = memory_of(device)
    if place is None or BESIDE[device][0] + PLENTY * model.element_count <= place.memory.free:
        return
    backend.start(device)
    refuse_too_large(model, field_bytes(model, scenarios=1), device, place)


def refuse_too_large(model: Model, size: int, device: str, place: Place | None) -> None:
    """Raise DeviceError if the fields of a model, of `size` bytes, do not fit the free memory.

    device: "cpu" or "cuda". place: its memory, None if unknown; then nothing is raised. The error
    gives the number of elements that would fit.
    """
    if place is None:
        return
    free, (fixed, an_element) = place.memory.free, BESIDE[device]
    growing = an_element * model.element_count + size
    need = fixed + growing
    if need <= free:
        return
    elements = int(model.element_count * max(0.0, free - fixed) / growing)
    way_out = f"at most {elements:,} elements of this kind" if elements else "free some memory"
    if device == "cuda":
        way_out += ", or --device cpu"
    raise DeviceError(
        f"{model.element_count:,} elements need {_gigabytes(need)}; {_gigabytes(free)} are free "
        f"on {place.name}",
        hint=way_out,
    )


def scenarios_that_fit(model: Model, device: str, place: Place | None) -> int | None:
    """Return the number of scenarios of a model that fit the free memory of a device.

    None if the memory is unknown (place: None).
    """
    if place is None:
        return None
    one, two = (field_bytes(model, scenarios) for scenarios in (1, 2))
    each, (fixed, an_element) = two - one, BESIDE[device]
    left = place.memory.free - fixed - an_element * model.element_count - (one - each)
    return max(0, int(left // each))


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"
