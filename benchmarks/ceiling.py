"""The ceiling: what hand-written C++ does with the bare increment of the same mesh.

reference.cpp is compiled with the C++ compiler that is there ($CXX, c++, g++, clang++) for the
processor it runs on.
"""

import json
import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from softsim.elements.geometry import nodal_sums
from softsim.elements.plane_strain import PlaneStrain
from softsim.elements.region import Region
from softsim.model import Model

SOURCE = Path(__file__).with_name("reference.cpp")
FLAGS = ("-O3", "-march=native", "-std=c++17", "-pthread")


def compiler() -> str | None:
    """The C++ compiler to use, or None."""
    candidates = [os.environ.get("CXX"), "c++", "g++", "clang++"]
    return next((c for c in candidates if c and shutil.which(c)), None)


def compiled(folder: Path) -> Path | None:
    """The program, built in `folder`; None where there is no compiler."""
    found = compiler()
    if found is None:
        return None
    program = folder / "reference"
    subprocess.run([found, *FLAGS, str(SOURCE), "-o", str(program)], check=True)
    return program


@dataclass(frozen=True)
class Problem:
    """A written input file. order: number in the model of each node in the file."""

    path: Path
    element_count: int
    order: np.ndarray


def write_problem(path: Path, model: Model, increment: float) -> Problem:
    """Write the first region of `model` for the program, nodes numbered for a narrow band.

    increment: time step [s]. Maxwell branches, contact, loads and rigid bodies are left out: nodes
    tied to a rigid body are held. Raises ValueError for another law than Yeoh's, or rings.
    """
    body = model.regions[0]
    constants = body.material.law.constants
    if len(constants) != 3 or body.geometry.name == "axisymmetric":
        raise ValueError("the reference knows Yeoh's law in plane strain and in space only")
    order = banded(body.cells, len(body.points))
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    cells = number[body.cells]
    cells = cells[np.lexsort(np.sort(cells, axis=1).T[::-1])]
    mass = model.mass[body.nodes][:, None]
    inverse_mass = np.where(model.is_free[body.nodes], 1.0 / mass, 0.0)
    thickness = body.geometry.thickness if isinstance(body.geometry, PlaneStrain) else 1.0
    with path.open("wb") as file:
        np.array([model.dimension, len(order), len(cells)], dtype=np.int64).tofile(file)
        np.array([thickness, increment, body.material.bulk_modulus, *constants]).tofile(file)
        model.gravity.astype(float).tofile(file)
        for values in (
            body.points,
            model.points[body.nodes],
            model.velocity[body.nodes],
            inverse_mass,
            nodal_viscosity(body, model.bulk_viscosity),
        ):
            np.ascontiguousarray(values[order], dtype=float).tofile(file)
        np.ascontiguousarray(cells, dtype=np.int32).tofile(file)
    return Problem(path, len(cells), order)


def banded(cells: np.ndarray, node_count: int) -> np.ndarray:
    """The nodes in an order in which neighbours are near (reverse Cuthill-McKee)."""
    corners = cells.shape[1]
    pairs = [(a, b) for a in range(corners) for b in range(corners) if a != b]
    rows = np.concatenate([cells[:, a] for a, _ in pairs])
    columns = np.concatenate([cells[:, b] for _, b in pairs])
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(node_count, node_count))
    return reverse_cuthill_mckee(graph.tocsr(), symmetric_mode=True).astype(np.int64)


def nodal_viscosity(body: Region, b1: float) -> np.ndarray:
    """b1 rho c_d h_a (n,) [Pa s], h_a as in softsim/elements/linear.py."""
    material, dimension = body.material, body.geometry.dimension
    edges = body.points[body.cells[:, 1:]] - body.points[body.cells[:, :1]]
    measure = np.abs(np.linalg.det(edges)) / (2.0 if dimension == 2 else 6.0) / (dimension + 1)
    size = nodal_sums(body.cells, measure[:, None], len(body.points)) ** (1.0 / dimension)
    modulus = material.bulk_modulus + 4.0 / 3.0 * material.instantaneous_shear_modulus
    return b1 * material.density * np.sqrt(modulus / material.density) * size


class Ceiling:
    """Runs of one problem by the compiled program."""

    def __init__(self, program: Path, problem: Problem, threads: int) -> None:
        self.program, self.problem, self.threads = program, problem, threads

    def started(self, increments: int, repeats: int, *more: str) -> "subprocess.Popen[str]":
        """A run that goes on beside this process."""
        arguments = [str(self.problem.path), str(self.threads), str(increments), str(repeats)]
        return subprocess.Popen(
            [str(self.program), *arguments, *more], stdout=subprocess.PIPE, text=True
        )

    def increments_for(self, seconds: float) -> int:
        """About so many increments take so long."""
        trial = max(1, 200_000 // self.problem.element_count)
        rate = finished(self.started(trial, 3))["best"]
        return max(1, int(seconds * rate / self.problem.element_count))

    def positions(self, increments: int, path: Path) -> np.ndarray:
        """x (n, d) [m] after so many increments, nodes numbered as in the model."""
        finished(self.started(increments, 1, str(path)))
        written = np.fromfile(path).reshape(len(self.problem.order), -1)
        x = np.empty_like(written)
        x[self.problem.order] = written
        return x


def finished(process: "subprocess.Popen[str]") -> dict[str, float]:
    """What a run printed: best and median rate [element updates/s], energies.

    Raises CalledProcessError if it failed.
    """
    output, _ = process.communicate()
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, process.args)
    return json.loads(output)
