"""Laws of furniture's mixtures: what arrives in a cell merges with what is there."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.config import Dynamics, FurnitureSettings
from objstate.objects.furniture_mixture import FurnitureMixture, Piece
from tests.rooms import table

HOUR = 3600.0


@pytest.mark.parametrize("hours", [0.01, 1.0, 100.0])
def test_an_object_that_may_have_been_moved_has_no_error_of_a_zero(hours: float) -> None:
    settings = FurnitureSettings(dynamics=Dynamics(moves_per_hour=1.0))
    mixture, robot = (
        FurnitureMixture.unknown(Piece(table("desk", 1.0, 2.0), settings)),
        1e-4 * np.eye(3),
    )
    for _ in range(20):
        np.full((10, 7), 1e9).sum()  # leaves memory that isn't zero behind
        mixture = mixture.later(hours * HOUR, np.eye(3), np.zeros((3, 3)), robot)
    assert mixture.weights.sum() == pytest.approx(1.0)
    assert not mixture.covariances[:, 6].any()
    assert not mixture.covariances[:, :, 6].any()
