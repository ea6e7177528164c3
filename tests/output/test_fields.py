"""results.vtkhdf: the VTKHDF layout, frames that come back, killed and resumed runs."""

import subprocess
import sys
import time
from collections import namedtuple
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import pytest

from softsim.errors import OutputError
from softsim.output.fields import FieldWriter, Frame, read_frames

POINTS = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0], [1.0, 1.0], [2.0, 1.0]])
QUADS = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
TRIANGLES = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])


def frame(k: int) -> dict:
    return {
        "time": 0.1 * k,
        "point_data": {"displacement": k * POINTS, "pressure": np.full(6, 10.0 * k)},
        "cell_data": {"stretch": np.array([1.0, 2.0]) + k},
        "extra": {"frame_pose": np.full((1, 3), float(k))},
    }


def written(path: Path, count: int) -> FieldWriter:
    writer = FieldWriter(path, POINTS, QUADS)
    for k in range(count):
        writer.append(**frame(k))
    return writer


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "results.vtkhdf"


def test_a_truncated_file_is_told(path: Path) -> None:
    """Wherever it ends, on opening or on reading a frame."""
    written(path, 3)
    whole = path.read_bytes()
    for size in range(0, len(whole) - 1, len(whole) // 50):
        path.write_bytes(whole[:size])
        with pytest.raises(OutputError, match=r"results\.vtkhdf"):
            check_frames(path, 3)


def test_a_damaged_file_is_told_at_once(path: Path) -> None:
    """HDF5 would read a wrong checksum again and again, were it asked to expect a writer."""
    written(path, 3)
    whole = bytearray(path.read_bytes())
    starts = [at for at in range(512, len(whole) - 512, 512) if b"OHDR" in whole[at : at + 512]]
    for start in starts[:4]:
        path.write_bytes(whole[:start] + bytes(512) + whole[start + 512 :])
        began = time.monotonic()
        with pytest.raises(OutputError, match="it is damaged"):
            check_frames(path, 3)
        assert time.monotonic() - began < 5.0


def check_frames(path: Path, count: int) -> None:
    frames = read_frames(path)
    assert len(frames) == count
    for k in range(count):
        expected = frame(k)
        assert frames.times[k] == expected["time"]
        np.testing.assert_array_equal(
            frames.point_data["displacement"][k], np.column_stack([k * POINTS, np.zeros(6)])
        )
        np.testing.assert_array_equal(
            frames.point_data["pressure"][k], expected["point_data"]["pressure"]
        )
        np.testing.assert_array_equal(
            frames.cell_data["stretch"][k], expected["cell_data"]["stretch"]
        )
        np.testing.assert_array_equal(
            frames.extra["frame_pose"][k], expected["extra"]["frame_pose"]
        )


def test_frames_come_back_as_they_went(path: Path) -> None:
    written(path, 4)
    check_frames(path, 4)
    frames = read_frames(path)
    np.testing.assert_array_equal(frames.points, POINTS)
    np.testing.assert_array_equal(frames.cells, QUADS)
    np.testing.assert_array_equal(frames.cell_data["stretch"][-1], frames.cell_data["stretch"][3])
    assert len(list(frames.extra["frame_pose"])) == 4
    with pytest.raises(IndexError):
        frames.point_data["pressure"][4]


def test_frames_written_together_make_the_file_of_single_ones(path: Path, tmp_path: Path) -> None:
    written(path, 5)
    other = FieldWriter(tmp_path / "together.vtkhdf", POINTS, QUADS)
    for numbers in ((0,), (1, 2, 3), (4,)):
        other.extend([Frame(**frame(k)) for k in numbers])
    assert (other.frame_count, other.last_time) == (5, frame(4)["time"])
    with h5py.File(path) as one, h5py.File(other.path) as several:
        names: list[str] = []
        one.visititems(lambda name, found: names.append(name) if hasattr(found, "dtype") else None)
        assert "VTKHDF/Steps/PointDataOffsets/pressure" in names
        for name in names:
            np.testing.assert_array_equal(one[name], several[name], err_msg=name)
        assert several["VTKHDF/Steps"].attrs["NSteps"] == 5
    with pytest.raises(OutputError, match="does not come after"):
        other.extend([Frame(**frame(6)), Frame(**frame(5))])


@pytest.mark.parametrize(
    ("dimension", "cells", "vtk_type"),
    [
        (2, TRIANGLES, 5),
        (2, QUADS, 9),
        (3, TRIANGLES, 5),
        (3, QUADS, 10),
        (3, np.array([[0, 1, 2, 2, 3, 4, 5, 5]]), 12),
    ],
)
def test_the_file_is_laid_out_as_vtkhdf_says(path, dimension, cells, vtk_type) -> None:
    points = np.pad(POINTS, ((0, 0), (0, dimension - 2)))
    writer = FieldWriter(path, points, cells)
    for k in range(3):
        writer.append(k, {"displacement": points}, {"stretch": np.ones(len(cells))})
    with h5py.File(path) as file:
        root, steps = file["VTKHDF"], file["VTKHDF/Steps"]
        assert root.attrs["Type"] == b"UnstructuredGrid"
        assert root.attrs["Version"].tolist() == [2, 0]
        assert root["Points"].shape == (6, 3)
        assert root["NumberOfPoints"][:].tolist() == [6]
        assert root["NumberOfCells"][:].tolist() == [len(cells)]
        assert root["NumberOfConnectivityIds"][:].tolist() == [cells.size]
        assert root["Types"][:].tolist() == [vtk_type] * len(cells)
        offsets = root["Offsets"][:]
        assert [root["Connectivity"][a:b].tolist() for a, b in pairwise(offsets)] == cells.tolist()
        assert steps.attrs["NSteps"] == 3
        assert steps["Values"][:].tolist() == [0.0, 1.0, 2.0]
        assert steps["NumberOfParts"][:].tolist() == [1, 1, 1]
        for name, shape in {
            "PartOffsets": (3,), "PointOffsets": (3,),
            "CellOffsets": (3, 1), "ConnectivityIdOffsets": (3, 1),
        }.items():  # fmt: skip
            np.testing.assert_array_equal(steps[name][:], np.zeros(shape))
        assert steps["PointDataOffsets/displacement"][:].tolist() == [0, 6, 12]
        assert steps["CellDataOffsets/stretch"][:].tolist() == [0, len(cells), 2 * len(cells)]
        assert root["PointData/displacement"].shape == (18, 3)


def test_what_holds_for_the_whole_run_comes_back(path: Path) -> None:
    writer = FieldWriter(path, POINTS, QUADS)
    walls = np.array([[0.0, -1.0, 0.0, 1.0]])
    writer.describe(walls=walls, title="PFR in a pipe", sets={"knots": np.array([0, 3])})
    writer.append(**frame(0))
    writer.describe(walls=2 * walls)
    frames = read_frames(path)
    np.testing.assert_array_equal(frames.described["walls"], 2 * walls)
    assert frames.titles == {"title": "PFR in a pipe"}
    assert frames.sets["knots"].tolist() == [0, 3]
    check_frames(path, 1)


def test_a_file_without_a_frame_reads(path: Path) -> None:
    FieldWriter(path, POINTS, QUADS)
    frames = read_frames(path)
    assert len(frames) == 0 and not frames.point_data and not frames.titles


@pytest.mark.parametrize("kept", [0, 1, 3, 5])
def test_a_resumed_run_has_the_frames_of_an_uninterrupted_one(path: Path, kept: int) -> None:
    written(path, 5)
    writer = FieldWriter(path, POINTS, QUADS, frame(kept - 1)["time"])
    check_frames(path, kept)
    for k in range(kept, 7):
        writer.append(**frame(k))
    check_frames(path, 7)
    with h5py.File(path) as file:
        assert file["VTKHDF/Steps/Values"].shape == (7,)
        assert file["VTKHDF/PointData/pressure"].shape == (42,)


def test_frames_may_hold_nothing_but_their_times(path: Path) -> None:
    FieldWriter(path, POINTS, QUADS).append(0.0, {}, {})
    FieldWriter(path, POINTS, QUADS, 0.0).append(0.1, {}, {})
    assert read_frames(path).times.tolist() == [0.0, 0.1]
    with pytest.raises(OutputError, match="same arrays"):
        FieldWriter(path, POINTS, QUADS, 0.1).append(**frame(2))


def test_a_frame_read_while_the_run_goes_on(path: Path) -> None:
    writer = written(path, 2)
    frames = read_frames(path)
    writer.append(**frame(2))
    assert len(frames) == 2 and frames.extra["frame_pose"][1][0, 0] == 1.0
    check_frames(path, 3)


HOLD_OPEN = "import h5py, sys; f = h5py.File(sys.argv[1]); print(f, flush=True); sys.stdin.read()"


def test_a_program_that_has_the_file_open_does_not_stop_the_run(path: Path) -> None:
    writer = written(path, 1)
    with subprocess.Popen(
        [sys.executable, "-c", HOLD_OPEN, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as reader:
        assert reader.stdout is not None and reader.stdout.readline()
        writer.append(**frame(1))
        reader.communicate()
    check_frames(path, 2)


WRITE_UNTIL_KILLED = """
import sys
sys.path.insert(0, {tests!r})
from pathlib import Path
from test_fields import frame, written
writer = written(Path({path!r}), 1)
for k in range(1, 100_000):
    writer.append(**frame(k))
    print(k + 1, flush=True)
"""


@pytest.mark.parametrize("frames_before", [3, 20])
def test_a_killed_run_leaves_every_frame_it_finished(path: Path, frames_before: int) -> None:
    code = WRITE_UNTIL_KILLED.format(tests=str(Path(__file__).parent), path=str(path))
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as run:
        assert run.stdout is not None
        for _ in range(frames_before):
            finished = int(run.stdout.readline())
        run.kill()
        finished = int((run.stdout.read().split() or [finished])[-1])
    count = len(read_frames(path))
    assert count in (finished, finished + 1)
    check_frames(path, count)
    FieldWriter(path, POINTS, QUADS, frame(count - 1)["time"]).append(**frame(count))
    check_frames(path, count + 1)
    with h5py.File(path) as file:  # without single-writer mode, as ParaView opens it
        assert file["VTKHDF/Steps"].attrs["NSteps"] == count + 1


def test_a_full_disk_is_named_before_hdf5_meets_it(path: Path, monkeypatch) -> None:
    writer = written(path, 2)
    usage = namedtuple("usage", "total used free")(2**30, 2**30 - 5, 5)
    with monkeypatch.context() as disk:
        disk.setattr("shutil.disk_usage", lambda _: usage)
        with pytest.raises(OutputError, match=r"results\.vtkhdf: it needs .*its disk has 0\.0 MiB"):
            writer.append(**frame(2))
    check_frames(path, 2)
    writer.append(**frame(2))
    check_frames(path, 3)


def test_time_does_not_stand_still(path: Path) -> None:
    writer = written(path, 2)
    with pytest.raises(OutputError, match=r"0\.1 s does not come after the last one, at 0\.1 s"):
        writer.append(**frame(1))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"cell_data": {}}, r"has \['stretch'\], this frame \[\]"),
        ({"extra": None}, r"softsim/frames has \['frame_pose'\], this frame \[\]"),
        ({"cell_data": {"stretch": np.ones(3)}}, r"the shape \(3,\), expected \(2,\)"),
        ({"extra": {"frame_pose": np.ones((2, 3))}}, r"expected \(1, 1, 3\)"),
    ],
)
def test_a_frame_unlike_the_first_is_refused(path: Path, change: dict, said: str) -> None:
    writer = written(path, 2)
    with pytest.raises(OutputError, match=said):
        writer.append(**{**frame(2), **change})
    check_frames(path, 2)


