"""How often furniture is moved, and to which places."""

import math
from datetime import date

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.geometry import FloatArray
from objstate.habits.building import PieceHabits
from objstate.habits.calendar import NANOSECONDS, Calendar
from objstate.habits.moves import MoveDesign, Moves, Spans
from objstate.habits.piece import REPEATED, PieceSite, Places, Sighting, beside, shared
from objstate.habits.summary import week_moves

HOUR = 3600 * NANOSECONDS
MONDAY = 18267 * 24 * HOUR  # 6 January 2020
DESIGN, NEXT = MoveDesign(), date(2020, 2, 3)
HERE, THERE = np.array([1.0, 2.0, 0.1]), np.array([4.0, 2.0, -1.0])
ROOM = Places(np.array([0.95]), np.array([[2.5, 2.5, 0.0]]), np.array([[9.0, 9.0, 3.0]]), 0.05)


def as_it_is(states: FloatArray, _: float) -> FloatArray:
    return states


def seen(hour: float, state: FloatArray | None, seed: int = 0) -> Sighting:
    off = 0.005 * np.random.default_rng([seed, int(60 * hour)]).standard_normal(3)
    at = MONDAY + round(hour * HOUR)
    return Sighting(at, None if state is None else state + off, np.full(3, 0.005**2))


def taught(looks: list[Sighting]) -> PieceSite:
    return PieceSite.fitted_to(Calendar(), looks, lambda _: ROOM, as_it_is)


def moved_at_ten(days: int) -> list[Sighting]:
    """A chair that is moved between two places at ten of two working days in five, seen every two hours."""
    looks = []
    for hour in range(1, 24 * days, 2):
        moves = sum(day % 7 in (1, 4) and 24 * day + 10 <= hour for day in range(days))
        looks.append(seen(hour, (HERE, THERE)[moves % 2]))
    return looks


def of(site: PieceSite) -> Moves:
    return PieceHabits(Calendar(), {"a": site}, {"a": "chair"}, MoveDesign).forecast("a")


def test_it_is_moved_at_the_hours_at_which_it_was() -> None:
    site = taught(moved_at_ten(21))
    week = week_moves(of(site), NEXT)
    assert week.moves_per_day.lower < 2 / 7 < week.moves_per_day.upper
    hours = {(h.kind, h.hour): h.moves_per_hour.value for h in week.hours}
    assert hours["working", 10] > 5.0 * hours["working", 2]
    assert hours["working", 10] > 5.0 * hours["free", 10]
    day = of(site).stays(MONDAY + 28 * 24 * HOUR + 8 * HOUR, MONDAY + 28 * 24 * HOUR + 12 * HOUR)
    night = of(site).stays(MONDAY + 28 * 24 * HOUR, MONDAY + 28 * 24 * HOUR + 4 * HOUR)
    assert day < 0.8
    assert night > 0.95


def test_its_places_are_those_where_it_stood_as_often_as_it_came() -> None:
    site = taught(moved_at_ten(21))
    assert len(site.middles) == 2
    assert np.abs(site.middles - [HERE, THERE]).max() < 0.02
    assert site.arrivals.tolist() == [4.0, 3.0]
    assert site.taken == 0.0


def test_what_is_away_was_taken() -> None:
    looks = [seen(1, HERE), seen(2, HERE), seen(3, None), seen(4, None), seen(30, THERE)]
    site = taught(looks)
    assert site.taken == 1.0
    assert len(site.arrivals) == 2
    assert site.next(ROOM).away == pytest.approx((1.0 + 0.05) / 4.0)


def test_a_piece_that_stands_still_is_expected_to() -> None:
    still = taught([seen(hour, HERE) for hour in range(0, 21 * 24, 6)])
    assert of(still).stays(MONDAY, MONDAY + 24 * HOUR) > 0.9
    assert len(still.arrivals) == 1


def test_drive_after_drive_tells_about_what_all_tell_together() -> None:
    looks, site = moved_at_ten(14), PieceSite.empty()
    for k in range(0, len(looks), 12):
        site = site.with_looks(Calendar(), looks[k : k + 12], lambda _: ROOM, as_it_is)
    all_ = taught(looks)
    assert site.looks == all_.looks == len(looks)
    assert site.arrivals.tolist() == all_.arrivals.tolist()
    rates = [week_moves(of(each), NEXT).moves_per_day.value for each in (site, all_)]
    assert rates[0] == pytest.approx(rates[1], rel=0.6)


def nudged(state: FloatArray | None) -> Places:
    """As often near where it stood as anywhere."""
    if state is None:
        return ROOM
    near = Places(np.ones(1), state[None], np.array([[0.1, 0.1, math.radians(20.0)]]) ** 2, 0.0)
    return Places.mixed([(1.0, near), (1.0, ROOM)])


def turned(hour: float, degrees: float, std: float) -> Sighting:
    """A piece that stands at a yaw, as a look told by so many degrees."""
    state = np.array([5.0, -0.4, math.radians(degrees)])
    variance = np.array([0.005, 0.005, math.radians(std)]) ** 2
    return Sighting(MONDAY + round(hour * HOUR), state, variance)


