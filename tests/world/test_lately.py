"""A world loaded for a planner answers as the whole one does; history is thinned as the rule says."""

import pytest

from objstate.errors import WorldError
from objstate.world import Thinning
from objstate.world.forgetting import DAY_NS, HOUR_NS
from objstate.world.lately import Lately
from objstate.world.store import DriveEntry, open_store
from tests.world.examples import BUILDING, HOUR, SECOND, at_angle, desk_at
from tests.world.test_store import MONDAY, ON_MONDAY, ON_TUESDAY, TUESDAY, same

MINUTE = 60 * SECOND


def test_the_newest_beliefs_answer_as_all_of_them_do(place: str) -> None:
    store = open_store(place, BUILDING)
    assert store.load(newest=True).latest_ns is None
    store.add(TUESDAY, ON_TUESDAY)
    store.add(MONDAY, ON_MONDAY)
    whole, lately = store.load(), store.load(newest=True)
    assert isinstance(lately.histories, Lately)
    assert lately.latest_ns == whole.latest_ns
    assert same(whole, lately, range(0, 30 * HOUR, HOUR))
    for name in ("door", "desk"):
        stamps = [[b.stamp_ns for b in world.history(name)] for world in (whole, lately)]
        assert stamps[0] == stamps[1]
    more = [world.with_beliefs([at_angle(0.7, 27 * HOUR)]) for world in (whole, lately)]
    assert same(*more, range(24 * HOUR, 30 * HOUR, HOUR))


def test_what_is_at_hand_needs_no_database(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    store = open_store(place, BUILDING)
    store.add(MONDAY, ON_MONDAY)
    lately = store.load(newest=True)
    asked: list[str] = []
    read = lately.histories._read
    monkeypatch.setattr(lately.histories, "_read", lambda name: asked.append(name) or read(name))
    assert lately.at()["door"].mean[0] == pytest.approx(0.3, abs=0.01)
    assert asked == []
    assert lately.at(HOUR)["door"].mean[0] == pytest.approx(0.2, abs=0.01)
    assert lately.at(HOUR)["door"].mean[0] == pytest.approx(0.2, abs=0.01)
    assert asked == ["door"]


def test_later_drives_do_not_change_it(place: str) -> None:
    store = open_store(place, BUILDING)
    store.add(MONDAY, ON_MONDAY)
    before = store.load(newest=True)
    store.add(DriveEntry("more", 1 * HOUR, 3 * HOUR), [at_angle(1.4, HOUR + MINUTE)])
    assert [b.stamp_ns for b in before.history("door")] == [1 * HOUR, 2 * HOUR]


def test_history_is_thinned_by_its_age_and_the_newest_stays(place: str) -> None:
    store = open_store(place, BUILDING)
    day, rule = 24 * HOUR, Thinning(all_days=1, hourly_days=3)
    now = 10 * day
    kept = {
        now - MINUTE: True,
        now - 2 * MINUTE: True,  # younger than a day: all
        now - 2 * day + 40 * MINUTE: True,  # younger than three: the last of each hour
        now - 2 * day + 20 * MINUTE: False,
        now - 2 * day + 80 * MINUTE: True,
        now - 5 * day + 3 * HOUR: True,  # the last of each day
        now - 5 * day + 2 * HOUR: False,
        now - 6 * day: True,
    }
    beliefs = [at_angle(0.1, stamp) for stamp in kept]
    old = [desk_at(3.0, HOUR), desk_at(3.1, 2 * HOUR)]
    store.add(DriveEntry("all", 0, now), [*beliefs, *old])
    assert store.thin(rule, now) == 3
    world = store.load()
    assert [b.stamp_ns for b in world.history("door")] == sorted(s for s, k in kept.items() if k)
    assert [b.stamp_ns for b in world.history("desk")] == [2 * HOUR]
    assert store.thin(rule, now) == 0
    assert (HOUR, day) == (HOUR_NS, DAY_NS)


def test_a_rule_that_contradicts_itself_is_refused() -> None:
    with pytest.raises(WorldError, match="below"):
        Thinning(all_days=40, hourly_days=30)
