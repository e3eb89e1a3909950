"""Habits in a world: learnt by drives, kept, asked."""

import json
from dataclasses import replace
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np
import pytest

from objstate.config import CalendarSettings, Dynamics, ObjectRule, Settings
from objstate.errors import WorldError
from objstate.habits.levels import Mixture
from objstate.habits.piece import PieceSite
from objstate.habits.site import Site
from objstate.habits.summary import week_habit
from objstate.objects.doors import LatticeFilter
from objstate.world import Allowed, Task, World
from objstate.world.driving import drive_settings
from objstate.world.habit_rows import pack_piece, pack_site, unpack_piece, unpack_site
from objstate.world.habit_words import season_word, week_of
from objstate.world.habitual import of_moves
from objstate.world.store import DriveEntry, WorldStore, open_store
from objstate.world.when import best_departure, spans, wait
from objstate.world.words import world_words
from tests.world.examples import BUILDING, HOUR, at_angle, desk_at

DAY = 24 * HOUR
MONDAY = int(datetime(2026, 1, 5, tzinfo=UTC).timestamp()) * 10**9
HOURS = (1, 6, 8, 9.5, 11, 12.5, 14, 16, 17.5, 19, 22)


def angle(day: int, hour: float) -> float:
    """Of a door that is open on working days from 9 to 17 h."""
    return 1.2 if day % 7 < 5 and 9 <= hour < 17 else 0.0


def drive(day: int, settings: Settings | None = None) -> DriveEntry:
    begin = MONDAY + day * DAY
    return DriveEntry(f"day {day}", begin, begin + DAY - 1, settings or Settings())


def taught(store: WorldStore, days: range, settings: Settings | None = None) -> WorldStore:
    for day in days:
        looks = [at_angle(angle(day, h), MONDAY + day * DAY + int(h * HOUR)) for h in HOURS]
        assert store.add(drive(day, settings), looks)
    return store


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> WorldStore:
    """A world that has looked at a door for two weeks."""
    place = tmp_path_factory.mktemp("habits") / "world.db"
    return taught(open_store(place, BUILDING), range(14))


def lately(world: World) -> World:
    """The world with the last day's looks alone, which are quick to go through; its habits stay."""
    return world.only(world.history("door")[-len(HOURS) :])


def clear(world: World, hours: float) -> float:
    """Probability that the door leaves 0.6 m, so long after the two weeks."""
    return world.at(MONDAY + 14 * DAY + int(hours * HOUR))["door"].probability_clear(0.6)


def test_a_world_foretells_a_door_by_the_hour(store: WorldStore) -> None:
    world = store.load()
    assert clear(world, 13) > 0.6
    assert clear(world, 27) < 0.1
    fades = replace(world, habits=None)
    assert clear(fades, 13) == pytest.approx(clear(fades, 27), abs=0.01)


def test_beliefs_stay_distributions_and_start_where_they_were(store: WorldStore) -> None:
    world = store.load()
    last = world.history("door")[-1]
    assert last.stamp_ns is not None
    for seconds in (0.001, 1.0, 60.0, 1e5):
        later = world.at(last.stamp_ns + int(seconds * 1e9))["door"]
        assert later.weights.values.sum() == pytest.approx(1.0)
    soon = world.at(last.stamp_ns + 1000)["door"]
    assert np.abs(soon.weights.values - last.weights.values).max() < 1e-3


def test_settings_that_say_how_often_a_door_is_moved_are_taken_at_their_word(
    store: WorldStore,
) -> None:
    still = Settings(objects=(ObjectRule(match="door", dynamics=Dynamics(moves_per_hour=0)),))
    assert store.load(still).habits_of("door") is None
    assert clear(store.load(still), 13) < 0.01


def test_planners_hear_when(store: WorldStore) -> None:
    world, seven = store.load(), MONDAY + 14 * DAY + 7 * HOUR
    (span,) = spans(world, "door", 0.6, seven, 15 * 3600.0)
    assert span.begin_ns == pytest.approx(seven + 2 * HOUR, abs=HOUR)
    assert span.end_ns == pytest.approx(seven + 10 * HOUR, abs=1.5 * HOUR)
    early, late = (wait(world, "door", 0.6, seven + k * HOUR, 86400.0) for k in (-6, 4))
    assert early.mean_s > 4 * 3600.0 > late.mean_s
    assert early.within > 0.9
    best = best_departure(world, [("door", 600.0)], 0.6, seven, 15 * 3600.0)
    assert span.begin_ns < best.stamp_ns < span.end_ns
    with pytest.raises(WorldError, match="is no door"):
        wait(world, "desk", 0.6, seven, 60.0)
    with pytest.raises(WorldError, match="horizon"):
        spans(world, "door", 0.6, seven, float("inf"))


def test_a_drive_expects_doors_to_move_by_day(store: WorldStore) -> None:
    world = store.load()
    day, night = (
        drive_settings(world, MONDAY + 14 * DAY + hour * HOUR).for_object("door", "door")
        for hour in (9, 27)
    )
    assert day.dynamics.moves_per_hour > night.dynamics.moves_per_hour
    assert drive_settings(replace(world, habits=None), 0) == world.settings


