"""Two rooms, a door between them, and beliefs about what is in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from objstate.building.model import Building, Mesh, MovableObject
from objstate.config import Settings
from objstate.objects import ObjectBelief, filter_for
from objstate.particles import Weights
from tests.rooms import building, door, enclosure, table, wall


def two_rooms(*others: MovableObject, gap: float = 0.94) -> Building:
    """8 m by 4 m, halved by a wall at x = 0 with a door in its middle that opens to the west."""
    half = gap / 2
    between = [wall((0.0, -2.0), (0.0, -half)), wall((0.0, half), (0.0, 2.0))]
    leaf = door("door", 0.0, -0.45, bearing=np.pi / 2)
    return building(Mesh.joined([enclosure(8.0, 4.0), *between]), leaf, *others)


def prior(item: MovableObject, seed: int = 0) -> ObjectBelief:
    return replace(filter_for(item, Settings()).prior(np.random.default_rng(seed)), stamp_ns=0)


def surely(belief: ObjectBelief, state: float) -> ObjectBelief:
    """A door's belief that is sure of a state."""
    weights = np.zeros(len(belief.states))
    weights[np.abs(belief.states[:, 0] - state).argmin()] = 1.0
    return belief.with_weights(Weights.of(weights + 1e-12))


def priors(whole: Building) -> dict[str, ObjectBelief]:
    return {name: prior(item) for name, item in whole.objects.items()}


def chest(name: str, x: float, y: float, yaw: float = 0.0) -> MovableObject:
    return table(name, x, y, yaw, size=(1.0, 0.5))
