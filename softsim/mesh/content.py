"""Content of a mesh file of any format, as the readers return it, not yet checked."""

import io
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softsim.errors import MeshError
from softsim.mesh.quality import Labels

if TYPE_CHECKING:
    import meshio


@dataclass(frozen=True)
class Content:
    """Nodes, cells and sets as a file has them.

    points: (n, 2) or (n, 3) in the file's unit of length.
    cells: (m, corners) node numbers from 0 on, as in mesh/mesh.py; some may be inverted.
    dimension: of the cells, 2 or 3.
    node_sets, cell_sets: name -> (k,) numbers.
    facet_sets: name -> (k, 2 to 4) node numbers, in any orientation.
    element_type: ABAQUS's type of the first cell, "" where the file has none.
    labels: labels of nodes and cells in the file, None where it has none.
    reference_nodes: numbers of the nodes that the file declares not to belong to the body, such as
        reference points of an assembly; all others must belong to a cell.
    midside_nodes: numbers of the nodes between the corners of second-order cells, which have been
        read as linear ones; those that are no corner of another cell are left out.
    not_read: keywords of the file that are skipped, with their names or the number of their
        lines: "*MATERIAL rubber", "*BOUNDARY (3 lines)".
    """

    points: np.ndarray
    cells: np.ndarray
    dimension: int
    node_sets: dict[str, np.ndarray] = field(default_factory=dict)
    facet_sets: dict[str, np.ndarray] = field(default_factory=dict)
    cell_sets: dict[str, np.ndarray] = field(default_factory=dict)
    element_type: str = ""
    labels: Labels | None = None
    reference_nodes: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    midside_nodes: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    not_read: tuple[str, ...] = ()


# -------------------------------------------------------------------------------------------------
# Reading of mesh files by meshio, of which this module is the only user.


def meshio_mesh(path: Path, formats: str) -> "meshio.Mesh":
    """Return the mesh in a file as a meshio object.

    formats: expected formats, for the hint. Raises MeshError if it cannot be read.
    """
    import meshio  # takes longer to import than the rest of this package

    said = io.StringIO()
    try:
        # Its STL reader takes ASCII for a count of triangles first, which overflows.
        with redirect_stdout(said), redirect_stderr(io.StringIO()), np.errstate(over="ignore"):
            return meshio.read(path)
    # meshio passes on whatever its parsers stumble over; when no parser is left it prints the
    # cause and exits.
    except (Exception, SystemExit) as fault:
        cause = said.getvalue().strip() or f"{type(fault).__name__}: {fault}"
        raise MeshError(
            f"{path}: cannot be read as a mesh ({cause})",
            hint=f"{formats}; otherwise the file is damaged",
        ) from fault
