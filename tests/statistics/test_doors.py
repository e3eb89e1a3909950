"""Statistics of the doors of a batch folder."""

from datetime import UTC, datetime
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest

from objstate.errors import ResultError
from objstate.recording.batches import BatchLog, write_logs
from objstate.recording.results import MARK
from objstate.recording.tables import EstimateWriter
from objstate.records import Estimate
from objstate.statistics import OpenAbove, door_statistics

HOUR_NS = 3600 * 10**9
MONDAY = int(datetime(2026, 1, 5, 8, 30, tzinfo=UTC).timestamp()) * 10**9


def folder_of(home: Path, logs: dict[str, list[Estimate]], lost: str = "[]") -> Path:
    """A batch with these estimates."""
    write_logs(home, [BatchLog(name, f"/{name}.mcap", "/b.urdf") for name in logs])
    for name, estimates in logs.items():
        result = home / "logs" / name
        result.mkdir(parents=True)
        with EstimateWriter(result) as writer:
            writer.write(estimates)
        (result / "run.json").write_text(f'{{"lost_ns": {lost}}}')
        (result / MARK).touch()
    return home


def seen(stamp_ns: int, angle: float, half: float = 0.02, observed: bool = True) -> Estimate:
    bounds = (angle - half, angle + half)
    return Estimate(stamp_ns, "door", "angle", angle, half / 1.6, *bounds, observed)


def test_looks_that_decide_are_counted_by_hour_and_day(tmp_path: Path) -> None:
    first = [
        seen(MONDAY, 0.0),
        seen(MONDAY + 1, 0.5, half=0.6),
        seen(MONDAY + 2, 1.0, observed=False),
    ]
    later = [seen(MONDAY + 3 * HOUR_NS, 1.2)]
    (door,) = door_statistics(folder_of(tmp_path, {"a": first, "b": later}))
    assert (door.door, door.logs, door.looks, door.undecided, door.moves_seen) == (
        "door",
        2,
        2,
        1,
        1,
    )
    assert [share.key for share in door.by_hour] == [8, 11]
    assert [share.share.lower == 0 for share in door.by_hour] == [True, False]
    assert [share.key for share in door.by_weekday] == [0]


def test_hours_are_those_of_the_zone(tmp_path: Path) -> None:
    home = folder_of(tmp_path, {"a": [seen(MONDAY, 1.0)]})
    (door,) = door_statistics(home, zone=ZoneInfo("America/New_York"))
    assert [share.key for share in door.by_hour] == [3]


def test_what_counts_as_open_is_the_users_to_say(tmp_path: Path) -> None:
    home = folder_of(tmp_path, {"a": [seen(MONDAY, 0.3), seen(MONDAY + HOUR_NS, 0.3)]})
    (wide,), (narrow,) = (door_statistics(home, OpenAbove(angle=a)) for a in (0.5, 0.1))
    assert wide.by_hour[0].share.lower == 0
    assert narrow.by_hour[0].share.upper == 1


def test_what_was_seen_while_lost_does_not_count(tmp_path: Path) -> None:
    home = folder_of(tmp_path, {"a": [seen(MONDAY, 1.0)]}, lost=f"[[{MONDAY}, {MONDAY + 1}]]")
    assert door_statistics(home) == ()


def test_equal_looks_give_equal_figures(tmp_path: Path) -> None:
    home = folder_of(tmp_path, {"a": [seen(MONDAY + n * HOUR_NS, n % 3 / 2) for n in range(9)]})
    assert door_statistics(home) == door_statistics(home)


def test_a_folder_without_estimates_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="objstate batch"):
        door_statistics(tmp_path)
