"""A film of a run: its pictures, and what keeps it from being one."""

from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner

from softsim.cli import app
from softsim.errors import OutputError
from softsim.report.figures import draw_film, recorded


@pytest.mark.parametrize("run", ["strip_run", "box_run"])
def test_a_film_shows_frames_from_first_to_last(run: str, request, tmp_path: Path) -> None:
    path = tmp_path / "film.gif"
    kept = recorded(request.getfixturevalue(run))
    count = draw_film(kept, "stretch", 10, 3, path)
    with Image.open(path) as film:
        assert film.n_frames == count == min(3, len(kept.frames))
        assert film.info["duration"] == 100
        first = film.convert("RGB").tobytes()
        film.seek(count - 1)
        assert film.convert("RGB").tobytes() != first


def test_what_makes_no_film_is_told(strip_run: Path, tmp_path: Path) -> None:
    run = recorded(strip_run)
    with pytest.raises(OutputError, match="cannot colour"):
        draw_film(run, "heat", 10, 3, tmp_path / "film.gif")
    with pytest.raises(OutputError, match="no stored frames"):
        draw_film(type(run)(run.history, run.units, None, {}), "stretch", 10, 3, tmp_path / "f.gif")
    refused = CliRunner().invoke(app, ["render", str(strip_run), "--out", "film.avi"])
    assert refused.exit_code == 2 and "must end in .gif or .mp4" in refused.output