BERLIN = Settings(calendar=CalendarSettings(timezone="Europe/Berlin"))
WORKING_DAYS = (0, 1, 2, 3, 4, 7, 8, 9)
TWENTY_PAST = (3 + 20 / 60, 12 + 20 / 60)  # UTC


def seen_twice_a_day(store: WorldStore) -> WorldStore:
    """A door that is closed at night and open by day, each look a drive."""
    for day in WORKING_DAYS:
        for hour, state in zip(TWENTY_PAST, (0.0, 1.4), strict=True):
            stamp_ns = MONDAY + day * DAY + int(hour * HOUR)
            entry = DriveEntry(f"day {day}, {hour:.0f} h", stamp_ns, stamp_ns, BERLIN)
            assert store.add(entry, [at_angle(state, stamp_ns)])
    return store


def closed_at_night(world: World) -> float:
    """Probability that the door is closed the next night, nobody having looked since."""
    assert world.habits is not None
    forecast = world.habits.forecast("door")
    stamp_ns = MONDAY + (WORKING_DAYS[-1] + 1) * DAY + int(TWENTY_PAST[0] * HOUR)
    return float(forecast.regions(forecast.marginal(stamp_ns))[0])


def test_drives_one_by_one_tell_what_a_fit_to_all_tells(tmp_path: Path) -> None:
    store = seen_twice_a_day(open_store(tmp_path / "world.db", BUILDING))
    one_by_one = closed_at_night(store.load())
    store.fit_habits()
    assert one_by_one == pytest.approx(closed_at_night(store.load()), abs=0.05)
    assert one_by_one > 0.85


