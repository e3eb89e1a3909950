"""Some minutes in the office."""

import numpy as np
import pytest

from objstate.building.model import Kind
from objstate.experiments.office_day import Trial, Worth, saving, try_day
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


def test_the_saving_is_read_off_where_both_know_the_same() -> None:
    def worth(strategy: str, knob: float, distance: float, entropy: float) -> Worth:
        trial = Trial(strategy, knob, 0, 1.0)
        return Worth(trial, distance, entropy, 0.5, 0.0, 0.0, 1, {}, 0)

    found = [
        *(worth("coordinator", k, 100.0 + 100.0 * k, -k) for k in range(3)),
        *(worth("random", k, 200.0 + 200.0 * k, -k) for k in range(3)),
        *(worth("fixed round", k, 900.0, -0.1 * k) for k in range(3)),
    ]
    assert saving(found, lambda each: each.entropy) == pytest.approx(0.5)
