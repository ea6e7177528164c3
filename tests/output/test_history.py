"""history.csv: bits survive, killed runs read, resumed runs leave the same file."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softsim.errors import OutputError
from softsim.output.history import History, read_history, read_units

UNITS = {"time": "s", "pressure": "Pa", "contact_count": "-"}


def row(i: int) -> dict[str, float]:
    return {"time": i * 0.1, "pressure": 1e3 / (i + 3), "contact_count": i}


def written(path: Path, count: int) -> bytes:
    history = History(path, UNITS)
    for i in range(count):
        history.append(row(i))
    history.close()
    return path.read_bytes()


def test_rows_together_are_the_rows_one_by_one(tmp_path):
    times, counts = np.array([0.1, 0.2, np.nan]), np.array([1, 2, 3])
    singly = History(tmp_path / "singly.csv", UNITS)
    for time, count in zip(times, counts, strict=True):
        singly.append({"time": time, "pressure": 5.0, "contact_count": count})
    together = History(tmp_path / "together.csv", UNITS)
    together.append({"time": times, "pressure": 5.0, "contact_count": counts})
    assert (tmp_path / "together.csv").read_text() == (tmp_path / "singly.csv").read_text()
    assert together.row_count == 3


def test_names_then_units_then_rows(tmp_path: Path) -> None:
    text = written(tmp_path / "history.csv", 2).decode()
    assert text.splitlines()[:3] == [
        "time,pressure,contact_count",
        "s,Pa,-",
        f"0.0,{1e3 / 3!r},0.0",
    ]
    assert read_units(tmp_path / "history.csv") == UNITS


@given(values=st.lists(st.floats(allow_subnormal=False), max_size=20))
def test_numbers_survive_bit_by_bit(values: list[float], tmp_path_factory) -> None:
    path = tmp_path_factory.mktemp("run") / "history.csv"
    history = History(path, {"time": "s"})
    for value in values:
        history.append({"time": value})
    history.close()
    np.testing.assert_array_equal(read_history(path)["time"], np.array(values, dtype=float))


def test_a_row_is_there_for_other_programs_at_once(tmp_path: Path) -> None:
    history = History(tmp_path / "history.csv", UNITS)
    history.append(row(7))
    assert read_history(tmp_path / "history.csv")["contact_count"].tolist() == [7.0]
    history.close()


def test_numpy_numbers_and_missing_values_are_rows_too(tmp_path: Path) -> None:
    history = History(tmp_path / "history.csv", UNITS)
    history.append({"time": np.float64(0.5), "pressure": np.nan, "contact_count": np.int32(4)})
    history.close()
    columns = read_history(tmp_path / "history.csv")
    np.testing.assert_array_equal([c[0] for c in columns.values()], [0.5, np.nan, 4.0])


@given(cut=st.integers(0, 200))
def test_a_history_cut_anywhere_reads_up_to_the_last_whole_row(cut: int, tmp_path_factory) -> None:
    path = tmp_path_factory.mktemp("run") / "history.csv"
    whole = written(path, 5)
    header = b"".join(whole.splitlines(keepends=True)[:2])
    left = whole[: max(len(header), len(whole) - cut)]
    path.write_bytes(left)
    assert len(read_history(path)["time"]) == left.count(b"\n") - 2


@given(stopped_after=st.integers(1, 20), checkpoint=st.integers(0, 19), cut=st.integers(0, 30))
def test_a_resumed_run_leaves_the_file_of_an_uninterrupted_one(
    stopped_after: int, checkpoint: int, cut: int, tmp_path_factory
) -> None:
    path = tmp_path_factory.mktemp("run") / "history.csv"
    whole = written(path, 20)
    checkpoint = min(checkpoint, stopped_after - 1)
    stopped = written(path, stopped_after) + whole.splitlines()[-1][:cut]
    path.write_bytes(stopped)
    history = History(path, UNITS, row(checkpoint)["time"])
    for i in range(checkpoint + 1, 20):
        history.append(row(i))
    history.close()
    assert path.read_bytes() == whole


@pytest.mark.parametrize(
    ("units", "said"),
    [
        ({"time": "s", "frame_x": "m"}, "columns other than"),
        ({**UNITS, "pressure": "kPa"}, "units"),
    ],
)
def test_resuming_with_other_columns_is_refused(tmp_path: Path, units, said: str) -> None:
    before = written(tmp_path / "history.csv", 3)
    with pytest.raises(OutputError, match=said):
        History(tmp_path / "history.csv", units, 0.1)
    assert (tmp_path / "history.csv").read_bytes() == before


def test_closing_twice_is_closing(tmp_path: Path) -> None:
    history = History(tmp_path / "history.csv", UNITS)
    history.close()
    history.close()


def test_a_row_that_does_not_fit_is_refused_by_name(tmp_path: Path) -> None:
    history = History(tmp_path / "history.csv", UNITS)
    with pytest.raises(OutputError, match=r"missing \['contact_count'\], unknown \['contacts'\]"):
        history.append({"time": 0.0, "pressure": 0.0, "contacts": 1})
    history.close()


@pytest.mark.parametrize(
    "damage", [b"0.2,abc,1\n", b"0.2,1.0\n", b"0.2,1.0,2.0,3.0\n", b"\n", b"0.2,\xff,1\n"]
)
def test_a_damaged_line_is_named_with_its_number(tmp_path: Path, damage: bytes) -> None:
    path = tmp_path / "history.csv"
    lines = written(path, 3).splitlines(keepends=True)
    path.write_bytes(b"".join([*lines[:3], damage, *lines[4:]]))
    with pytest.raises(OutputError, match=r"history\.csv:4: expected 3 numbers"):
        read_history(path)


@pytest.mark.parametrize(
    "content",
    [b"", b"time,pressure\n", b"time,pressure\ns\n", b"time,pressure\ns,P", b"tine,u\ns,m\n",
     b"time,u\xfe\ns,m\n"],
)  # fmt: skip
def test_a_file_without_its_header_is_no_history(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "history.csv").write_bytes(content)
    with pytest.raises(OutputError, match="is not a history"):
        read_history(tmp_path / "history.csv")


def test_a_missing_history_is_named(tmp_path: Path) -> None:
    for read in (read_history, read_units):
        with pytest.raises(OutputError, match=r"cannot read the history .*history\.csv"):
            read(tmp_path / "history.csv")


def test_a_full_disk_is_named_when_it_happens(tmp_path: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    full = History(tmp_path / "history.csv", UNITS)
    full._stream.close()
    with Path("/dev/full").open("a", encoding="utf-8", buffering=1) as full._stream:
        with pytest.raises(OutputError, match=r"history\.csv: No space left"):
            full.append(row(0))
        with pytest.raises(OutputError, match=r"history\.csv: "):
            full.close()
