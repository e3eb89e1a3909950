"""What a scan shows of one object: what stands behind it, and which beams end before that."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from objstate.config import BeamModelSettings
from objstate.estimator.exposure import Exposures, Others
from objstate.estimator.sight import Sight
from objstate.estimator.surroundings import Surroundings
from objstate.geometry import FloatArray
from objstate.localization import Carried, PoseBelief, RangeNoise, Vantage, WallErrors
from objstate.particles import Weights
from objstate.sensing import BeamModel, Sensing, UncertainObject
from tests.rooms import building, door, enclosure, fan, scan_of

RAYS = fan(90, 2 * np.pi)
PLACE = building(enclosure(8.0, 6.0), door("a", 2.0, 1.0, 0.3), door("b", -2.0, 1.0, 0.3))
NOTHING = Carried(np.zeros((3, 3)), np.zeros((3, 3)))


def exposures(
    ranges: FloatArray, known: dict[str, FloatArray], others: Mapping[str, FloatArray] | None = None
) -> Exposures:
    """What a scan shows; ``others`` may stand in states (s, 1)."""
    scan, robot = scan_of(ranges, RAYS, 10**9), PoseBelief(np.zeros((1, 3)), Weights.uniform(1))
    sensing = Sensing(PLACE, BeamModel(BeamModelSettings()))
    sight = Sight.of(scan, robot, sensing, Surroundings(PLACE))
    vantage = Vantage.of(robot, scan, RangeNoise(0.01**2, 0.0, 0.0))
    surfaces = sensing.surfaces(sight.height)
    places = others or {}
    scenery = sensing.scenery(
        [
            UncertainObject(name, each, np.full(len(each), 1 / len(each)))
            for name, each in places.items()
        ],
        sight.height,
    )
    entries = np.reshape([sight.entered(name) for name in places], (len(places), len(scan)))
    among = Others(list(places), scenery, entries)
    walls = WallErrors.unknown(len(surfaces.pieces), 0.02)
    return Exposures(sight, vantage, surfaces, known, among, walls, lambda *_: NOTHING)


def test_an_object_stands_before_the_walls_and_all_others_but_not_itself() -> None:
    known = {"a": np.full(len(RAYS), 1.0), "b": np.full(len(RAYS), 2.0)}
    every = exposures(np.full(len(RAYS), 2.5), known)
    assert (every.of("a").background == 2.0).all()
    assert (every.of("b").background == 1.0).all()
    other = every.of("c")
    assert (other.background == 1.0).all()
    assert (other.walls > 2.9).all()
    assert other.walls is every.of("a").walls


def test_beams_that_end_before_the_background_are_stopped() -> None:
    ranges = np.full(len(RAYS), 2.95)
    ranges[10:14] = 1.5
    exposure = exposures(ranges, {}).of("a")
    directions = RAYS.directions[10:14, :2]
    ends = exposure.stopped
    near = ends[np.hypot(*ends.T) < 2.0]
    assert np.sort(near, axis=0) == pytest.approx(np.sort(1.5 * directions, axis=0), abs=1e-6)


def test_a_beam_may_end_on_another_object_in_a_state_of_its_belief() -> None:
    """Door b, hung at (-2, 1) with a bearing of 0.3 rad, is closed or open by 1 rad."""
    robot_to_leaf = np.array([-2.0, 1.0]) + 0.5 * np.array([np.cos(0.3), np.sin(0.3)])
    beam = int((RAYS.directions[:, :2] @ robot_to_leaf).argmax())
    dx, dy = RAYS.directions[beam, :2]
    normal = np.array([-np.sin(0.3), np.cos(0.3)])
    onto_leaf = (normal @ [-2.0, 1.0] - 0.02) / (normal @ [dx, dy])
    densities = {}
    for read in (0.5, onto_leaf, onto_leaf + 0.2):
        every = exposures(np.full(len(RAYS), read), {}, {"b": np.array([[0.0], [1.0]])})
        densities[read] = every.of("a").others[beam]
        assert every.of("b").others[beam] == 0.0
    before, on_it, beyond = densities.values()
    assert before == 0.0  # the beam hasn't come to where the leaf may be
    assert beyond == pytest.approx(0.5, abs=0.1)  # it may stand anywhere
    assert on_it > 10.0


def test_time_since_a_stamp_never_runs_backwards() -> None:
    exposure = exposures(np.full(len(RAYS), 2.0), {}).of("a")
    assert exposure.seconds_since(None) == 0.0
    assert exposure.seconds_since(4 * 10**8) == pytest.approx(0.6)
    assert exposure.seconds_since(2 * 10**9) == 0.0
