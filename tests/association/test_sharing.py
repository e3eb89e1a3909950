"""Readings shared out by k-means, and circles fitted to them."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.association import located, shared_out
from objstate.errors import SettingsError

PLACES = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]])


def test_good_first_centres_need_one_round_and_one_to_see_it() -> None:
    rng = np.random.default_rng(0)
    readings = (PLACES[:, None] + 0.02 * rng.standard_normal((3, 50, 2))).reshape(-1, 2)
    shares = shared_out(readings, PLACES + 0.05)
    assert shares.rounds == 2
    assert shares.centres == pytest.approx(PLACES, abs=0.01)
    assert (shares.labels == np.repeat([0, 1, 2], 50)).all()


def test_every_reading_ends_with_its_nearest_centre() -> None:
    rng = np.random.default_rng(1)
    readings = rng.uniform(0.0, 1.0, (200, 2))
    shares = shared_out(readings, readings[:4], most_rounds=200)
    squared = ((readings[:, None] - shares.centres) ** 2).sum(axis=-1)
    assert (squared.argmin(axis=1) == shares.labels).all()
    assert shares.counts.sum() == len(readings)


def test_what_gave_no_reading_stays_where_it_is_predicted() -> None:
    shares = shared_out(np.zeros((5, 2)), PLACES)
    assert shares.counts.tolist() == [5, 0, 0]
    assert (shares.centres[1:] == PLACES[1:]).all()


def test_other_coordinates_are_refused() -> None:
    with pytest.raises(SettingsError, match=r"\(5, 3\) to \(3, 2\)"):
        shared_out(np.zeros((5, 3)), PLACES)
    with pytest.raises(SettingsError, match="no objects"):
        shared_out(np.zeros((5, 2)), PLACES[:0])


@pytest.mark.parametrize("seen", [(-70.0, 70.0), (-70.0, -10.0), (10.0, 70.0)])
def test_a_circle_is_found_by_whatever_part_of_it_is_seen(seen: tuple[float, float]) -> None:
    rng = np.random.default_rng(2)
    centre, radius = np.array([0.3, 2.0]), 0.15
    angles = -np.pi / 2.0 + np.radians(np.linspace(*seen, 40))  # the side towards the sensor
    points = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    found = located(points + 0.002 * rng.standard_normal(points.shape), np.zeros(2), radius, 0.002)
    assert found is not None
    off = found.position - centre
    assert off @ np.linalg.solve(found.covariance, off) < 9.0
    assert np.hypot(*off) < 0.01
    assert found.misfit < 0.004


def test_readings_of_something_else_do_not_shift_a_circle() -> None:
    rng = np.random.default_rng(3)
    centre, angles = np.array([0.3, 2.0]), -np.pi / 2.0 + np.radians(np.linspace(-70.0, 70.0, 60))
    points = centre + 0.15 * np.column_stack([np.cos(angles), np.sin(angles)])
    strange = centre + rng.uniform(-1.0, 1.0, (6, 2))
    found = located(np.vstack([points, strange]), np.zeros(2), 0.15, 0.002)
    assert found is not None
    assert found.position == pytest.approx(centre, abs=0.002)


def test_two_readings_are_too_few_for_a_circle() -> None:
    assert located(np.ones((2, 2)), np.zeros(2), 0.1, 0.01) is None
