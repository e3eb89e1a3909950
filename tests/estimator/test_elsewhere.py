"""Hinges and rails that are off their places."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Mesh
from objstate.config import BeamModelSettings, BuildingErrorSettings, DoorSettings, Settings
from objstate.estimator.doors import Doors
from objstate.geometry import FloatArray
from objstate.lazy import altered
from objstate.objects.doors import LatticeFilter
from objstate.objects.mixture import DoorMixture, Doorway, Statics
from objstate.objects.mixture_kernels import ORIGIN
from objstate.sensing import BeamModel, Sensing
from tests.rooms import building, door, sliding_door

OFF = 0.1  # m


def elsewhere(offset: FloatArray, *, slides: bool) -> FloatArray | None:
    """What is said of a door whose origin surely is off its place by ``offset`` (2,) m."""
    item = sliding_door("door", 0.0, 0.0) if slides else door("door", 0.0, 0.0)
    place, settings = building(Mesh.empty(), item), DoorSettings()
    error = BuildingErrorSettings()
    known = DoorMixture.unknown(Doorway(item, settings, error), Statics(1e-6, 1e-6))
    means = known.means.copy()
    means[:, ORIGIN : ORIGIN + 2] = offset
    prior = LatticeFilter(item, settings).prior(np.random.default_rng(0))
    belief = altered(prior, joint=altered(known, means=means))
    doors = Doors(place, Settings(), Sensing(place, BeamModel(BeamModelSettings())))
    return doors.elsewhere(belief)


@pytest.mark.parametrize("offset", [(OFF, 0.0), (0.0, OFF)])
def test_a_hinge_is_off_in_either_direction(offset: tuple[float, float]) -> None:
    assert elsewhere(np.array(offset), slides=False) == pytest.approx(np.array(offset))


def test_a_rail_is_off_across_itself_only() -> None:
    (along,) = sliding_door("door", 0.0, 0.0).direction[None, :2]
    across = np.array([-along[1], along[0]])
    assert elsewhere(OFF * along, slides=True) is None
    assert elsewhere(OFF * (along + across), slides=True) == pytest.approx(OFF * across)
