"""Taichi beside its public interface: everything that softsim uses of it.

Only Taichi 1.7.4 is known to have these names and to behave as described. `internal` raises an
error that says so where a name is missing; tests/compute/test_taichi_internals.py shows the
behaviour that no name tells.
"""

import ast
import contextlib
import sys
import textwrap
import time
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import taichi as ti
from taichi.lang import impl, kernel_impl, snode
from taichi.lang.ast import ast_transformer_utils

from softsim.errors import DeviceError

VERSION = "1.7.4"


def internal(owner: Any, name: str) -> Any:
    """Return a private attribute of Taichi.

    Raises
    ------
    DeviceError: this Taichi has none of this name.
    """
    try:
        return getattr(owner, name)
    except AttributeError:
        kind = getattr(owner, "__name__", type(owner).__name__)
        installed = ".".join(map(str, ti.__version__))
        raise DeviceError(
            f"Taichi {installed} has no '{name}' in '{kind}', which softsim needs",
            hint=f"install the version that softsim was written for: pip install taichi=={VERSION}",
        ) from None


# -------------------------------------------------------------------------------------------------
# Caching of Taichi's source look-ups, which take over a third of the time until kernels run.
#
# For every call in a kernel Taichi looks up the source of the function again and formats its lines,
# which do not change while a process runs. For every expression it formats the source line for
# possible error messages: here only once there is an error. For every field it formats the whole
# call stack, for an error message if the field is used before it has memory; all fields are
# allocated in one place, so that message is not needed.


def remember_sources() -> None:
    """Make Taichi look up each source once per process and format source lines only for errors."""
    replace(impl, "get_traceback", no_traceback)
    replace(snode, "get_traceback", no_traceback)
    for name in ("getsourcefile", "getsourcelines"):
        replace(kernel_impl, name, cache(internal(kernel_impl, name)))
    wrapping = SimpleNamespace(fill=cache(textwrap.fill), dedent=cache(textwrap.dedent))
    replace(kernel_impl, "textwrap", wrapping)
    context_class = internal(ast_transformer_utils, "ASTTransformerContext")
    draw = internal(context_class, "get_pos_info")

    def position(context: Any, node: ast.expr | ast.stmt) -> str:
        is_for_an_error = sys.exc_info()[0] is not None
        return draw(context, node) if is_for_an_error else ""

    replace(context_class, "get_pos_info", position)


def replace(owner: Any, name: str, value: Any) -> None:
    """Replace an attribute that Taichi has; raises as `internal`."""
    internal(owner, name)
    setattr(owner, name, value)


def no_traceback(stacklevel: int = 1) -> str:
    """Return an empty text in place of the call stack of a field's creation."""
    return ""


remember_sources()

# -------------------------------------------------------------------------------------------------
# Launch of a kernel that is called for every row of the history.


class Launch:
    """Kernel of an object, compiled for its arguments: integers and arrays of real numbers.

    In each call of a kernel Taichi looks at the types of all arguments, and asks for the compiled
    kernel by its name. That takes 90 us, as long as the energies of 1,400 elements. Here it is done
    once. The kernel must not return anything.
    """

    def __init__(self, kernel: Any, *arguments: int | np.ndarray) -> None:
        """Compile a kernel, or load it from the cache, without a call."""
        source, owner = internal(kernel, "_primal"), internal(kernel, "_kernel_owner")
        key = internal(source, "ensure_compiled")(owner, *arguments)
        self._kernel = internal(source, "compiled_kernels")[key]
        self._program = program = impl.get_runtime().prog
        self._run = internal(program, "launch_kernel")
        self._compiled = internal(program, "compile_kernel")(
            program.config(), internal(program, "get_device_caps")(), self._kernel
        )

    def __call__(self, *arguments: int | np.ndarray) -> None:
        """Call the kernel; arguments have the types of those for which it was compiled."""
        if self._program is not impl.get_runtime().prog:
            raise DeviceError(
                "this kernel no longer exists: Taichi was started again after it was compiled",
                hint="use one solver per process at a time",
            )
        context = self._kernel.make_launch_context()
        for k, argument in enumerate(arguments):
            if isinstance(argument, np.ndarray):
                address, _ = argument.__array_interface__["data"]
                context.set_arg_external_array_with_shape(
                    (k,), address, argument.nbytes, argument.shape, 0
                )
            else:
                context.set_arg_int((k,), argument)
        self._run(self._compiled, context)


# -------------------------------------------------------------------------------------------------
# Memory of fields, and files of compiled kernels.


def offset_in_block(field: ti.Field) -> int:
    """Return the offset [bytes] of a field in the block of memory that it shares with others."""
    return int(internal(field.parent(), "_offset_bytes_in_parent_cell"))


def remove_stale_lock(folder: Path) -> None:
    """Remove Taichi's `ticache.lock` left by a killed process.

    While a process that wrote it lives, the lock is held for well under a minute; an older one has
    no owner, and every later run would skip the cache without a warning.
    """
    for lock in folder.rglob("ticache.lock"):
        with contextlib.suppress(FileNotFoundError):  # another run removed it just now
            if time.time() - lock.stat().st_mtime > 60:
                lock.unlink()


# -------------------------------------------------------------------------------------------------
# Barrier of the threads of a CPU within a kernel, which Taichi does not have.

# Looks at the others before a thread gives them up: more than ten seconds.
MOST_LOOKS = 500_000_000
# Taichi hands neighbouring indices of a parallel loop to a thread in shares of at least so many.
SHARE = 512


@ti.data_oriented
class Barrier:
    """Barrier at which threads of one kernel wait for each other.

    arrived, lost: fields of one integer: how often threads have arrived; 1 once one gave up.
    """

    def __init__(self, arrived: ti.Field, lost: ti.Field) -> None:
        self.arrived, self.lost = arrived, lost

    @ti.func
    def reset(self):
        """Prepare for the threads of a kernel, before they start."""
        self.arrived[0] = 0
        self.lost[0] = 0

    @ti.func
    def meet(self, met, workers, zero):
        """Wait for all workers, which have met `met` times before, and return met + 1.

        Each worker increments a counter and reads it until all workers have done so. Only an atomic
        operation reads it again each time, and only one that the compiler cannot simplify: it adds
        a `zero` that is not known before the run.
        """
        if workers > 1:
            ti.atomic_add(self.arrived[0], 1)
            looks = 0
            while ti.atomic_add(self.arrived[0], zero) < workers * (met + 1):
                looks += 1
                if looks > MOST_LOOKS or self.lost[0] == 1:
                    self.lost[0] = 1
                    break
        return met + 1
