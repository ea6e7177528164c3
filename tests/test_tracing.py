"""Errors in kernels still point at their own line, though no other line is drawn."""

import inspect

import pytest
import taichi as ti


@ti.func
def wrong(x):
    double = 2.0 * x
    return double + nowhere  # noqa: F821 - the error that the test looks for


def test_an_error_names_its_function_and_line(fresh_taichi):
    @ti.kernel
    def evaluate() -> ti.f64:
        return wrong(1.0)

    with pytest.raises(ti.TaichiCompilationError) as error:
        evaluate()
    lines, first = inspect.getsourcelines(inspect.unwrap(wrong))
    offset = next(k for k, line in enumerate(lines) if "nowhere" in line)
    assert f"line {first + offset}, in wrong" in str(error.value)
    assert "^^^^^^^" in str(error.value)
