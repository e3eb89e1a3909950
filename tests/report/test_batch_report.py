"""The report of a batch: its logs, its building over all of them, its doors."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from objstate.batch.combine import combine
from objstate.errors import ResultError
from objstate.evaluation import latest_states
from objstate.recording.batches import BatchLog, Outcome, result_of, write_logs, write_outcome
from objstate.recording.tables import read_estimates
from objstate.report import write_batch_report
from objstate.report.coverage import Coverage, pooled
from tests.report.pages import read


@pytest.fixture
def batch(result: Path, tmp_path: Path) -> Path:
    """Two logs that are done, alike, one with truth; one that failed."""
    folder, drive = tmp_path / "batch", result.parent
    urdf, log = str(drive / "room.urdf"), str(drive / "log" / "log.mcap")
    truth, path = str(drive / "log" / "truth.csv"), str(drive / "log" / "path.tum")
    logs = [
        BatchLog("first", log, urdf, truth, path),
        BatchLog("second", log, urdf),
        BatchLog("broken", str(drive / "<broken>.mcap"), urdf),
    ]
    for name in ("first", "second"):
        result_of(folder, name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copytree(result, result_of(folder, name))
        (result_of(folder, name) / "report.html").unlink(missing_ok=True)
        write_outcome(folder, Outcome(name, "done", attempts=1))
    (folder / "outcomes").mkdir(exist_ok=True)
    write_outcome(folder, Outcome("broken", "failed", "It is <no> log.", attempts=1))
    write_logs(folder, logs)
    combine(folder)
    return folder


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
        state.estimate.mean
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
