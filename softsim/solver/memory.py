"""Whether a model fits the memory of the place where it is to run."""

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
    """Bytes of all fields of a model's terms, of which none gets memory.

    It takes the time in which terms are made, half a second for 30,000 tetrahedra, and the lanes of
    a backend that has been started.
    """
    with fields.counted(scenarios) as made:
        Terms([model] * scenarios)
    return made.size


def refuse_before_start(model: Model, device: str) -> None:
    """Refuse a model that does not fit the free memory of a device ("cpu" or "cuda"), before
    anything of an earlier run is touched. Raises DeviceError saying how many elements would fit.
    """
    place = memory_of(device)
    if place is None or BESIDE[device][0] + PLENTY * model.element_count <= place.memory.free:
        return
    backend.start(device)
    refuse_too_large(model, field_bytes(model, scenarios=1), device, place)


def refuse_too_large(model: Model, size: int, device: str, place: Place | None) -> None:
    """Refuse a model whose fields of `size` bytes do not fit the free memory of a place.

    device: "cpu" or "cuda". place: its memory, None where nobody tells; then nothing is refused.

    Raises DeviceError saying how many elements would fit.
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
    """How many scenarios of a model fit the free memory of the place where they are to run; None
    where nobody tells (place: None).
    """
    if place is None:
        return None
    one, two = (field_bytes(model, scenarios) for scenarios in (1, 2))
    each, (fixed, an_element) = two - one, BESIDE[device]
    left = place.memory.free - fixed - an_element * model.element_count - (one - each)
    return max(0, int(left // each))


def _gigabytes(size: float) -> str:
    return f"{size / 1e9:.3g} GB"