def test_a_fit_has_the_looks_that_came_while_it_began(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store, load = taught(open_store(tmp_path / "world.db", BUILDING), range(2)), WorldStore.load

    def load_first(self: WorldStore, *args: Any, **chosen: Any) -> World:
        monkeypatch.undo()
        world = load(self, *args, **chosen)
        taught(store, range(2, 3))
        return world

    monkeypatch.setattr(WorldStore, "load", load_first)
    store.fit_habits()
    known = store.load().habits
    assert known is not None
    assert known.sites["door"].looks == 3 * len(HOURS)


def test_habits_are_told_by_the_clock_of_the_building(tmp_path: Path) -> None:
    store = taught(open_store(tmp_path / "world.db", BUILDING), range(3), BERLIN)
    world = store.load()
    assert world.habits is not None
    assert world.habits.calendar.zone == ZoneInfo("Europe/Berlin")
    assert store.load(Settings()).habits is None  # these are of another clock
    moved = Settings(calendar=CalendarSettings(timezone="Asia/Tokyo"))
    assert store.add(drive(3, moved), [at_angle(0.0, MONDAY + 3 * DAY + HOUR)])
    again = store.load()
    assert again.habits is not None
    assert again.habits.sites["door"].looks == 3 * len(HOURS) + 1


def test_sites_come_back_from_bytes(store: WorldStore) -> None:
    habits = store.load().habits
    assert habits is not None
    site = habits.sites["door"]
    again = unpack_site(pack_site(site), "door")
    assert again.bounds == site.bounds
    assert np.allclose(again.precision, site.precision, rtol=1e-6)
    assert (again.looks, again.fitted) == (site.looks, site.fitted)
    assert again.last is not None
    assert site.last is not None
    assert again.last.stamp_ns == site.last.stamp_ns
    empty = unpack_site(pack_site(Site.empty((0.2, 0.8))), "door")
    assert empty.last is None
    assert empty.design.regions == 3


def test_exports_have_the_habits(store: WorldStore) -> None:
    words = json.loads(json.dumps(world_words(lately(store.load()), "office", store.drives())))
    door = words["habits"]["door"]
    assert door["regions"] == ["closed", "open"]
    assert door["looks"] == 14 * len(HOURS)
    noon = next(h for h in door["hours"] if (h["kind"], h["hour"]) == ("working", 12))
    assert noon["shares"][1]["lower"] < noon["shares"][1]["value"] <= noon["shares"][1]["upper"]


def where(day: int, hour: float) -> float:
    """Of a desk that stands at another place from noon to six, on working days."""
    return 3.6 if day % 7 < 5 and 12 <= hour < 18 else 2.9


@pytest.fixture(scope="module")
def furnished(tmp_path_factory: pytest.TempPathFactory) -> WorldStore:
    """A world that has looked at a desk for two weeks."""
    found = open_store(tmp_path_factory.mktemp("moves") / "world.db", BUILDING)
    for day in range(14):
        looks = [desk_at(where(day, h), MONDAY + day * DAY + int(h * HOUR)) for h in HOURS]
        assert found.add(drive(day), looks)
    return found


def test_furniture_is_foretold_at_the_places_where_it_stood(furnished: WorldStore) -> None:
    world = furnished.load()
    assert world.moves_of("desk") is not None
    monday = MONDAY + 14 * DAY
    x = world.at(monday + 14 * HOUR)["desk"].states[:, 0]
    by_place = [float((np.abs(x - place) < 0.2).mean()) for place in (2.9, 3.6)]
    assert by_place[1] > 0.15
    assert sum(by_place) > 0.8
    night = world.at(monday + 4 * HOUR)["desk"].states[:, 0]
    assert float((np.abs(night - 2.9) < 0.2).mean()) > by_place[0]
    assert world.probability_moved("desk", monday + 4 * HOUR) < 0.5  # type: ignore[operator]
    kept, faded = (each.at(monday)["desk"].states for each in (world, replace(world, pieces=None)))
    near = [float((np.abs(states[:, 0] - 2.9) < 0.05).mean()) for states in (kept, faded)]
    assert near[0] > 1.25 * near[1]


def test_settings_that_say_how_often_furniture_is_moved_are_taken_at_their_word(
    furnished: WorldStore,
) -> None:
    still = Settings(objects=(ObjectRule(match="desk", dynamics=Dynamics(moves_per_hour=0)),))
    assert furnished.load(still).moves_of("desk") is None


def test_a_drive_expects_furniture_to_be_moved_by_day(furnished: WorldStore) -> None:
    world = furnished.load()
    day, night = (
        drive_settings(world, MONDAY + 14 * DAY + hour * HOUR).for_object("desk", "furniture")
        for hour in (12, 27)
    )
    assert day.dynamics.moves_per_hour > 3.0 * night.dynamics.moves_per_hour


def test_pieces_come_back_from_bytes(furnished: WorldStore) -> None:
    pieces = furnished.load().pieces
    assert pieces is not None
    site = pieces.sites["desk"]
    again = unpack_piece(pack_piece(site), "desk")
    assert np.array_equal(again.middles, site.middles)
    assert np.allclose(again.precision, site.precision, rtol=1e-6)
    assert (again.looks, again.fitted, again.taken) == (site.looks, site.fitted, site.taken)
    assert again.last is not None
    assert site.last is not None
    assert np.array_equal(again.last.variance, site.last.variance)
    assert unpack_piece(pack_piece(PieceSite.empty()), "desk").last is None


def test_exports_have_the_places_of_furniture(furnished: WorldStore) -> None:
    words = world_words(furnished.load(), "office", furnished.drives())["furniture_habits"]["desk"]
    assert len(words["places"]) == 2
    assert words["places"][0]["state"]["x"] == pytest.approx(2.9, abs=0.05)
    assert 0.5 < words["moves_per_day"]["lower"] < words["moves_per_day"]["upper"] < 10.0
    assert len(words["hours"]) == 48


def test_the_soonest_moment_for_a_task_follows_from_habits(furnished: WorldStore) -> None:
    world = furnished.load()
    task = Task(name="some", default=Allowed(x=0.02))
    by_habit = world.due(task, 86400.0)[0].due_ns
    by_settings = replace(world, pieces=None).due(task, 86400.0)[0].due_ns
    assert by_habit > by_settings


WARM = {"timezone": "Europe/Berlin", "warm": {"from": "05-01", "to": "09-30"}}


def test_habits_of_a_calendar_with_seasons_are_learnt_anew(tmp_path: Path) -> None:
    seasons = Settings(calendar=CalendarSettings.model_validate(WARM))
    store = taught(open_store(tmp_path / "world.db", BUILDING), range(3))
    assert store.load(seasons).habits is None  # those so far know none
    assert store.add(drive(3, seasons), [at_angle(0.0, MONDAY + 3 * DAY + HOUR)])
    world = store.load()
    assert world.habits is not None
    site = world.habits.sites["door"]
    assert (site.looks, site.seasons) == (3 * len(HOURS) + 1, True)
    assert season_word(world) == "cold"
    assert season_word(store.load(Settings())) is None
    taught(store, range(4, 6), seasons)
    again = store.load().habits
    assert again is not None
    assert again.sites["door"].looks == 5 * len(HOURS) + 1


def test_the_moves_of_a_door_are_told_by_a_mixture(store: WorldStore) -> None:
    world = store.load()
    assert world.habits is not None
    monday, latest, filter_ = date(2026, 1, 19), lately(world), world.filter_of("door")
    assert isinstance(filter_, LatticeFilter)
    forecast = of_moves(world.habits, filter_, world.history("door"))
    assert isinstance(forecast.habits, Mixture)
    gaussian = replace(forecast, habits=world.habits.forecast("door").habits)
    wide, narrow = (week_habit(each, monday) for each in (forecast, gaussian))
    of_latest = of_moves(world.habits, filter_, latest.history("door"))
    week = week_habit(of_latest, monday)
    assert week.shares[1].upper < 0.5  # what older looks told
    told = week_of(latest, "door")
    assert told.moves_per_day == week.moves_per_day
    assert told.shares == week_habit(world.habits.forecast("door"), monday).shares
    for each in (wide, narrow):
        assert each.shares[1].lower < 8 * 5 / 7 / 24 < each.shares[1].upper
    spread = [each.moves_per_day.upper / each.moves_per_day.lower for each in (wide, narrow)]
    assert spread[0] > 1.2 * spread[1]
    unseen = of_moves(world.habits, filter_, ())
    assert unseen is world.habits.forecast("door")
