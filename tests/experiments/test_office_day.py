"""Some minutes in the office."""

from pathlib import Path

import numpy as np
import pytest

from objstate.building.model import Kind
from objstate.experiments.office_day import Trial, Worth, savings, try_day, write
from objstate.experiments.office_day.office import office, working_day
from objstate.gaze import Floor


def test_the_office_has_thirty_doors_and_twenty_chests_that_fit() -> None:
    place = office(np.random.default_rng(0))
    kinds = [each.kind for each in place.building.objects.values()]
    assert (kinds.count(Kind.HINGED), kinds.count(Kind.PLANAR)) == (30, 20)
    assert set(place.rates) == set(place.building.objects)


def test_a_robot_in_the_corridor_reaches_no_room_where_doors_are_walls() -> None:
    place = office(np.random.default_rng(0))
    shut, free = Floor.of(place.shut), Floor.of(place.building)
    corridor, room = np.array([1.5, 5.0]), np.array([1.5, 8.0])
    assert shut.pieces[shut.nearest(corridor)] != shut.pieces[shut.nearest(room)]
    assert free.pieces[free.nearest(corridor)] == free.pieces[free.nearest(room)]


def test_a_day_moves_what_moves_often_more_often() -> None:
    place = office(np.random.default_rng(0))
    day = working_day(place, 8.0, np.random.default_rng(1))
    moves = {name: len(history.swings) for name, history in day.items()}
    busy = [moves[name] for name, rate in place.rates.items() if rate == 3.0]
    idle = [moves[name] for name, rate in place.rates.items() if rate == 0.05]
    assert np.mean(busy) == pytest.approx(24.0, rel=0.25)
    assert np.mean(idle) < 2.0


def test_looking_ends_with_recorded_outcomes() -> None:
    worth = try_day(Trial("greedy nearest", 1200.0, 0, 0.02))
    assert worth.tasks == sum(worth.outcomes.values()) > 0
    assert set(worth.outcomes) <= {"confirmed", "moved", "lost", "hidden"}
    assert worth.distance > 0.0
    assert worth.lost == 0


def test_what_the_coordinator_promises_is_of_the_size_of_what_is_kept() -> None:
    worth = try_day(Trial("coordinator", 1.1, 21, 0.15))
    assert worth.tasks > 5
    assert 0.4 < worth.realized / worth.predicted < 2.5


def worth(strategy: str, knob: float, distance: float, entropy: float, seed: int = 1) -> Worth:
    path = np.array([[2.0, 5.0, 0.0], [20.0, 5.0, 0.0]])
    trial = Trial(strategy, knob, seed, 1.0)
    return Worth(trial, distance, entropy, 0.5, 0.0, 0.0, 1, {"confirmed": 1}, 0, path)


def test_the_saving_is_read_off_where_both_know_the_same() -> None:
    found = [
        *(worth("coordinator", k, 100.0 + 100.0 * k, -k) for k in range(3)),
        *(worth("random", k, 200.0 + 200.0 * k, -k) for k in range(3)),
        *(worth("fixed round", k, 900.0, -0.1 * k) for k in range(3)),
        worth("oldest first", 0, 50.0, 5.0),
    ]
    saved = savings(found, lambda each: each.entropy)
    assert [each.knob for each in saved] == [0, 1, 2]
    assert [each.share for each in saved] == pytest.approx([0.5, 0.5, 0.5])
    assert {each.strategy for each in saved} == {"random"}


def test_where_nobody_else_knows_as_much_nothing_is_said() -> None:
    found = [worth("coordinator", 1.0, 100.0, -9.0), worth("random", 1.0, 100.0, 0.0)]
    (saved,) = savings(found, lambda each: each.entropy)
    assert np.isnan(saved.share)


def test_days_count_by_their_mean() -> None:
    found = [
        *(worth("coordinator", 1.0, 40.0 * day, -3.0 * day, day) for day in (1, 3)),
        *(worth("random", 1.0, 50.0 * day, -day, day) for day in (1, 3)),
        *(worth("random", 2.0, 100.0 * day, -5.0 * day, day) for day in (1, 3)),
    ]
    (saved,) = savings(found, lambda each: each.entropy)
    assert saved.own == 80.0
    assert saved.best == pytest.approx(150.0)


def test_a_comparison_is_written_with_pictures(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    names = ("coordinator", "greedy nearest", "fixed round")
    found = [worth(name, k, 100.0 * k, -k) for name in names for k in (1.0, 2.0)]
    write(found, tmp_path / "out")
    files = {each.name for each in (tmp_path / "out").iterdir()}
    assert files >= {"trials.csv", "curves.png", "paths.png"}
    rows = (tmp_path / "out" / "trials.csv").read_text().splitlines()
    assert len(rows) == 1 + len(found)
    assert rows[1].startswith("coordinator,1.0,1,1.0,100.0000,-1.0000")
