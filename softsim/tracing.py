"""Taichi's reading of Python sources, remembered or left out: more than a third of the time until
kernels run.

For every call in a kernel Taichi looks up the source of the function again and lays out its lines,
which stay the same while a process runs. For every expression it draws the line it stands in, in
case there is an error to point at: here only once there is one. For every field it draws the whole
stack of calls, in case the field is used before it has memory; all fields are made in one place,
which an error of that kind need not show. The names changed here are private to Taichi 1.7.4, the
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
    """Let Taichi look up each source once a process, and draw lines and stacks for errors only."""
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
    """What a field knows of the place where it was made: nothing."""
    return ""
