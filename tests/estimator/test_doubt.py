"""When a robot counts as lost, when it is searched for, and on what the searches must agree."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.config import Settings
from objstate.estimator.doubt import Doubt, Verdict
from objstate.estimator.tracking import Track, TrackRecord
from objstate.geometry import compose
from objstate.localization import Hypotheses, PoseBelief
from objstate.particles import Weights

SECOND = 10**9
SETTINGS = Settings()
HERE, THERE = np.array([1.0, 2.0, 0.5]), np.array([9.0, 2.0, 0.5])


def found(*poses: np.ndarray, shares: tuple[float, ...], looks: int = 1) -> Hypotheses:
    return Hypotheses(np.zeros(3), np.array(poses), np.array(shares), looks)


def track() -> Track:
    return Track(PoseBelief(HERE[None], Weights.uniform(1)))


def test_a_stretch_begins_when_the_track_last_fitted_and_ends_when_found() -> None:
    doubt = Doubt(SETTINGS)
    doubt.dispel(3 * SECOND)
    doubt.rise(5 * SECOND)
    assert doubt.is_lost
    assert doubt.stretches(6 * SECOND) == ((3 * SECOND, 6 * SECOND),)
    doubt.found(8 * SECOND)
    assert not doubt.is_lost
    assert doubt.stretches(9 * SECOND) == ((3 * SECOND, 8 * SECOND),)


def test_a_robot_that_was_where_it_thought_was_lost_all_the_same() -> None:
    """What it learnt of objects meanwhile was taken back; the next time is another."""
    doubt = Doubt(SETTINGS)
    doubt.dispel(10)
    doubt.rise(20)
    doubt.settle(30)
    assert not doubt.is_lost
    assert doubt.stretches(35) == ((10, 30),)
    doubt.settle(40)
    assert doubt.stretches(45) == ((10, 30),)
    doubt.rise(50)
    assert doubt.stretches(55) == ((10, 30), (40, 55))


def test_only_searches_in_a_row_that_are_sure_of_one_place_win() -> None:
    doubt = Doubt(SETTINGS)
    doubt.rise(0)
    shares = [(THERE, 0.5), (THERE, 1.0), (HERE, 1.0), (THERE, 0.6), (THERE, 1.0)]
    for second, (place, share) in enumerate(shares):
        rest = THERE + 5.0
        verdict = doubt.weigh(
            found(place, rest, shares=(share, 1.0 - share)), HERE, second * SECOND
        )
        assert verdict is Verdict.OPEN
    step = np.array([2.0, 0.0, 0.0])
    doubt.drive(step)
    again = found(compose(THERE, step), shares=(1.0,))
    assert doubt.weigh(again, compose(HERE, step), 5 * SECOND) is Verdict.ELSEWHERE


@pytest.mark.parametrize(
    ("shares", "verdict"),
    [
        ((0.6, 0.4), Verdict.HERE),
        ((0.05, 0.95), Verdict.OPEN),
        ((0.4, 0.6), Verdict.OPEN),
    ],
)
def test_a_track_in_doubt_that_no_search_excludes_isnt_lost(
    shares: tuple[float, float], verdict: Verdict
) -> None:
    poses = [
        pose for _, pose in sorted(zip(shares, (HERE, THERE), strict=True), key=lambda p: -p[0])
    ]
    ordered = tuple(sorted(shares, reverse=True))
    even = Settings.model_validate({"search": {"track_odds": 1.0}})
    assert Doubt(even).weigh(found(*poses, shares=ordered), HERE, 0) is verdict


def test_two_searches_in_a_row_that_exclude_the_track_lose_it() -> None:
    doubt, rivals = Doubt(SETTINGS), found(THERE, THERE + 5.0, HERE, shares=(0.5, 0.5, 0.0))
    assert doubt.weigh(rivals, HERE, 0) is Verdict.OPEN
    assert doubt.may_search(SECOND // 2)
    assert doubt.weigh(rivals, HERE, SECOND // 2) is Verdict.NOT_HERE


def test_a_track_that_was_wide_is_one_of_the_places_near_by_until_a_search_is_sure_of_it() -> None:
    doubt = Doubt(SETTINGS)
    aside, far = (HERE + np.array([off, 0.0, 0.0]) for off in (1.5, 60.0))
    doubt.settle(0)
    assert not doubt.is_new
    doubt.blur(1.0)
    assert doubt.is_new
    tied = found(HERE, aside, far, shares=(0.4, 0.3, 0.3), looks=3)
    assert doubt.weigh(tied, HERE, 60 * SECOND) is Verdict.OPEN
    assert doubt.weigh(tied, HERE, 61 * SECOND) is Verdict.NOT_HERE
    doubt.found(62 * SECOND)
    doubt.blur(1.0)
    far_or_here = found(
        HERE, far, shares=(0.6, 0.4), looks=3
    )  # who was followed is none of the far places
    assert doubt.weigh(far_or_here, HERE, 120 * SECOND) is Verdict.OPEN
    assert doubt.weigh(far_or_here, HERE, 121 * SECOND) is Verdict.HERE


def test_one_search_that_another_contradicts_loses_nobody() -> None:
    doubt = Doubt(SETTINGS)
    for second, share in enumerate((1e-9, 0.5, 1e-9, 0.5)):
        hypotheses = found(THERE, HERE, THERE + 5.0, shares=(0.5, share, 0.5 - share))
        assert doubt.weigh(hypotheses, HERE, second * SECOND) is not Verdict.NOT_HERE


def test_each_search_in_vain_doubles_the_wait_until_the_track_fits_again() -> None:
    doubt, now, waits = Doubt(SETTINGS), 0, []
    for _ in range(3):
        doubt.settle(now)
        assert not doubt.is_lost
        since = now
        while not doubt.may_search(now):
            now += SECOND // 10
        waits.append((now - since) / SECOND)
    assert waits[1] / waits[0] == waits[2] / waits[1] == 2.0
    doubt.dispel(now)
    assert doubt.may_search(now)


def test_what_was_learnt_is_trusted_only_after_a_while() -> None:
    doubt = Doubt(SETTINGS)
    trusted = [doubt.dispel(k * SECOND // 10) for k in range(1, 101)]
    assert 1 < sum(trusted) < 10


def test_short_readings_of_some_beams_are_no_sign_of_a_wrong_place_but_of_all_are() -> None:
    """People leave a third of the beams alone."""
    s, crowded, wrong = SETTINGS.localization, TrackRecord(), TrackRecord()
    for k in range(1, 40):
        crowded = crowded.judged(0.0, 0.65, k * SECOND // 5, s)
        wrong = wrong.judged(0.0, 0.05, k * SECOND // 5, s)
        assert not crowded.is_wrong(s)
    assert wrong.is_wrong(s)
    assert not wrong.fits(s)


def test_beams_through_walls_are_a_reason_to_search_but_alone_none_to_be_lost() -> None:
    """However well the others fit: the walls of a map may be gone, or of glass."""
    s, each = SETTINGS.localization, TrackRecord()
    for k in range(1, 60):
        each = each.judged(0.3, 0.7, k * SECOND // 5, s)
    assert not each.fits(s)
    assert not each.is_wrong(s)


def test_a_track_that_was_followed_is_left_only_for_much_better_places() -> None:
    odds = SETTINGS.search.track_odds
    for share, verdict in ((10.0 / odds, Verdict.HERE), (1e-4 / odds, Verdict.ELSEWHERE)):
        hypotheses, doubt = found(THERE, HERE, shares=(1.0 - share, share)), Doubt(SETTINGS)
        doubt.weigh(hypotheses, HERE, 0)
        assert doubt.weigh(hypotheses, HERE, SECOND) is verdict


def test_a_told_pose_ends_the_stretch_and_is_as_unconfirmed_as_the_first() -> None:
    doubt = Doubt(SETTINGS)
    doubt.start_anew(0)
    assert doubt.stretches(SECOND) == ()
    doubt.settle(SECOND)
    doubt.dispel(3 * SECOND)
    doubt.rise(5 * SECOND)
    doubt.start_anew(6 * SECOND)
    assert not doubt.is_lost
    assert doubt.is_new
    assert doubt.may_search(6 * SECOND)
    assert doubt.stretches(9 * SECOND) == ((3 * SECOND, 6 * SECOND),)
    doubt.rise(8 * SECOND)  # it was told wrongly
    assert doubt.stretches(9 * SECOND) == ((3 * SECOND, 6 * SECOND), (6 * SECOND, 9 * SECOND))
