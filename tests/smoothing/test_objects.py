"""Which movements of an object are listed."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.config import Dynamics
from objstate.objects import ObjectBelief
from objstate.smoothing.movements import DoorRests
from objstate.smoothing.objects import Smoothed
from tests.objects.test_belief import DOOR, lattice
from tests.smoothing.test_chain import doorway, seen


def narrow(angle_deg: float) -> ObjectBelief:
    return lattice(mean=np.radians(angle_deg), std=np.radians(0.1), resolution_deg=0.25)


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
    item = Smoothed([narrow(angle) for angle in angles], DoorRests([(1.0, chain)]))
    assert len(item.movements) == listed
