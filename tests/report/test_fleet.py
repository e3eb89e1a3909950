"""What a batch's report says of a whole fleet: news, habits, drift, days, and no more than fits."""

import re
from dataclasses import replace
from datetime import UTC
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from objstate.batch.combine import combine
from objstate.recording.batches import BatchLog, Outcome, read_logs, result_of, write_logs
from objstate.recording.index import open_index, write_outcome
from objstate.report import batch_material, write_batch_report
from objstate.report.batch_material import Line
from objstate.report.batch_part import packed, read_done, unpacked
from objstate.report.drift import drift
from objstate.report.habits import done_door, habits
from objstate.report.news import NOW
from objstate.statistics.doors import statistics_of
from objstate.statistics.looks import DoorLooks
from objstate.statistics.two_state import Looks
from tests.report.pages import read

DAY_NS = 86400 * 10**9
MONDAY_NS = 1767571200 * 10**9


def words(page: Path) -> str:
    return " ".join(read(page.read_text(encoding="utf-8")).words)


def test_what_is_kept_of_a_log_gives_the_same_page(batch: Path) -> None:
    log = read_logs(batch)[1]
    done = read_done(result_of(batch, log.name), log, filtered=False)
    again = unpacked(packed(done), log)
    assert again.latest == done.latest
    assert again.verdicts == done.verdicts
    assert (again.course.localized, again.begin_ns) == (done.course.localized, done.begin_ns)
    assert [each.count for each in again.coverages] == [each.count for each in done.coverages]
    assert write_batch_report(batch).read_bytes() == write_batch_report(batch).read_bytes()


def test_news_are_what_changed_since_the_report_before(batch: Path) -> None:
    assert "Since the report before" not in words(write_batch_report(batch))
    write_outcome(batch, Outcome("first", "failed", "gone"))
    file = result_of(batch, "second") / "smoothed.parquet"
    door = pl.col("object") == "office_door"
    rows = pl.read_parquet(file)
    later = pl.when(door).then(pl.col("median") + 0.5).otherwise("median")
    rows.with_columns(later.alias("median"), pl.col("stamp") + 1).write_parquet(file)
    (batch / "logs" / "second" / "parts.bin").unlink(missing_ok=True)
    combine(batch)
    said = words(write_batch_report(batch))
    assert "1 log is not done any more: first" in said
    assert re.search(r"1 states differ .* office_door angle", said)
    assert words(write_batch_report(batch)) == said  # no news, so that it still tells the last ones
    write_outcome(batch, Outcome("first", "done"))
    combine(batch)
    assert "1 log is more done: first" in words(write_batch_report(batch))


def test_a_damaged_memory_of_the_report_before_is_no_news(batch: Path) -> None:
    write_batch_report(batch)
    with open_index(batch) as index:
        index.keep("reported", [(NOW, "", b"damaged")])
    assert "Since the report before" not in words(write_batch_report(batch))


def test_only_the_worst_logs_are_listed_where_there_are_many(
    batch: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(batch_material, "MOST_LISTED", 1)
    said = words(write_batch_report(batch))
    assert "Logs to look at first" in said
    assert "1 more are in summary.parquet" in said


def test_a_door_that_changed_its_ways_is_told_with_the_day() -> None:
    rng = np.random.default_rng(0)
    stamps = MONDAY_NS + np.arange(40) * DAY_NS
    changed = Looks(stamps, np.arange(40) >= 25).summed()
    steady = Looks(stamps, rng.random(40) < 0.5).summed()
    doors = [
        done_door(seen, statistics_of(seen), UTC)
        for seen in (DoorLooks("changed", changed, 0, 40), DoorLooks("steady", steady, 0, 40))
    ]
    told = habits(doors, UTC)
    assert "changed" in told
    assert "2026-01-30" in told  # 25 days after Monday, the 5th
    assert "steady" not in told


def test_a_robot_that_drifts_is_told_beside_one_that_does_not() -> None:
    rng = np.random.default_rng(1)
    lines = []
    for n in range(120):
        log = BatchLog(f"log_{n}", "", "", robot=("worn", "sound")[n % 2])
        worn = 0.02 * (n % 2 == 0 and n >= 80)
        odometry = (worn + 0.002 * rng.standard_normal(), 0.001 * rng.standard_normal(), np.nan)
        lines.append(Line(log, MONDAY_NS + n, 60.0, 1.0, odometry))
    told = drift(lines, UTC)
    assert "worn" in told
    assert re.search(r"0\.\d\d → [12]\.\d\d %", told)
    assert "sound" not in told
    assert drift([replace(line, odometry=(np.nan,) * 3) for line in lines], UTC) == ""


def test_days_are_told_where_there_are_several(batch: Path) -> None:
    assert "By day" not in words(write_batch_report(batch))
    for name in ("second",):
        file = result_of(batch, name) / "run.json"
        begin = re.search(r'"begin_ns": (\d+)', file.read_text())
        assert begin
        later = str(int(begin[1]) + DAY_NS)
        file.write_text(file.read_text().replace(f'"begin_ns": {begin[1]}', f'"begin_ns": {later}'))
    with open_index(batch) as index:
        index.drop(["second"])
    write_logs(batch, read_logs(batch))
    combine(batch)
    assert "By day" in words(write_batch_report(batch))
