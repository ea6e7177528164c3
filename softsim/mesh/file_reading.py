"""Reading of mesh files by meshio, of which this module is the only user."""

import io
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from softsim.errors import MeshError

if TYPE_CHECKING:
    import meshio


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
