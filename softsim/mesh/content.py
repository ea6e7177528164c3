"""Content of a mesh file of any format, as the readers return it, not yet checked."""

from dataclasses import dataclass, field

import numpy as np

from softsim.mesh.quality import Labels


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
