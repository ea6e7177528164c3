"""Prints the bandwidth of the GPU's memory [bytes/s]: `python -m benchmarks.gpu_bandwidth`."""

import time

import numpy as np
import taichi as ti

from softsim.compute import backend

NUMBERS = 1 << 27  # far beyond any cache: 1 GiB read, 1 GiB written
REPEATS = 20


@ti.data_oriented
class Copy:
    """Two arrays on the device."""

    def __init__(self) -> None:
        self.source = ti.field(ti.f64, shape=NUMBERS)
        self.target = ti.field(ti.f64, shape=NUMBERS)

    @ti.kernel
    def copy(self):
        for i in self.source:
            self.target[i] = self.source[i]


def main() -> None:
    """Copy, and say how fast."""
    backend.start("cuda")
    arrays = Copy()
    arrays.copy()
    ti.sync()
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        arrays.copy()
        ti.sync()
        seconds.append(time.perf_counter() - start)
    print(2 * 8 * NUMBERS / float(np.min(seconds)))


if __name__ == "__main__":
    main()
