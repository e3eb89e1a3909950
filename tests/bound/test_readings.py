"""Slopes are those of geometry; noise, false readings and what stands in the way cost information."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.bound.readings import range_information, scan_information
from objstate.errors import SettingsError
from objstate.sensing.expected import ExpectedRanges
from objstate.simulation.drive import Simulation
from objstate.simulation.lasers import reading
from objstate.simulation.scene import Laser
from tests.bound.conftest import LASER, Drive

EXACT = {"quantization": 0.0, "sigma": 0.02}


def matrix(simulation: Simulation, *names: str) -> np.ndarray:
    """The information of the first scan, whose objects must be ``names``."""
    _, exposure = next(simulation.exposures())
    told = scan_information(ExpectedRanges(simulation.building), exposure)
    assert told.objects == names
    return told.matrix


def test_gaussian_readings_tell_as_much_as_their_precision() -> None:
    assert range_information(Laser(**EXACT)) == pytest.approx(1 / 0.02**2, rel=1e-6)


@given(st.floats(0, 0.9), st.floats(0, 0.9))
def test_readings_that_miss_or_lie_tell_nothing(false: float, missed: float) -> None:
    told = range_information(Laser(**EXACT, false_share=false, no_return_share=missed))
    assert told <= (1 - false) * (1 - missed) / 0.02**2 * (1 + 1e-6)


def test_the_information_of_a_range_is_the_variance_of_its_score() -> None:
    laser = Laser(sigma=0.1, quantization=0.0, false_share=0.3, range_min=0.0, range_max=4.0)
    read = reading(np.full(400_000, 2.0), laser, np.random.default_rng(1))
    off = read - 2.0
    normal = 0.7 * np.exp(-(off**2) / 0.02) / np.sqrt(2 * np.pi * 0.01)
    score = normal * off / 0.01 / (normal + 0.3 / 4.0)
    assert range_information(laser) == pytest.approx(np.mean(score**2), rel=0.02)


def test_a_laser_without_noise_bounds_nothing() -> None:
    with pytest.raises(SettingsError, match=r"'eye'.*sigma"):
        range_information(Laser(frame="eye", sigma=0.0, quantization=0.0))


def test_a_beam_straight_at_a_wall_tells_of_nothing_but_the_distance(drive: Drive) -> None:
    ahead = {"beams": 2, "angle_min": 0.0, "angle_max": 1e-9, **EXACT}
    route = {"waypoints": [{"x": 0.0, "y": -1.0, "pause": 1.0}], "start_yaw": 0.0}
    told = matrix(drive(route=route, lasers=[ahead]))
    np.testing.assert_allclose(told * 0.02**2 / 2, np.diag([1.0, 0.0, 0.0]), atol=5e-3)


def test_an_angle_is_told_by_the_leaf_that_turns_under_the_beam(drive: Drive) -> None:
    ahead = {"beams": 2, "angle_min": 0.0, "angle_max": 1e-9, **EXACT}
    route = {"waypoints": [{"x": 1.5, "y": 0.0, "pause": 1.0}], "start_yaw": np.pi / 2}
    told = matrix(drive(route=route, lasers=[ahead]), "door")  # closed: hit 0.5 m from its hinge
    assert told[3, 3] * 0.02**2 / 2 == pytest.approx(0.5**2, rel=0.02)
    assert told[3, 1] * 0.02**2 / 2 == pytest.approx(0.5, rel=0.02)


def test_what_stands_in_front_takes_the_information(drive: Drive) -> None:
    free = matrix(drive(), "door", "table")
    box = {"pose": {"x": 0.7, "y": 1.0}, "size": [0.3, 0.1, 1.0]}
    hidden = matrix(drive(boxes=[box]), "door", "table")
    assert (np.linalg.eigvalsh(free - hidden) > -1e-6 * free.max()).all()
    assert hidden[3, 3] < 0.9 * free[3, 3]


def test_beams_on_edges_and_out_of_range_are_left_out(drive: Drive) -> None:
    near = matrix(drive(lasers=[LASER | {"range_max": 0.5}]))
    np.testing.assert_array_equal(near, np.zeros((3, 3)))
    fine = matrix(drive(lasers=[LASER | {"beams": 2000, **EXACT}]), "door", "table")
    # no distance in the room changes by more than so many m/rad, save where beams change surface
    assert fine[3, 3] < 2000 / 0.02**2
