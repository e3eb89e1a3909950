"""The simulations of section 7, small."""

from dataclasses import replace

import numpy as np
import pytest

from objstate.experiments.elfring2014 import Assumptions, Setup, claims, reproduce, simulate
from objstate.experiments.tours import shortest_tour

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
    looking = replace(waiting, assumptions=Assumptions(updates_when_idle=True, field_of_view=7.0))
    assert sum(simulate(looking, seed).updates.sum() for seed in range(4)) > 0


def test_a_higher_threshold_drives_less() -> None:
    near, far = (simulate(replace(SHORT, gain_threshold=nats), 1).distance for nats in (1.0, 14.0))
    assert far < 0.5 * near


def test_nothing_depends_on_the_number_of_processes() -> None:
    few = Assumptions(step=5.0)
    one, two = (reproduce([few], 2, count, (6.0, 9.0, 16.0), (1.0,)) for count in (1, 2))
    assert one == two


def test_every_claim_is_judged() -> None:
    few = Assumptions(step=5.0)
    (found,) = reproduce([few], 2, 1, (9.0, 16.0), (1.0,))
    rows = claims(found)
    assert {row.where for row in rows} == {f"Fig. {n}" for n in ("4a", "4b", "4c", "6a", "6b", "6c", "7a", "7b")}  # fmt: skip
    assert all(row.here for row in rows)


def test_positions_of_three_coordinates_are_measured_too() -> None:
    course = simulate(replace(SHORT, assumptions=Assumptions(coordinates=3)), 0)
    plain = simulate(SHORT, 0)
    assert course.total_entropy != pytest.approx(plain.total_entropy)


def test_a_tour_round_a_circle_goes_round_it() -> None:
    angles = np.random.default_rng(0).permutation(12) * np.pi / 6
    places = np.column_stack([np.cos(angles), np.sin(angles)])
    tour = shortest_tour(np.linalg.norm(places[:, None] - places, axis=2))
    assert sorted(tour.tolist()) == list(range(12))
    steps = np.linalg.norm(np.diff(places[np.append(tour, tour[0])], axis=0), axis=1)
    assert steps == pytest.approx(np.full(12, 2 * np.sin(np.pi / 12)))
