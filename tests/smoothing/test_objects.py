"""Which movements of an object are listed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from objstate.config import DoorSettings, Dynamics
from objstate.objects import ObjectBelief
from objstate.objects.doors import LatticeFilter
from objstate.particles import Weights
from objstate.smoothing.movements import DoorRests
from objstate.smoothing.objects import Smoothed
from tests.rooms import door
from tests.smoothing.test_chain import doorway, seen

DOOR = door("door", 0.0, 0.0)


def at(angle_deg: float) -> ObjectBelief:
    prior = LatticeFilter(DOOR, DoorSettings()).prior(np.random.default_rng(0))
    off = prior.states[:, 0] - np.radians(angle_deg)
    return prior.with_weights(Weights.of(norm.pdf(off / np.radians(0.1))))


@pytest.mark.parametrize(
    ("angles", "listed"),
    [
        ([20.0] * 4, 0),
        ([20.0, 20.0, 20.6, 20.6], 0),
        ([20.0, 20.0, 22.0, 22.0], 1),
        ([20.0, 60.0, 20.0, 20.0], 1),  # it came back
    ],
)
def test_a_movement_is_listed_where_the_state_was_another(angles: list[float], listed: int) -> None:
    leaf = doorway(DOOR, Dynamics(moves_per_hour=2.0))
    chain = seen(leaf, [0.0, 0.2, 60.0, 0.2], [5, 5, 6, 6])
    item = Smoothed([at(angle) for angle in angles], DoorRests([(1.0, chain)]))
    assert len(item.movements) == listed
