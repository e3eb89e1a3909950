"""A table that isn't what it should be is an error that ends with the cure."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from objstate.errors import ResultError
from objstate.recording.batches import SUMMARY_TABLE, read_summary_table, summary_schema
from objstate.recording.parquet import read_parquet

SCHEMA = pl.Schema({"stamp": pl.Int64(), "name": pl.String()})
CURE = "make it anew"


def test_a_table_comes_back(tmp_path: Path) -> None:
    table = pl.DataFrame({"stamp": [1, 2], "name": ["a", "b"]}, schema=SCHEMA)
    table.write_parquet(tmp_path / "table.parquet")
    assert read_parquet(tmp_path / "table.parquet", SCHEMA, CURE).equals(table)


def test_no_table_another_one_and_rubbish_are_named_with_the_cure(tmp_path: Path) -> None:
    path = tmp_path / "table.parquet"
    with pytest.raises(ResultError, match=r"holds no table\.parquet; make it anew\."):
        read_parquet(path, SCHEMA, CURE)
    path.write_bytes(b"rubbish")
    with pytest.raises(ResultError, match=r"not a Parquet file .*; make it anew\."):
        read_parquet(path, SCHEMA, CURE)
    pl.DataFrame({"stamp": [1.5], "name": ["a"]}).write_parquet(path)
    with pytest.raises(ResultError, match=r"instead of .*; make it anew\."):
        read_parquet(path, SCHEMA, CURE)


def test_a_batch_whose_summary_is_damaged_says_to_run_it_again(tmp_path: Path) -> None:
    pl.DataFrame(schema=summary_schema()).write_parquet(tmp_path / SUMMARY_TABLE)
    assert read_summary_table(tmp_path).is_empty()
    (tmp_path / SUMMARY_TABLE).write_bytes(b"rubbish")
    with pytest.raises(ResultError, match="run `objstate batch` to its end"):
        read_summary_table(tmp_path)
