"""Events of a result folder are written and read back."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from objstate.errors import ResultError
from objstate.recording.events import EVENTS, Event, read_events, write_events

LATER = Event("door", "moved", "angle", 7, 9, 0.1, 0.01, 1.2, 0.02, 0.8)
EARLIER = Event("chest", "came", "x", 5, 6, None, None, 2.0, 0.03, 0.9)


def test_events_come_back_in_time_order(tmp_path: Path) -> None:
    write_events(tmp_path, [LATER, EARLIER])
    assert read_events(tmp_path) == [EARLIER, LATER]


def test_no_events_are_a_table_without_rows(tmp_path: Path) -> None:
    write_events(tmp_path, [])
    assert (tmp_path / EVENTS).is_file()
    assert read_events(tmp_path) == []


def test_a_result_of_an_earlier_version_has_none(tmp_path: Path) -> None:
    assert read_events(tmp_path) == []


def test_another_table_is_an_error(tmp_path: Path) -> None:
    pl.DataFrame({"object": ["door"]}).write_parquet(tmp_path / EVENTS)
    with pytest.raises(ResultError, match="has the columns"):
        read_events(tmp_path)
