"""A small building with one door and one desk, and beliefs of them."""

from dataclasses import replace

import numpy as np

from objstate.building.model import Building
from objstate.config import Settings
from objstate.objects import ObjectBelief, filter_for
from objstate.particles import Weights
from tests.rooms import door, enclosure, table

SECOND = 10**9
HOUR = 3600 * SECOND
DOOR, DESK = door("door", 0.0, 0.0), table("desk", 3.0, 1.0)
OBJECTS = {"door": DOOR, "desk": DESK}
BUILDING = Building("office", enclosure(10.0, 8.0), OBJECTS)


def at_angle(angle: float, stamp_ns: int, std: float = 0.02) -> ObjectBelief:
    """The door open by an angle."""
    prior = filter_for(DOOR, Settings()).prior(np.random.default_rng(0))
    weights = np.exp(-0.5 * ((prior.states[:, 0] - angle) / std) ** 2)
    belief = prior.with_weights(Weights.of(weights + np.finfo(float).tiny))
    return replace(belief, stamp_ns=stamp_ns, last_observed_ns=stamp_ns)


def desk_at(x: float, stamp_ns: int, count: int = 250, spread: float = 0.02) -> ObjectBelief:
    """The desk moved along x, with samples about that place."""
    rng = np.random.default_rng(1)
    states = np.array([x, 1.0, 0.0]) + spread * rng.standard_normal((count, 3))
    return ObjectBelief(DESK, states, Weights.uniform(count), np.zeros(3), 1.0, stamp_ns, stamp_ns)
