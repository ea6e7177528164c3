"""Taichi's reading of Python sources, remembered: a third of the time until kernels run.

For every call in a kernel Taichi looks up the source of the function again, and for every
expression it draws the line it stands in, in case there is an error to point at. Both stay the same
while a process runs. The names changed here are private to Taichi 1.7.4, the only version this
package works with.
"""

import ast
from functools import cache

from taichi.lang import kernel_impl
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext


def remember_sources() -> None:
    """Let Taichi look up each source, and draw each line, once a process."""
    kernel_impl.getsourcefile = cache(kernel_impl.getsourcefile)
    kernel_impl.getsourcelines = cache(kernel_impl.getsourcelines)
    draw = ASTTransformerContext.get_pos_info
    drawn: dict[tuple, str] = {}

    def position(context: ASTTransformerContext, node: ast.expr | ast.stmt) -> str:
        place = (context.file, context.lineno_offset, type(node), node.lineno, node.col_offset)
        key = (*place, node.end_lineno, node.end_col_offset)
        if key not in drawn:
            drawn[key] = draw(context, node)
        return drawn[key]

    ASTTransformerContext.get_pos_info = position
