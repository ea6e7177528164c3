import pytest

SMALLEST = """\
bodies:
  block:
    mesh: {generator: block, length: 10 mm, height: 5 mm, element_size: 1 mm}
    formulation: plane_strain
    thickness: 10 mm
    material: dragon_skin_10
time:
  end: 24 s
"""


@pytest.fixture
def smallest():
    """The text of a valid scene with no more than it needs."""
    return SMALLEST


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Write scene files into a folder and work there, so that messages name them alone."""
    monkeypatch.chdir(tmp_path)

    def write_files(**texts):
        for name, text in texts.items():
            path = tmp_path / f"{name}.yaml"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return f"{next(iter(texts))}.yaml"

    return write_files
