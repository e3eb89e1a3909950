"""How errors of a recorded robot belief carry over."""

import math

import numpy as np
import pytest

from objstate.localization.carried import Decorrelation

STD = np.array([0.03, 0.03, 0.01])  # m, m, rad
COVARIANCE = np.diag(STD**2)


def followed(kept: float, scale: float, seed: int) -> Decorrelation:
    """After 400 beliefs whose errors keep a share, and are so many times as large as stated."""
    rng, error, decorrelation = np.random.default_rng(seed), scale * STD, Decorrelation(0.5)
    for _ in range(400):
        fresh = math.sqrt(1.0 - kept**2) * scale * STD * rng.standard_normal(3)
        later = kept * error + fresh
        decorrelation.renew(later - error, COVARIANCE)
        error = later
    return decorrelation


@pytest.mark.parametrize("kept", [0.0, 0.5, 0.96])
@pytest.mark.parametrize("seed", [0, 1])
def test_beliefs_show_how_their_errors_decorrelate(kept: float, seed: int) -> None:
    decorrelation = followed(kept, 1.0, seed)
    decorrelation.carried("door", COVARIANCE)
    assert decorrelation.carried("door", COVARIANCE).transfer == pytest.approx(np.eye(3))
    decorrelation.renew(np.zeros(3), COVARIANCE)
    carried = decorrelation.carried("door", COVARIANCE)
    share = carried.transfer[0, 0]
    assert share == pytest.approx(kept, abs=0.15)
    wider = carried.added[0, 0] / ((1.0 - share**2) * COVARIANCE[0, 0])
    assert wider == pytest.approx(1.0, abs=0.15)


def test_a_belief_that_strays_farther_than_it_says_is_wider() -> None:
    decorrelation = followed(0.0, 3.0, 2)
    first = decorrelation.carried("door", COVARIANCE)
    assert not first.transfer.any()
    assert np.sqrt(first.added[0, 0]) == pytest.approx(3.0 * STD[0], rel=0.1)


def test_without_further_beliefs_errors_decorrelate_with_the_way() -> None:
    decorrelation = Decorrelation(0.5)
    decorrelation.carried("door", COVARIANCE)
    decorrelation.drive(0.5)
    carried = decorrelation.carried("door", COVARIANCE)
    np.testing.assert_allclose(carried.transfer, math.exp(-1.0) * np.eye(3))
    np.testing.assert_allclose(carried.added, (1.0 - math.exp(-2.0)) * COVARIANCE)
