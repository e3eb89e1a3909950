"""Cells are those of the local clock."""

from datetime import UTC, date, datetime
from zoneinfo import ZoneInfo

import numpy as np
import pytest

from objstate.habits.calendar import CELL_S, FREE, NANOSECONDS, PER_DAY, WORKING, Calendar, kinds
from objstate.habits.steps import by_days, steps

BERLIN = Calendar(ZoneInfo("Europe/Berlin"), frozenset({date(2026, 12, 25)}))


def cell(*moment: int, calendar: Calendar = BERLIN) -> int:
    """The cell of a local time."""
    return int(datetime(*moment, tzinfo=calendar.zone).timestamp()) // CELL_S  # type: ignore[misc, arg-type]


@pytest.mark.parametrize(("day", "hours"), [(28, 24), (29, 23), (30, 24)])
def test_a_day_on_which_clocks_are_put_forward_lacks_an_hour(day: int, hours: int) -> None:
    first, last = cell(2026, 3, day), cell(2026, 3, day + 1)
    assert (last - first) * CELL_S == hours * 3600
    quarters = BERLIN.keys(first, last) % PER_DAY
    assert len(set(quarters.tolist())) == len(quarters)
    missing = set(range(PER_DAY)) - set(quarters.tolist())
    assert missing == (set(range(8, 12)) if hours == 23 else set())


def test_a_day_on_which_clocks_are_put_back_has_an_hour_twice() -> None:
    keys = BERLIN.keys(cell(2026, 10, 25), cell(2026, 10, 26)) % PER_DAY
    assert len(keys) == PER_DAY + 4
    assert np.bincount(keys)[8:12].tolist() == [2, 2, 2, 2]


def test_weekends_and_holidays_are_free() -> None:
    kinds = [BERLIN.kind(date(2026, 12, day)) for day in (23, 24, 25, 26, 27, 28)]
    assert kinds == [WORKING, WORKING, FREE, FREE, FREE, WORKING]
    assert BERLIN.key(cell(2026, 12, 25, 12)) == FREE * PER_DAY + 48


def test_a_zone_off_by_a_quarter_of_an_hour_has_whole_cells() -> None:
    nepal = Calendar(ZoneInfo("Asia/Kathmandu"))
    assert nepal.key(cell(2026, 1, 5, 9, 15, calendar=nepal)) == 37


def test_steps_cover_the_time_between_looks() -> None:
    begin = int(datetime(2026, 3, 28, 22, 7, tzinfo=UTC).timestamp()) * NANOSECONDS
    looks = begin + np.array([5, 5, 3600, 90000]) * NANOSECONDS
    cut = steps(BERLIN, begin, looks, begin + 100000 * NANOSECONDS)
    assert cut.seconds.sum() == pytest.approx(100000)
    assert cut.seconds.max() <= CELL_S
    assert cut.looks[cut.looks >= 0].tolist() == [0, 1, 2, 3]
    ends = np.cumsum(cut.seconds)
    assert ends[cut.looks >= 0] == pytest.approx([5, 5, 3600, 90000])


@pytest.mark.parametrize("hours", [1.0, 14.0, 23.0, 30.0, 400.0, 3000.0])
def test_steps_by_days_last_as_long_and_keep_the_looks(hours: float) -> None:
    begin = int(datetime(2026, 3, 20, 21, 40, tzinfo=UTC).timestamp()) * NANOSECONDS
    looks = begin + (np.array([0.2, 0.7, 1.0]) * hours * 3600).astype(np.int64) * NANOSECONDS
    cells = steps(BERLIN, begin, looks)
    days = by_days(cells, kinds(BERLIN.seasons), least=1)
    assert days.seconds.sum() == pytest.approx(cells.seconds.sum())
    assert days.looks[days.looks >= 0].tolist() == [0, 1, 2]
    ends = [np.cumsum(each.seconds)[each.looks >= 0] for each in (cells, days)]
    assert ends[1] == pytest.approx(ends[0])
    assert (days.keys >= kinds(BERLIN.seasons) * PER_DAY).any() == (hours > 100.0)
