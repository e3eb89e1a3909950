"""Estimates and true states survive being written, exactly."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.errors import ResultError, TruthError
from objstate.recording.tables import EstimateWriter, read_estimates, read_truth, write_truth
from objstate.records import Estimate, TrueState

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)


def estimate(index: int) -> Estimate:
    name = f"door_{index % 3}"
    numbers = (0.1 * index, 0.5, -1.0, 1.0)
    return Estimate(
        10**18 + index, name, "angle", *numbers, index % 2 == 0, 0.01 * index, median=0.3 * index
    )


def write(folder: Path, count: int, rows_in_memory: int) -> bytes:
    folder.mkdir()
    with EstimateWriter(folder, rows_in_memory) as writer:
        for index in range(count):
            writer.write([estimate(index)])
    assert [item.name for item in folder.iterdir()] == ["estimates.parquet"]
    return (folder / "estimates.parquet").read_bytes()


@pytest.mark.parametrize("rows_in_memory", [7, 1000])
def test_rows_come_back_in_order_however_few_fit_into_memory(
    tmp_path: Path, rows_in_memory: int
) -> None:
    first = write(tmp_path / "a", 100, rows_in_memory)
    assert first == write(tmp_path / "b", 100, rows_in_memory)
    frame = read_estimates(tmp_path / "a")
    assert [Estimate(*row) for row in frame.iter_rows()] == [estimate(i) for i in range(100)]


def test_schema_holds_even_without_rows(tmp_path: Path) -> None:
    write(tmp_path / "out", 0, 10)
    schema = read_estimates(tmp_path / "out").schema
    assert schema["stamp"] == pl.Int64
    assert schema["observed"] == pl.Boolean
    assert schema["lower"] == pl.Float64


def test_a_run_that_fails_leaves_no_table(tmp_path: Path) -> None:
    def failing() -> None:
        with EstimateWriter(tmp_path, 1) as writer:
            writer.write([estimate(0)])
            raise RuntimeError

    with pytest.raises(RuntimeError):
        failing()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("rows_in_memory", [3, 100])
def test_rows_are_marked_as_lost_where_that_was_found_out_later(
    tmp_path: Path, rows_in_memory: int
) -> None:
    estimates = [estimate(index) for index in range(10)]
    with EstimateWriter(tmp_path, rows_in_memory) as table:
        table.write(estimates)
        table.lost = [(estimates[2].stamp_ns, estimates[4].stamp_ns)]
    lost = read_estimates(tmp_path)["lost"].to_list()
    assert lost == [each.lost or k in (2, 3) for k, each in enumerate(estimates)]


def test_missing_or_strange_estimates_are_named(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="holds no"):
        read_estimates(tmp_path)
    (tmp_path / "estimates.parquet").write_bytes(b"rubbish")
    with pytest.raises(ResultError, match="not a Parquet"):
        read_estimates(tmp_path)
    pl.DataFrame({"stamp": [1.5]}).write_parquet(tmp_path / "estimates.parquet")
    with pytest.raises(ResultError, match="columns"):
        read_estimates(tmp_path)


@settings(max_examples=25)
@given(
    st.lists(st.tuples(st.integers(-(2**62), 2**62), NUMBERS), max_size=5, unique_by=lambda r: r[0])
)
def test_truth_round_trips(
    tmp_path_factory: pytest.TempPathFactory, pairs: list[tuple[int, float]]
) -> None:
    path = tmp_path_factory.mktemp("truth") / "truth.csv"
    rows = [TrueState(stamp, "desk, left", "x", value) for stamp, value in sorted(pairs)]
    write_truth(path, rows)
    assert read_truth(path) == rows


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1.5,door,angle,0", "line 2: the stamp '1.5' must be whole nanoseconds"),
        ("99999999999999999999,door,angle,0", "nanoseconds"),
        ("1,door,angle", "line 2 has 3 fields"),
        ("1,,angle,0", "names no object"),
        ("1,door,height,0", "must be one of"),
        ("1,door,angle,nan", "finite"),
        ("1,door,angle,0\n1,door,angle,1", "two values"),
        ("1,door,angle,45", "whole turn.*degrees are meant, write 0.7854"),
        ("1,desk,yaw,-90", "whole turn.*degrees are meant, write -1.571"),
        ("1,door,offset,900", "millimetres are meant, write 0.9"),
        ("1600000000.5,door,angle,0", "seconds are meant, write 1600000000500000000"),
    ],
)
def test_faulty_truth_names_line_and_cure(tmp_path: Path, line: str, message: str) -> None:
    path = tmp_path / "truth.csv"
    path.write_text(f"stamp,object,coordinate,value\n{line}\n")
    with pytest.raises(TruthError, match=message):
        read_truth(path)


def test_a_mark_of_the_byte_order_is_no_part_of_the_header(tmp_path: Path) -> None:
    path = tmp_path / "truth.csv"
    path.write_text("stamp,object,coordinate,value\n1,door,angle,0.5\n", encoding="utf-8-sig")
    assert read_truth(path) == [TrueState(1, "door", "angle", 0.5)]


def test_truth_that_is_no_truth_is_named(tmp_path: Path) -> None:
    path = tmp_path / "truth.csv"
    with pytest.raises(TruthError, match="Can't read"):
        read_truth(path)
    for content in (b"", b"time,door\n1,2\n"):
        path.write_bytes(content)
        with pytest.raises(TruthError, match="line 1"):
            read_truth(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TruthError, match="UTF-8"):
        read_truth(path)
