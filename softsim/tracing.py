"""Caching of Taichi's source look-ups, which take over a third of the time until kernels run.

For every call in a kernel Taichi looks up the source of the function again and formats its lines,
which do not change while a process runs. For every expression it formats the source line for
possible error messages: here only once there is an error. For every field it formats the whole call
stack, for an error message if the field is used before it has memory; all fields are allocated in
one place, so that message is not needed. The names changed here are private to Taichi 1.7.4, the
only version this package works with.
"""

import ast
import sys
import textwrap
from functools import cache
from types import SimpleNamespace

from taichi.lang import impl, kernel_impl, snode
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext


def remember_sources() -> None:
    """Make Taichi look up each source once per process and format source lines only for errors."""
    impl.get_traceback = snode.get_traceback = no_traceback
    kernel_impl.getsourcefile = cache(kernel_impl.getsourcefile)
    kernel_impl.getsourcelines = cache(kernel_impl.getsourcelines)
    kernel_impl.textwrap = SimpleNamespace(fill=cache(textwrap.fill), dedent=cache(textwrap.dedent))
    draw = ASTTransformerContext.get_pos_info

    def position(context: ASTTransformerContext, node: ast.expr | ast.stmt) -> str:
        is_for_an_error = sys.exc_info()[0] is not None
        return draw(context, node) if is_for_an_error else ""

    ASTTransformerContext.get_pos_info = position


def no_traceback(stacklevel: int = 1) -> str:
    """Return an empty text in place of the call stack of a field's creation."""
    return ""
