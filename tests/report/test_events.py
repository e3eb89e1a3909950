"""What moved, from a table that a result may have."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from objstate.report.events import COLUMNS, EVENTS, Event, read_events, shown


def written(folder: Path, before: object, after: object, **more: object) -> list[str]:
    row = dict(zip(COLUMNS, ("door", 5, 9, before, after, 0.8), strict=True)) | more
    pl.DataFrame([row]).write_parquet(folder / EVENTS)
    return []


def test_a_result_without_events_has_none(tmp_path: Path) -> None:
    doubts: list[str] = []
    assert read_events(tmp_path, doubts) == ()
    assert doubts == []


@pytest.mark.parametrize(("before", "after"), [(0.0, 1.2), ("closed", "open"), (None, 1.0)])
def test_states_are_values_or_names(tmp_path: Path, before: object, after: object) -> None:
    doubts = written(tmp_path, before, after, note="of another version")
    assert read_events(tmp_path, doubts) == (Event("door", 5, 9, before, after, 0.8),)  # type: ignore[arg-type]
    assert doubts == []


def test_states_read_as_people_write_them() -> None:
    assert [shown(0.5, "angle"), shown("closed", "angle"), shown(None, "angle")] == [
        "28.6°", "closed", "–",
    ]  # fmt: skip


def test_what_cannot_be_read_is_a_doubt(tmp_path: Path) -> None:
    for make in (
        lambda path: path.write_bytes(b"rubbish"),
        lambda path: pl.DataFrame({"object": ["door"]}).write_parquet(path),
    ):
        make(tmp_path / EVENTS)
        doubts: list[str] = []
        assert read_events(tmp_path, doubts) == ()
        assert "events.parquet can't be read" in doubts[0]
