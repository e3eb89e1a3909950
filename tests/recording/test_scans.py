"""Thin scans survive being written, to the centimetre."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from objstate.errors import ResultError
from objstate.recording.scans import FARTHEST, SCANS, ScanWriter, ThinScan, read_scans


def test_scans_come_back_in_order(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    scans = [ThinScan(k, f"laser_{k % 2}", rng.normal(size=(k, 2))) for k in range(20)]
    with ScanWriter(tmp_path, rows_in_memory=3) as writer:
        writer.write(scans)
    found = read_scans(tmp_path)
    assert found["stamp"].to_list() == list(range(20))
    for scan, row in zip(scans, found.iter_rows(named=True), strict=True):
        assert row["laser"] == scan.laser
        ends = np.column_stack([row["x"], row["y"]]) / 100
        assert ends.reshape(-1, 2) == pytest.approx(scan.ends, abs=0.00501)


def test_what_is_too_far_for_the_file_lies_at_its_edge(tmp_path: Path) -> None:
    with ScanWriter(tmp_path) as writer:
        writer.write([ThinScan(0, "laser", np.array([[1e6, -1e6]]))])
    row = read_scans(tmp_path).row(0, named=True)
    assert (row["x"], row["y"]) == ([round(100 * FARTHEST)], [-round(100 * FARTHEST)])


def test_a_result_without_scans_has_none(tmp_path: Path) -> None:
    assert len(read_scans(tmp_path)) == 0


def test_damaged_scans_are_named(tmp_path: Path) -> None:
    (tmp_path / SCANS).write_bytes(b"rubbish")
    with pytest.raises(ResultError, match=r"scans\.parquet is not a Parquet file"):
        read_scans(tmp_path)
    pl.DataFrame({"stamp": [1]}).write_parquet(tmp_path / SCANS)
    with pytest.raises(ResultError, match="instead of"):
        read_scans(tmp_path)