def test_a_first_frame_that_does_not_fit_the_mesh_is_refused(path: Path) -> None:
    writer = FieldWriter(path, POINTS, QUADS)
    with pytest.raises(OutputError, match=r"pressure has the shape \(5,\), expected \(6,\)"):
        writer.append(0.0, {"pressure": np.ones(5)}, {})
    writer.append(**frame(0))
    check_frames(path, 1)


@pytest.mark.parametrize(
    ("points", "cells"),
    [
        (POINTS[:, :1], QUADS),
        (POINTS, QUADS[:, :2]),
        (POINTS, QUADS[0]),
        (POINTS, QUADS[:, [0] * 8]),
    ],
)
def test_what_is_no_mesh_is_refused(path: Path, points, cells) -> None:
    with pytest.raises(OutputError, match="are not a mesh"):
        FieldWriter(path, points, cells)


def test_a_file_that_is_not_there_or_another_is_named(path: Path) -> None:
    with pytest.raises(OutputError, match=r"there is no .*results\.vtkhdf"):
        read_frames(path)
    path.write_text("something else")
    with pytest.raises(OutputError, match=r"cannot read .*results\.vtkhdf"):
        read_frames(path)
    h5py.File(path, "w").close()
    with pytest.raises(OutputError, match="is not a result file of softsim"):
        FieldWriter(path, POINTS, QUADS, 0.0)
