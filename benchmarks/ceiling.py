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

from softsim.elements.geometry import Region
from softsim.elements.hoop import Axisymmetric, RingSection
from softsim.elements.hourglass import (
    fibre_scales,
    hourglass_modes,
    plate_factors,
    warping_scales,
)
from softsim.elements.plane_elements import PlaneStrain
from softsim.errors import SoftsimError
from softsim.model import Model

SOURCE = Path(__file__).with_name("reference.cpp")
FLAGS = ("-O3", "-march=native", "-std=c++17", "-pthread", "-fno-math-errno", "-Wno-psabi")


class CeilingError(SoftsimError):
    """A run of the compiled program whose numbers are not to be used."""


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

    increment: time step [s]. Contact, loads and rigid bodies are left out: nodes tied to a rigid
    body are held. Raises ValueError for another law than Yeoh's, a revolved section, quadrilaterals
    in a ring section, or simplexes among them.
    """
    body = model.regions[0]
    geometry, material = body.geometry, body.material
    if len(material.law.constants) != 3 or isinstance(geometry, Axisymmetric):
        raise ValueError("the reference knows Yeoh's law in plane and ring sections and in space")
    if body.has_hourglass_modes and isinstance(geometry, RingSection):
        raise ValueError("the reference knows quadrilaterals in plane strain only")
    if body.has_hourglass_modes and body.pressure_points.shape[1] > 1:
        raise ValueError("the reference knows no simplexes among quadrilaterals or hexahedra")
    order = banded(body.cells, len(body.points))
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    cells = number[body.cells]
    cell_order = np.lexsort(np.sort(cells, axis=1).T[::-1])
    rings = geometry if isinstance(geometry, RingSection) else None
    thickness = geometry.thickness if isinstance(geometry, PlaneStrain | RingSection) else 1.0
    basis, tables = hourglass_tables(body)
    integers = [cells.shape[1], len(order), len(cells), len(material.branches), rings is not None]
    integers.append(tables.shape[1])
    constants = [material.bulk_modulus, *material.law.constants]
    mass = model.mass[body.nodes][:, None]
    inverse_mass = np.where(model.is_free[body.nodes], 1.0 / mass, 0.0)
    with path.open("wb") as file:
        np.array([model.dimension, *integers], dtype=np.int64).tofile(file)
        np.array([thickness, rings.sector if rings else 0.0, increment, *constants]).tofile(file)
        for branch in material.branches:
            np.array([branch.shear_modulus, branch.relaxation_time]).tofile(file)
        model.gravity.astype(float).tofile(file)
        for values in (
            body.points,
            model.points[body.nodes],
            model.velocity[body.nodes],
            inverse_mass,
        ):
            np.ascontiguousarray(values[order], dtype=float).tofile(file)
        pressure_order = cell_order if body.has_hourglass_modes else order
        viscosities(body, model.bulk_viscosity)[pressure_order].tofile(file)
        cells[cell_order].astype(np.int32).tofile(file)
        basis[cell_order].tofile(file)
        tables[cell_order].tofile(file)
        if rings:
            number[rings.opposite[order]].astype(np.int32).tofile(file)
            rings.is_ring[cell_order].astype(np.int32).tofile(file)
    return Problem(path, len(cells), order)


def banded(cells: np.ndarray, node_count: int) -> np.ndarray:
    """The nodes in an order in which neighbours are near (reverse Cuthill-McKee)."""
    corners = cells.shape[1]
    pairs = [(a, b) for a in range(corners) for b in range(corners) if a != b]
    rows = np.concatenate([cells[:, a] for a, _ in pairs])
    columns = np.concatenate([cells[:, b] for _, b in pairs])
    graph = coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(node_count, node_count))
    return reverse_cuthill_mckee(graph.tocsr(), symmetric_mode=True).astype(np.int64)


def viscosities(body: Region, b1: float) -> np.ndarray:
    """b1 rho c_d h_a [Pa s] of each pressure, as in softsim/elements/one_point.py."""
    return b1 * body.material.impedance * body.pressure_sizes


def hourglass_tables(body: Region) -> tuple[np.ndarray, np.ndarray]:
    """D_i (m, d, d) [m] of each element, and in a row what its modes have at rest beside, as in
    `Modes` of reference.cpp (softsim/elements/hourglass.py); empty of simplexes.
    """
    count = len(body.cells)
    if not body.has_hourglass_modes:
        return np.empty((count, 0)), np.empty((count, 0))
    modes = hourglass_modes(body)
    columns = [body.volumes / np.linalg.det(modes.basis), modes.lean, modes.share]
    if body.points.shape[1] == 2:
        columns.append(fibre_scales(modes))
    else:
        plates = np.stack([plate_factors(modes, k) for k in range(3)], axis=1)
        columns.append(np.linalg.norm(modes.basis, axis=2))
        columns.append(plates[:, :, [0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]])
        columns.append(warping_scales(modes))
    return modes.basis, np.column_stack([column.reshape(count, -1) for column in columns])


class Ceiling:
    """Runs of one problem by the compiled program."""

    def __init__(self, program: Path, problem: Problem, threads: int) -> None:
        self.program, self.problem, self.threads = program, problem, threads

    def started(self, increments: int, repeats: int, *more: str) -> "subprocess.Popen[str]":
        """A run that goes on beside this process."""
        arguments = [str(self.problem.path), str(self.threads), str(increments), str(repeats)]
        return subprocess.Popen(
            [str(self.program), *arguments, *more],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip

    def increments_for(self, seconds: float) -> int:
        """About so many increments take so long."""
        trial = max(1, 200_000 // self.problem.element_count)
        rate = finished(self.started(trial, 3))["best"]
        return max(1, int(seconds * rate / self.problem.element_count))

    def outcome(self, increments: int, path: Path) -> tuple[np.ndarray, dict[str, float]]:
        """x (n, d) [m] after so many increments, nodes numbered as in the model, and what the run
        printed; its positions are written to `path`.
        """
        printed = finished(self.started(increments, 1, str(path)))
        written = np.fromfile(path).reshape(len(self.problem.order), -1)
        x = np.empty_like(written)
        x[self.problem.order] = written
        return x, printed


def finished(process: "subprocess.Popen[str]") -> dict[str, float]:
    """What a run printed: best and median rate [element updates/s], energies [J].

    Raises CeilingError if it failed, or if its energies are not finite.
    """
    output, complaint = process.communicate()
    if process.returncode:
        reason = complaint.strip() or f"exit code {process.returncode}"
        raise CeilingError(f"the compiled reference is refused: {reason}")
    return json.loads(output)
