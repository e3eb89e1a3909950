"""What a scan's beams read behind an object."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.config import BeamModelSettings, Settings
from objstate.estimator.backdrop import Backdrop
from objstate.estimator.believed import Believed
from objstate.particles import Weights
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.rooms import building, door, enclosure, fan, observed

ANGLES = {"left": 0.4, "right": 0.9}
ROBOT = np.array([0.0, -1.5, 1.5])


@pytest.mark.parametrize("count", [1, 3, 250])
def test_behind_an_object_stand_walls_and_the_others_whose_state_is_known(count: int) -> None:
    doors = door("left", -1.5, 0.0), door("right", 0.5, 0.0), door("unknown", -0.5, 1.0)
    place = building(enclosure(6.0, 8.0), *doors)
    states = {name: np.array([angle]) for name, angle in ANGLES.items()}
    scan = observed(ExpectedRanges(place), states, ROBOT, fan(91, np.pi), None)
    view = Sensing(place, BeamModel(BeamModelSettings())).view(scan)
    beliefs = dict(Believed(place, Settings(), 0, {}).marginals)
    for name, angle in ANGLES.items():
        off = beliefs[name].states[:, 0] - angle
        known = Weights.of(np.exp(-0.5 * (off / 0.01) ** 2))
        beliefs[name] = beliefs[name].with_weights(known)
    poses = ROBOT + np.random.default_rng(0).normal(0.0, 0.02, (count, 3))
    walls = view.walls(poses)
    alone = {name: view.object(name, beliefs[name].mean[None], poses)[:, 0] for name in ANGLES}
    backdrop = Backdrop(view, poses, beliefs)
    behind = {
        "unknown": np.minimum(walls, np.minimum(alone["left"], alone["right"])),
        "left": np.minimum(walls, alone["right"]),
        "right": np.minimum(walls, alone["left"]),
    }
    for name, expected in behind.items():
        found, log_likelihood = backdrop.without(name)
        np.testing.assert_array_equal(found, expected)
        np.testing.assert_array_equal(log_likelihood, view.log_likelihood(expected))
    assert (backdrop.without("left")[0] > backdrop.without("unknown")[0]).any()