def test_a_turn_is_a_move_however_unsure_the_looks_meanwhile_were() -> None:
    looks = [turned(8, 172.0, 0.3), turned(9, 172.0, 0.3), turned(10, 166.0, 7.0)]
    looks += [turned(11, 158.0, 7.0), turned(12, 150.0, 7.0)]
    looks += [turned(13, 142.0, 0.4), turned(14, 142.0, 0.4)]
    site = PieceSite.fitted_to(Calendar(), looks, nudged, as_it_is)
    assert site.arrivals.tolist() == [1.0, 1.0]
    assert np.degrees(site.middles[:, 2]) == pytest.approx([172.0, 142.0], abs=2.0)
    still = [turned(hour, 172.0, 0.3) for hour in range(8, 15)]
    same = PieceSite.fitted_to(Calendar(), still, nudged, as_it_is)
    span = MONDAY + 24 * HOUR, MONDAY + 48 * HOUR
    assert of(site).stays(*span) < 0.5 * of(same).stays(*span)


@pytest.mark.parametrize("seed", range(5))
def test_what_drives_differ_by_is_no_move(seed: int) -> None:
    rng = np.random.default_rng(seed)
    looks = []
    for hour in range(0, 21 * 24, 6):
        sure = rng.choice([0.2, 1.0])  # some looks are far less sure
        std = np.array([0.02, 0.02, math.radians(7.0)]) * sure
        off = np.hypot(REPEATED / math.sqrt(2.0), std) * rng.standard_normal(3)
        looks.append(Sighting(MONDAY + hour * HOUR, HERE + off, std**2))
    site = PieceSite.fitted_to(Calendar(), looks, nudged, as_it_is)
    assert site.arrivals.tolist() == [1.0]
    assert np.abs(site.middles[0] - HERE).max() < 0.05


def test_a_place_is_where_all_looks_at_a_stay_saw_the_piece() -> None:
    looks = [turned(1, 130.0, 10.0)] + [turned(hour, 140.0, 0.3) for hour in range(2, 6)]
    site = PieceSite.fitted_to(Calendar(), looks, nudged, as_it_is)
    assert np.degrees(site.middles[:, 2]) == pytest.approx([140.0], abs=0.5)
    assert site.squares == pytest.approx(np.zeros((1, 3)), abs=1e-12)
    away = turned(6, 0.0, 0.3)
    back = [turned(hour, 146.0, 0.3) for hour in range(7, 9)]
    again = PieceSite.fitted_to(Calendar(), [*looks, away, *back], nudged, as_it_is)
    assert again.arrivals.tolist() == [2.0, 1.0]
    assert math.degrees(again.middles[0, 2]) == pytest.approx(143.0, abs=0.5)
    assert math.degrees(again.squares[0, 2] ** 0.5) == pytest.approx(18.0**0.5, abs=0.5)


def test_looks_of_the_past_tell_nothing_of_moves() -> None:
    site = taught([seen(10, HERE), seen(12, HERE)])
    late = site.with_looks(Calendar(), [seen(5, THERE)], lambda _: ROOM, as_it_is)
    assert late.arrivals.tolist() == site.arrivals.tolist()
    assert late.looks == site.looks + 1
    assert np.array_equal(late.pull, site.pull)


def test_pieces_of_a_form_change_places() -> None:
    one, other = taught([seen(1, HERE)]), taught([seen(1, THERE)])
    alone, beside = one.next(ROOM), one.next(shared([other], ROOM))
    swapped = seen(9, THERE)
    assert beside.density(swapped, as_it_is) > 5.0 * alone.density(swapped, as_it_is)
    for each in (alone, beside):
        assert each.weights.sum() + each.away == pytest.approx(1.0)


def test_where_another_form_stood_is_half_of_what_is_new() -> None:
    one, table = taught([seen(1, HERE)]), taught([seen(1, THERE)])
    new = beside([table], ROOM)
    assert new.weights.sum() + new.away == pytest.approx(1.0)
    swapped = seen(9, THERE)
    assert new.density(swapped, as_it_is) > 5.0 * ROOM.density(swapped, as_it_is)
    anywhere = seen(9, np.array([0.5, 4.5, 2.0]))
    assert new.density(anywhere, as_it_is) == pytest.approx(0.5 * ROOM.density(anywhere, as_it_is))
    alone, among = one.next(ROOM), one.next(new)
    assert among.density(swapped, as_it_is) > 5.0 * alone.density(swapped, as_it_is)
    for others in ([], [PieceSite.empty()]):
        assert beside(others, ROOM) is ROOM


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.01, 100.0))
def test_the_score_is_the_slope_of_the_log_likelihood(seed: int, odds: float) -> None:
    rng = np.random.default_rng(seed)
    seconds = np.where(rng.random((4, len(DESIGN.matrix))) < 0.05, 900.0, 0.0)
    seconds[:, 0] += 60.0
    spans = Spans(DESIGN, seconds, odds ** rng.choice([-1.0, 1.0], 4))
    theta = DESIGN.mean + 0.3 * rng.standard_normal(len(DESIGN.mean))
    along = rng.standard_normal(len(theta))
    found, step = spans.evidence(theta), 1e-5
    up, down = (spans.evidence(theta + sign * step * along).log_likelihood for sign in (1, -1))
    assert found.score @ along == pytest.approx((up - down) / (2 * step), rel=1e-4, abs=1e-7)
    assert np.linalg.eigvalsh(found.information).min() > -1e-9


def test_what_chairs_do_is_expected_of_another_chair() -> None:
    still = taught([seen(hour, HERE) for hour in range(0, 21 * 24, 6)])
    busy, new = taught(moved_at_ten(21)), taught([seen(1, HERE), seen(2, HERE)])
    stays = []
    for others in (still, busy):
        sites = {"new": new, "b": others, "c": others}
        habits = PieceHabits(Calendar(), sites, dict.fromkeys(sites, "chair"), MoveDesign)
        stays.append(habits.forecast("new").stays(MONDAY, MONDAY + 24 * HOUR))
    assert stays[1] < stays[0]
