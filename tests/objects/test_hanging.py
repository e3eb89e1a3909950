"""Where a door hangs, found from looks at one that hangs aside of its place in the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from objstate.building.model import Building, Mesh
from objstate.config import BeamModelSettings, HingeSettings, Settings
from objstate.geometry import FloatArray
from objstate.objects import filter_for
from objstate.objects.doors import LatticeFilter
from objstate.objects.hanging import Look, find_hinge
from objstate.sensing import BeamModel, ExpectedRanges, Sensing
from tests.rooms import building, door, enclosure, fan, observed, wall

SETTINGS = HingeSettings()
RAYS = fan(181, 1.5 * np.pi)
PLACES = np.array([[x, -0.6, np.pi / 2] for x in np.linspace(-1.5, 2.0, 8)])  # the robot drives by
WALLS = Mesh.joined([wall((-3, 1.3), (-0.3, 1.3)), wall((1.2, 1.3), (3, 1.3)), enclosure(6, 8)])
SHARP = BeamModel(BeamModelSettings(sigma_hit=SETTINGS.sigma_hit))


def room(x: float = 0.0, y: float = 0.0) -> Building:
    """A door with its hinge at (x, 1 + y), before a wall with a wide gap."""
    return building(WALLS, door("door", x, 1.0 + y))


def looks_at(real: Building, angle: float) -> list[Look]:
    """One from each place, with noise, a second after the other."""
    rng, expected = np.random.default_rng(1), ExpectedRanges(real)
    sensing = Sensing(replace(room(), walls=Mesh.empty()), SHARP)
    return [
        Look(
            stamp_ns=k * 10**9,
            view=sensing.view(observed(expected, {"door": np.array([angle])}, pose, RAYS, rng)),
            pose=pose,
            background=expected.walls(pose[None], RAYS)[0],
            shift_std=0.01,
        )
        for k, pose in enumerate(PLACES)
    ]


def a_filter() -> LatticeFilter:
    door_filter = filter_for(room()["door"], Settings())
    assert isinstance(door_filter, LatticeFilter)
    return door_filter


@pytest.mark.parametrize("offset", [(0.1, 0.0), (0.0, -0.2), (-0.15, 0.15), (0.2, -0.2)])
@pytest.mark.parametrize("angle", [0.35, 1.2])
def test_a_hinge_that_is_off_is_found_and_the_angle_is_right(
    offset: Sequence[float], angle: float
) -> None:
    found = find_hinge(a_filter(), looks_at(room(*offset), angle), SETTINGS)
    assert found.elsewhere > 0.99
    assert np.hypot(*(found.offset - offset)) < 0.04
    assert found.belief.mean[0] == pytest.approx(angle, abs=np.radians(2.0))


@pytest.mark.parametrize("angle", [0.0, 0.35, 1.2])
def test_a_door_that_hangs_where_it_should_stays_there(angle: float) -> None:
    found = find_hinge(a_filter(), looks_at(room(), angle), SETTINGS)
    assert found.elsewhere < 0.1
    assert found.belief_in_place.mean[0] == pytest.approx(angle, abs=np.radians(2.0))


def test_places_keep_within_bounds_and_probabilities_sum_to_one() -> None:
    found = find_hinge(a_filter(), looks_at(room(0.2, 0.2), 0.7), SETTINGS)
    farthest = np.hypot(*found.offsets.T).max()
    assert farthest <= SETTINGS.most_m + SETTINGS.spacing_m + 1e-9
    assert found.weights.values.sum() == pytest.approx(1.0)
    assert found.given.given.sum(axis=1) == pytest.approx(np.ones(len(found.offsets)))
    assert (np.linalg.eigvalsh(found.covariance) >= 0.0).all()


def test_where_all_doors_are_sure_to_hang_in_place_none_is_found_elsewhere() -> None:
    sure = HingeSettings(in_place=1.0)
    found = find_hinge(a_filter(), looks_at(room(0.2, 0.0), 0.7), sure)
    assert found.elsewhere == 0.0


def test_an_offset_is_seen_from_the_building_not_from_the_robot() -> None:
    """The mean of what is found moves with the hinge, component by component."""
    at: list[FloatArray] = [
        find_hinge(a_filter(), looks_at(room(x, 0.0), 1.2), SETTINGS).offset for x in (-0.12, 0.12)
    ]
    assert at[1][0] - at[0][0] == pytest.approx(0.24, abs=0.03)
