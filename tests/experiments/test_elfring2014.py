"""The simulations of section 7, small."""

from dataclasses import replace

import numpy as np
import pytest

from objstate.experiments.elfring2014 import (
    Assumptions,
    CatSetup,
    Setup,
    claims,
    follow,
    reproduce,
    simulate,
    verifications,
)
from objstate.experiments.tours import shortest_tour
from objstate.gaze.sensors import ALL_ROUND

SHORT = Setup(duration=120.0)


def test_a_run_repeats_itself() -> None:
    first, second = (simulate(SHORT, 3) for _ in range(2))
    assert (first.entropies == second.entropies).all()
    assert (first.robot == second.robot).all()


def test_strategies_meet_the_same_room() -> None:
    fixed = simulate(replace(SHORT, strategy="fixed path"), 3)
    assert (fixed.objects == simulate(SHORT, 3).objects).all()
    assert (fixed.robot[0] == simulate(SHORT, 3).robot[0]).all()


def test_the_fixed_path_approaches_all_alike() -> None:
    course = simulate(replace(SHORT, strategy="fixed path"), 0)
    assert np.ptp(course.approaches) <= 1
    assert course.distance <= 120.0 * Assumptions().speed + 1e-6


def test_a_threshold_that_nothing_reaches_keeps_the_robot_where_it_is() -> None:
    course = simulate(replace(SHORT, gain_threshold=1000.0), 0)
    assert course.distance == 0.0
    assert course.updates.sum() == 0
    assert (np.diff(course.entropies, axis=0) >= 0.0).all()


def test_a_waiting_robot_updates_what_it_sees_if_it_is_told_to() -> None:
    waiting = replace(SHORT, gain_threshold=1000.0, duration=20.0)
    looking = replace(
        waiting, assumptions=Assumptions(updates_when_idle=True, field_of_view=ALL_ROUND)
    )
    assert sum(simulate(looking, seed).updates.sum() for seed in range(4)) > 0


def test_a_higher_threshold_drives_less() -> None:
    near, far = (simulate(replace(SHORT, gain_threshold=nats), 1).distance for nats in (1.0, 14.0))
    assert far < 0.5 * near


def test_nothing_depends_on_the_number_of_processes() -> None:
    few = Assumptions(step=5.0)
    one, two = (reproduce([few], 2, count, (4.0, 9.0, 16.0), (1.0,)) for count in (1, 2))
    assert one == two


def test_every_claim_is_judged() -> None:
    few = Assumptions(step=5.0)
    (found,) = reproduce([few], 2, 1, (4.0, 9.0, 16.0), (1.0,))
    rows = claims(found)
    assert {row.where for row in rows} == {f"Fig. {n}" for n in ("4a", "4b", "4c", "6a", "6b", "6c", "7a", "7b")}  # fmt: skip
    assert all(row.here for row in rows)


def test_positions_of_two_coordinates_are_measured_too() -> None:
    flat = replace(SHORT, strategy="fixed path", assumptions=Assumptions(coordinates=2))
    course = simulate(flat, 0)
    solid = simulate(replace(flat, assumptions=Assumptions(coordinates=3)), 0)
    assert solid.total_entropy == pytest.approx(1.5 * course.total_entropy)


def test_differences_are_paired_by_room() -> None:
    (found,) = reproduce([Assumptions(step=5.0)], 3, 1, (4.0, 9.0, 16.0), (1.0,))
    (at_4,) = found.differences
    setups = at_4.setup, replace(at_4.setup, strategy="fixed path")
    less = [
        np.subtract(*(simulate(each, seed).worst_entropy for each in setups)) for seed in range(3)
    ]
    assert at_4.worst_entropy.value == pytest.approx(np.mean(less))
    assert at_4.better_worst == np.mean(np.array(less) < 0.0)


def test_a_cat_is_updated_the_more_often_the_nearer_it_is() -> None:
    course = follow(CatSetup(gain_threshold=3.0), 0)
    near = course.distances < 1.5
    assert course.updated[near].mean() > 1.2 * course.updated[course.distances > 3.0].mean()
    assert 10.0 <= course.rates.min() < course.rates.max() <= 15.0
    assert course.inside.mean() > 0.97
    every = follow(CatSetup(), 0, every_frame=True)
    assert every.updated.all()
    assert every.errors.mean() < course.errors.mean()


def test_the_laser_verifies_what_it_reaches_and_only_a_trigger_asks_for_it() -> None:
    high, low = verifications()
    assert (high.sensor, low.sensor) == ("torso laser", "camera")
    assert high.gains["torso laser"] > high.gains["camera"] > 0.0
    assert not high.worth_by_gain
    assert not low.worth_by_gain
    assert high.before - high.after == pytest.approx(high.gains["torso laser"])


def test_a_tour_round_a_circle_goes_round_it() -> None:
    angles = np.random.default_rng(0).permutation(12) * np.pi / 6
    places = np.column_stack([np.cos(angles), np.sin(angles)])
    tour = shortest_tour(np.linalg.norm(places[:, None] - places, axis=2))
    assert sorted(tour.tolist()) == list(range(12))
    steps = np.linalg.norm(np.diff(places[np.append(tour, tour[0])], axis=0), axis=1)
    assert steps == pytest.approx(np.full(12, 2 * np.sin(np.pi / 12)))
