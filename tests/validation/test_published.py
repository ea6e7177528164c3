"""Scripts on published measurements: their page, their columns, and the skip without data."""

import io
import json
from dataclasses import replace

import pytest
from rich.console import Console

from validation.command import validate
from validation.published.__main__ import SCRIPTS
from validation.script import PUBLISHED, Script
from validation.verdicts import AGREES, DISAGREES, Row

ROWS = [
    Row("strip", "height", "20 mm", "21 mm", AGREES, error="5 %", band="10 %"),
    Row("strip", "width", "20 mm", "30 mm", DISAGREES, error="50 %", band="10 %"),
]
STRIP = Script(
    name="strip",
    figure="Somebody 1950",
    about="First paragraph.\n\nSecond paragraph.",
    cases=lambda quick: [],
    rows=lambda outcomes, points: ROWS,
    draw=lambda outcomes, points, path: path.write_bytes(b"picture"),
    columns=(),
    evidence=PUBLISHED,
)


def pages_of(scripts, folder):
    console = Console(file=io.StringIO(), width=200)
    everything = validate(scripts, False, 1, folder, None, console)
    return everything, console.file.getvalue()


def test_each_evidence_has_its_page(tmp_path):
    thesis = replace(STRIP, name="thesis_strip", evidence=Script.evidence)
    everything, shown = pages_of([STRIP, thesis], tmp_path)
    published = (tmp_path / "published.html").read_text()
    for text in (*PUBLISHED.columns, "5 %", "50 %", "Somebody 1950"):
        assert text in published and text in shown
    assert "<p>Second paragraph.</p>" in published
    assert "python -m validation.published.strip" in published
    assert "thesis_strip" not in published and "Constants" not in published
    index = (tmp_path / "index.html").read_text()
    assert "thesis_strip" in index and "Constants" in index and "50 %" not in index
    stored = json.loads((tmp_path / "validation.json").read_text())
    assert stored == everything
    assert [row["band"] for row in stored["rows"]] == 4 * ["10 %"]
    assert stored["scripts"]["strip"]["evidence"] == "published data"


def test_script_without_its_data_is_skipped(tmp_path):
    absent = tmp_path / "absent"
    everything, shown = pages_of([replace(STRIP, data=absent)], tmp_path / "out")
    sentence = f"strip: skipped, because the folder of its data is absent: {absent}"
    assert everything["skipped"] == [sentence] and everything["rows"] == []
    assert "skipped, because" in shown
    assert not (tmp_path / "out" / "published.html").exists()


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.name)
def test_script_states_its_protocol(script):
    assert script.evidence is PUBLISHED
    assert "Protocol" in script.about and "Band" in script.about
