"""How the probability of being localized follows from what scans are worth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from objstate.config import Settings
from objstate.estimator.bank import Alike, Bank, Moment, Seen
from objstate.localization import Hypotheses
from objstate.localization.anywhere import Anywhere, Chance
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.estimator.drives import START, corridor
from tests.rooms import fan, observed, scan_of

SECOND = 10**9
CHANCE = Chance(mean=-20.0, most=0.0, usual=-1.5, best=4.0)
PLACE = np.zeros(3)
NOTHING_ALIKE = Alike(0.0, 0.0)


def moment(seconds: float) -> Moment[str]:
    scan = scan_of(np.full(3, 1.0), fan(3), round(seconds * SECOND))
    return Moment(scan, PLACE, PLACE, f"at {seconds:g} s")


def after(advantages: list[float], every_s: float = 0.5) -> Bank[str]:
    bank = Bank(Settings(), "at first")
    for k, advantage in enumerate(advantages):
        bank.take(moment(k * every_s), CHANCE.mean + advantage, CHANCE)
        bank.publish(1.0, round(k * every_s * SECOND))
    return bank


def found(log_odds: float, outside: float = -50.0) -> Hypotheses:
    place = np.array([[5.0, 0.0, 0.0]])
    return Hypotheses(PLACE, place, np.array([log_odds]), np.array([False]), 0, outside)


def test_scans_that_a_place_explains_make_it_surer() -> None:
    assert after([12.0] * 4).p_localized > after([12.0]).p_localized > 0.99


def test_a_stretch_that_nothing_explains_makes_lost_only_if_it_lasts() -> None:
    right = [12.0] * 10
    assert after(right + [0.0] * 20).p_localized > 0.9  # 10 s
    assert after(right + [0.0] * 400).p_localized < 0.5  # 200 s
    assert after(right + [0.0] * 400 + [12.0] * 10).p_localized > 0.5


def test_a_wide_belief_is_not_localized() -> None:
    bank = after([12.0] * 4)
    bank.publish(0.3, 2 * SECOND)
    assert bank.p_localized < 0.31
    assert bank.is_lost
    bank.publish(1.0, 4 * SECOND)
    assert bank.stretches(5 * SECOND) == ((2 * SECOND, 4 * SECOND),)
    (probability,) = bank.probabilities
    assert probability == pytest.approx(0.7, abs=0.01)


@pytest.mark.parametrize(
    ("stretches", "joined"),
    [
        ([], []),
        ([(1, 4)], [(1, 4)]),
        ([(1, 4), (6, 9)], [(1, 9)]),
        ([(1, 4), (8, 9)], [(1, 4), (8, 9)]),
        ([(1, 4), (6, 7)], [(1, 4), (6, 7)]),
        ([(1, 4), (6, 9), (10, 12)], [(1, 12)]),
    ],
)
def test_between_two_longer_stretches_the_robot_is_lost_too(
    stretches: list[tuple[int, int]], joined: list[tuple[int, int]]
) -> None:
    bank = after([12.0])
    for second in range(1, 13):
        is_lost = any(begin <= second < end for begin, end in stretches)
        bank.publish(0.3 if is_lost else 1.0, second * SECOND)
    expected = [(begin * SECOND, end * SECOND) for begin, end in joined]
    assert list(bank.stretches(12 * SECOND)) == expected
    assert len(bank.probabilities) == len(expected)


def test_a_start_that_explains_its_scans_badly_is_searched_for() -> None:
    assert not after([18.0] * 6).may_search(60 * SECOND, 1.0)
    assert after([8.0] * 2).may_search(60 * SECOND, 1.0)


@pytest.mark.parametrize(("keyframes", "is_sought_again"), [(1, True), (12, False)])
def test_a_search_by_few_keyframes_may_have_missed_the_robots_place(
    keyframes: int, is_sought_again: bool
) -> None:
    bank, other = after([8.0] * 3), replace(found(-20.0), keyframes=keyframes)
    bank.weigh(other, 0, NOTHING_ALIKE, 2 * SECOND)
    assert bank.may_search(60 * SECOND, 1.0) is is_sought_again


def test_a_search_is_made_when_scans_fit_less_than_usual() -> None:
    bank = Bank(Settings(), "at first")

    def searches(first: int, advantages: list[float]) -> int:
        count = 0
        for now, advantage in enumerate(advantages, start=first):
            bank.take(moment(now), CHANCE.mean + advantage, CHANCE)
            if bank.may_search(now * SECOND, 1.0):
                nothing = replace(found(-20.0), keyframes=12)
                bank.weigh(nothing, 0, NOTHING_ALIKE, now * SECOND)
                count += 1
        return count

    assert 1 <= searches(0, [12.0] * 20) <= 3  # a start that explains 60 %
    assert searches(20, [12.0] * 40) == 0
    assert searches(60, [1.0] * 4) >= 1


@pytest.mark.parametrize(
    ("log_odds", "outside", "is_lost", "is_surer"),
    [
        (-5.0, -50.0, False, False),
        (1.0, -50.0, True, False),
        (9.0, -50.0, True, True),
        (9.0, 9.0, True, False),
    ],
)
def test_another_place_is_followed_only_if_it_is_surely_likelier(
    log_odds: float, outside: float, is_lost: bool, is_surer: bool
) -> None:
    bank, other = after([12.0] * 10), found(log_odds, outside)
    assert bank.weigh(other, 0, NOTHING_ALIKE, 5 * SECOND) is is_surer
    assert bank.is_lost is is_lost
    if is_surer:
        bank.follow(other, 0, "before", 4 * SECOND)
        bank.publish(1.0, 5 * SECOND)
        assert bank.p_localized > 0.99
        assert bank.before == "before"
        assert bank.stretches(6 * SECOND) == ((4 * SECOND, 5 * SECOND),)


def test_a_robot_that_is_found_where_odometry_leads_was_never_elsewhere() -> None:
    bank, place = after([12.0] * 10), np.array([5.0, 0.0, 0.0])
    bank.follow(found(9.0), 0, "before", 4 * SECOND)
    bank.publish(1.0, 5 * SECOND)
    for k in range(4):
        on = replace(moment(6.0 + k), odometry=np.array([1.0, 0.0, 0.0]), followed=place)
        bank.take(on, CHANCE.mean + 12.0, CHANCE)
    assert bank.departure(np.array([4.0, 0.0, 0.0])) is None
    left = bank.departure(np.array([1.1, 0.0, 0.0]))
    assert left is not None
    assert (left.since_ns, left.kept) == (4 * SECOND, "before")
    bank.follow(found(9.0), 0, left.kept, left.since_ns)
    assert bank.stretches(9 * SECOND) == ((4 * SECOND, 9 * SECOND + 1),)
    assert {each.stamp_ns < 4 * SECOND for each in bank.moments} == {True}


def test_a_place_like_a_part_that_the_map_may_lack_is_not_followed() -> None:
    bank, other = after([12.0] * 10), found(20.0)
    assert not bank.weigh(other, 0, Alike(now=1.0, before=0.0), 5 * SECOND)
    assert bank.is_lost
    # since it has come back, the robot is where it was followed
    assert not bank.weigh(other, 0, Alike(now=0.0, before=100.0), 5 * SECOND)
    assert bank.p_localized == pytest.approx(100.0 / 101.0, abs=0.001)


def test_the_more_was_seen_the_less_a_part_that_the_map_lacks_looks_like_a_place() -> None:
    bank = after([12.0] * 10)

    def alike(
        *,
        s: float = 2.0,
        far: float = 1.0,
        area: float = 8.0,
        gained: float = 0.0,
        wall: bool = False,
    ) -> Alike:
        seen = Seen(*(np.linspace(0.0, last, 3) for last in (s, far, area)), is_through=wall)
        return bank.alike(seen, np.array([gained, gained, 0.0]))

    assert alike() > alike(s=5.0)
    assert alike().now > alike(far=5.0).now
    assert alike() > alike(area=16.0)
    assert alike(gained=1.0).before > alike().before
    assert alike(gained=1.0).now == alike().now
    assert alike(wall=True) > alike()  # nobody goes through a wall that is there


def test_an_interval_of_being_lost_begins_before_it_ends() -> None:
    bank = after([12.0] * 4)
    bank.lose(2 * SECOND + 1)
    bank.publish(1.0, 2 * SECOND)  # another place won with the scan of that moment
    assert bank.stretches(3 * SECOND) == ()


def test_a_scan_is_worth_more_where_it_was_taken_than_anywhere() -> None:
    place = corridor()
    sensing = Sensing(place, BeamModel(Settings().beam_model))
    anywhere = Anywhere(sensing, Settings())
    scan = observed(ExpectedRanges(place), {}, START, fan(48), np.random.default_rng(0))
    chance = anywhere.chance(scan, anywhere.usable(scan))
    view = sensing.view(scan)
    here = 0.1 * float(view.pose_log_likelihood(START[None], 0.1, [])[0])
    assert chance.usual <= 0.0 <= chance.best
    assert chance.mean + chance.best < here
    assert here == pytest.approx(chance.most, abs=3.0)
