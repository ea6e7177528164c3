"""Notebooks of docs/: each runs from top to bottom, and holds what it says."""

import nbformat
import pytest
from nbclient import NotebookClient
from pages import ROOT

pytestmark = pytest.mark.slow

FOLDER = ROOT / "docs" / "tutorials"

HOLDS = {
    "control_loop": """
at_rest = [float(np.interp(t, time, history["tip_y"])) for t in (0.395, 0.8)]
assert np.allclose(at_rest, [-8e-3, -3e-3], atol=0.3e-3), at_rest
assert 2e3 < history["pressure"].max() < 5e3
assert set(deformed) == {"0.4 s", "0.8 s"} and len(figure.axes) == 3
""",
    "learning_to_crawl": """
assert np.mean(learned[0]) < 5.0 < 15.0 < np.mean(learned[-1]), np.mean(learned, axis=1)
assert distance > 10.0 and len(figure.axes) == 3, distance
""",
}
"""Name of a notebook -> what is true at its end."""


def test_each_notebook_says_what_holds_at_its_end():
    assert {path.stem for path in FOLDER.glob("*.ipynb")} == set(HOLDS)


@pytest.mark.parametrize("name", HOLDS)
def test_a_notebook_runs(name, kernel_cache, tmp_path, monkeypatch):
    monkeypatch.setenv("SOFTSIM_CACHE", kernel_cache)
    notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
    assert all(not cell.outputs for cell in notebook.cells if cell.cell_type == "code")
    notebook.cells.append(nbformat.v4.new_code_cell(HOLDS[name]))
    resources = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, timeout=900, resources=resources).execute()
    drawn = [o for cell in notebook.cells for o in cell.get("outputs", []) if "data" in o]
    assert any("image/png" in output.data for output in drawn)
