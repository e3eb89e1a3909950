"""The report of a batch: its logs, its building over all of them, its doors."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from urllib.parse import unquote
from zoneinfo import ZoneInfo

import numpy as np
import polars as pl
import pytest

from objstate.batch.combine import combine
from objstate.errors import ResultError
from objstate.evaluation import latest_states
from objstate.recording.batches import (
    BatchLog,
    Outcome,
    read_logs,
    result_of,
    write_logs,
)
from objstate.recording.index import write_outcome
from objstate.recording.tables import read_estimates
from objstate.report import write_batch_report
from objstate.report.coverage import Coverage, pooled
from objstate.report.usage import TALL, usage
from objstate.statistics import DoorStatistics, Interval, Share
from tests.report.pages import read


def words(page: Path) -> str:
    return " ".join(read(page.read_text(encoding="utf-8")).words)


def links_of(page: Path) -> list[str]:
    references = read(page.read_text(encoding="utf-8")).references
    return [each for each in references if not each.startswith("#")]


def test_it_lists_every_log_with_its_fate(batch: Path) -> None:
    page = write_batch_report(batch)
    assert page == batch / "report.html"
    said = words(page)
    assert "broken failed: It is <no> log." in said
    rows = re.findall(r'<tr><th scope="row">(?:<a [^>]*>)?(\w+)', page.read_text(encoding="utf-8"))
    assert [row for row in rows if row in ("first", "second", "broken")] == [
        "broken", "first", "second",
    ]  # fmt: skip
    assert "Beside the truth, over all logs" in said
    assert "room, over 2 logs" in said
    assert "How doors are used" in said
    assert "2 of 3 logs done" in said
    assert "100% of the time localized" in said
    assert "Objects over all logs" in said


def test_the_worst_log_and_the_worst_object_come_first(batch: Path, tmp_path: Path) -> None:
    truth = tmp_path / "truth.csv"
    truth.write_text("stamp,object,coordinate,value\n0,office_door,angle,1.3\n0,chest,x,4.0\n")
    logs = [
        replace(log, truth=str(truth)) if log.name == "second" else log for log in read_logs(batch)
    ]
    write_logs(batch, logs)
    combine(batch)
    page = write_batch_report(batch).read_text(encoding="utf-8")
    rows = re.findall(r'<tr><th scope="row">(?:<a [^>]*>)?(\w+)', page)
    assert rows[:4] == ["broken", "second", "first", "office_door"]
    assert re.search(
        r'<div class="wrong"><b>\d+\.\d°</b>angle off at worst, office_door in second', page
    )


def test_an_object_that_no_log_observed_is_on_the_plan_too(batch: Path) -> None:
    page = write_batch_report(batch).read_text(encoding="utf-8")
    assert page.count('class="every object"') == 2
    assert page.count('class="every object unknown"') == 1


def test_a_plan_holds_furniture_wherever_it_stood(batch: Path) -> None:
    for name in ("first", "second"):
        file = result_of(batch, name) / "smoothed.parquet"
        rows = pl.read_parquet(file)
        far = pl.when(pl.col("object") == "chest", pl.col("coordinate") == "y")
        rows.with_columns(median=far.then(pl.lit(-30.0)).otherwise("median")).write_parquet(file)
    page = write_batch_report(batch).read_text(encoding="utf-8")
    box = re.search(r'<svg viewBox="(\S+) (\S+) (\S+) (\S+)" class="plan"', page)
    assert box
    assert float(box[2]) + float(box[4]) > 30.3  # y points down


def test_links_lead_to_names_that_urls_must_quote(batch: Path) -> None:
    odd = "100 % #1?"
    (batch / "logs" / "first").rename(batch / "logs" / odd)
    write_outcome(batch, Outcome(odd, "done", attempts=1))
    write_logs(batch, [replace(log, name=odd) for log in read_logs(batch) if log.name == "first"])
    combine(batch)
    (link,) = links_of(write_batch_report(batch, each=True))
    assert (batch / unquote(link)).is_file()
    assert "#" not in link
    assert "?" not in link


def test_hours_and_dates_are_told_by_the_clock_that_is_asked_for(batch: Path) -> None:
    page = write_batch_report(batch, each=True, zone=ZoneInfo("Asia/Tokyo"))
    assert "(from midnight, Asia/Tokyo)" in words(page)
    assert re.search(r"\d\d:\d\d:\d\d JST", words(page))
    assert "JST" in words(result_of(batch, "first") / "report.html")


def test_an_hour_that_was_looked_at_once_shows_how_little_that_tells() -> None:
    known = Interval(0.5, 0.4, 0.6)
    hours = (
        Share(3, 1, 1.0, Interval(0.85, 0.15, 1.0)),
        Share(4, 90, 80.0, Interval(0.5, 0.4, 0.6)),
    )
    door = DoorStatistics("d", 1, 91, 0, 0, 1, 0, *[known] * 5, hours, ())
    drawn = re.findall(r'height="([\d.]+)" class="span"', usage([door]))
    assert [float(height) / TALL for height in drawn] == pytest.approx([0.85, 0.2], abs=0.01)


def test_each_log_is_linked_once_it_has_a_page(batch: Path, tmp_path: Path) -> None:
    assert links_of(write_batch_report(batch)) == []
    elsewhere = write_batch_report(batch, tmp_path / "page.html", each=True)
    links = links_of(elsewhere)
    assert links == ["batch/logs/first/report.html", "batch/logs/second/report.html"]
    assert all((elsewhere.parent / link).is_file() for link in links)
    assert "Calibration" in words(elsewhere.parent / links[0])


def test_the_plan_shows_an_object_where_it_stood_in_each_log(batch: Path) -> None:
    page = write_batch_report(batch).read_text(encoding="utf-8")
    (door,) = [
        state.estimate.value
        for state in latest_states(read_estimates(result_of(batch, "first")))
        if state.estimate.object == "office_door"
    ]
    turns = re.findall(r'<use href="#shape-0-\d" transform="rotate\((\S+) 2.0 2.0\)"', page)
    assert [float(turn) for turn in turns] == pytest.approx([-np.degrees(door)] * 2, abs=0.01)


def test_a_building_out_of_reach_costs_only_its_plan(batch: Path) -> None:
    logs = [BatchLog("first", "log.mcap", "/nowhere/room.urdf")]
    write_logs(batch, logs)
    combine(batch)
    said = words(write_batch_report(batch))
    assert "/nowhere/room.urdf" in said
    assert "over 1 logs" not in said


def test_what_is_no_batch_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="is no batch"):
        write_batch_report(tmp_path)


def test_pooling_weighs_by_updates() -> None:
    claimed = np.array([0.5])
    one = Coverage("angles", 1, np.array([0.1]), claimed, np.array([1.0]))
    three = Coverage("angles", 3, np.array([0.2, 0.3, 0.4]), claimed, np.array([0.0]))
    none = Coverage("lengths", 0, np.zeros(0), claimed, np.zeros(1))
    angles, lengths = pooled([one, none, three])
    assert (angles.count, angles.held.tolist()) == (4, [0.25])
    assert angles.errors.tolist() == [0.1, 0.2, 0.3, 0.4]
    assert lengths.count == 0
