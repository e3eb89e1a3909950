"""Posteriors survive being written, to what their integers hold."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from objstate.errors import ResultError
from objstate.recording.posteriors import WHOLE, Histogram, PosteriorWriter, read_posteriors


def histogram(index: int) -> Histogram:
    shares = np.random.default_rng(index).dirichlet(np.ones(16))
    return Histogram(10**18 + index, f"door_{index % 3}", "angle", 0.0, 1.5, shares)


@pytest.mark.parametrize("rows_in_memory", [7, 1000])
def test_posteriors_come_back_in_order(tmp_path: Path, rows_in_memory: int) -> None:
    with PosteriorWriter(tmp_path, rows_in_memory) as writer:
        for index in range(0, 40, 2):
            writer.write([histogram(index), histogram(index + 1)])
    assert [each.name for each in tmp_path.iterdir()] == ["posteriors.parquet"]
    for index, row in enumerate(read_posteriors(tmp_path).iter_rows(named=True)):
        true = histogram(index)
        assert (row["stamp"], row["object"], row["upper"]) == (true.stamp_ns, true.object, 1.5)
        assert np.array(row["masses"]) / WHOLE == pytest.approx(true.shares, abs=0.5001 / WHOLE)


def test_missing_or_strange_posteriors_are_named(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="holds no"):
        read_posteriors(tmp_path)
    (tmp_path / "posteriors.parquet").write_bytes(b"rubbish")
    with pytest.raises(ResultError, match="not a Parquet"):
        read_posteriors(tmp_path)
    pl.DataFrame({"stamp": [1]}).write_parquet(tmp_path / "posteriors.parquet")
    with pytest.raises(ResultError, match="instead of"):
        read_posteriors(tmp_path)
