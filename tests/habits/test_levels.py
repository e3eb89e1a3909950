"""The posterior over the level of a door's rate of moves."""

import numpy as np
import pytest

from objstate.geometry import FloatArray
from objstate.habits.calendar import NANOSECONDS, Calendar
from objstate.habits.design import Design
from objstate.habits.levels import FURTHEST, Levels, fit_levels, mixture, without
from objstate.habits.looks import RegionLooks
from objstate.habits.model import Evidence, Gaussian, prior

DESIGN = Design(2)
LEVELS = Levels(prior(DESIGN), DESIGN.level)
PRIOR = Gaussian(np.array([0.5, -1.0]), np.array([[2.0, 0.6], [0.6, 1.0]]))
FIRST = Levels(PRIOR, np.array([1.0, 0.0]))


def told_by(precision: FloatArray, centre: FloatArray, theta: FloatArray) -> Evidence:
    """A Gaussian likelihood."""
    off = theta - centre
    return Evidence(theta, float(-0.5 * off @ precision @ off), -precision @ off, precision, off)


def test_components_add_up_to_the_prior() -> None:
    centres = LEVELS.along @ LEVELS.prior.mean + LEVELS.step * np.arange(-FURTHEST, FURTHEST + 1)
    weights = np.exp([LEVELS.log_weight(each) for each in centres.tolist()])
    weights /= weights.sum()
    parts = [LEVELS.component(each) for each in centres.tolist()]
    mean = sum(w * part.mean for w, part in zip(weights, parts, strict=True))
    assert mean == pytest.approx(LEVELS.prior.mean, abs=1e-6)
    spread = sum(
        w * (part.covariance + np.outer(part.mean - mean, part.mean - mean))
        for w, part in zip(weights, parts, strict=True)
    )
    assert np.allclose(spread, LEVELS.prior.covariance, rtol=0.02, atol=0.02)


@pytest.mark.parametrize("sure", [0.0, 1.0, 30.0])
def test_of_a_gaussian_likelihood_the_posterior_is_exact(sure: float) -> None:
    told, centre = np.array([[sure, 0.0], [0.0, sure / 2.0]]), np.array([2.0, 1.0])
    found = mixture(lambda theta: told_by(told, centre, theta), FIRST)
    before = np.linalg.inv(PRIOR.covariance)
    covariance = np.linalg.inv(before + told)
    mean = covariance @ (before @ PRIOR.mean + told @ centre)
    draws = found.draws(4000)
    std = np.sqrt(np.diag(covariance))
    assert np.abs(draws.mean(axis=0) - mean) == pytest.approx(0.0, abs=0.1 * std.max())
    assert draws.std(axis=0) == pytest.approx(std, rel=0.1)


def test_without_some_looks_the_others_are_left() -> None:
    older, newer = np.array([[3.0, 1.0], [1.0, 2.0]]), np.diag([5.0, 0.5])
    there, here = np.array([2.0, 1.0]), np.array([0.5, -2.0])
    before = np.linalg.inv(PRIOR.covariance)
    covariance = np.linalg.inv(before + older + newer)
    pull = before @ PRIOR.mean + older @ there
    after = Gaussian(covariance @ (pull + newer @ here), covariance)
    left = without(lambda theta: told_by(newer, here, theta), after, PRIOR)
    assert left.covariance == pytest.approx(np.linalg.inv(before + older))
    assert left.mean == pytest.approx(left.covariance @ pull)
    nothing = without(lambda theta: told_by(newer + older, here, theta), after, PRIOR)
    assert nothing.covariance == pytest.approx(PRIOR.covariance)


def test_two_ways_to_tell_the_looks_are_both_there() -> None:
    """A likelihood with two peaks, of which one alone would be found from the prior's mean."""
    peaks = [(np.array([-1.5, -1.0]), 1.0), (np.array([3.0, -1.0]), 2.0)]

    def told(theta: FloatArray) -> Evidence:
        near = min(peaks, key=lambda peak: abs(theta[0] - peak[0][0]))
        found = told_by(np.diag([1.0, 0.0]), near[0], theta)
        return Evidence(
            theta,
            found.log_likelihood + np.log(near[1]),
            found.score,
            found.information,
            found.state,
        )

    level = mixture(told, FIRST).draws(2000)[:, 0]
    low, high = float((level < 0.75).mean()), float((level > 0.75).mean())
    grid = np.linspace(-6, 8, 20001)
    density = np.exp([told(np.array([x, 0.0])).log_likelihood for x in grid.tolist()])
    density *= np.exp(-0.5 * (grid - PRIOR.mean[0]) ** 2 / PRIOR.covariance[0, 0])
    true = float(density[grid > 0.75].sum() / density.sum())
    assert high == pytest.approx(true, abs=0.06)
    assert low > 0.1


def test_looks_hours_apart_leave_open_how_often_a_door_is_moved() -> None:
    """A door that is open at every other look may be moved twice a day, or all the time."""
    hours = np.arange(0, 28 * 24, 12)
    looks = RegionLooks.certain(hours * 3600 * NANOSECONDS, np.arange(len(hours)) % 2, 2)
    level = fit_levels(DESIGN, Calendar(), looks).draws(400) @ DESIGN.level
    assert np.quantile(level, 0.05) < np.log(0.5)
    assert np.quantile(level, 0.95) > np.log(2.0)
