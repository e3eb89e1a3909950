"""Leaves that no beam meets: they are told, and nothing is claimed of their states."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from objstate.building.model import Building
from objstate.estimator import Estimator
from objstate.smoothing import smoothed
from tests.estimator.drives import DOORS, START, corridor, drive, truth

GONE = "c"  # a door that the model has, and the building hasn't
FLAT = np.pi / 3.0  # rad; an interval as wide as that tells nothing


def built() -> Building:
    """The corridor without one of its doors."""
    place = corridor()
    return replace(
        place, objects={name: each for name, each in place.objects.items() if name != GONE}
    )


@cache
def driven(*, is_gone: bool) -> Estimator:
    """After a drive past all doors."""
    place = built() if is_gone else corridor()
    states = {name: state for name, state in truth().items() if name in place.objects}
    estimator = Estimator(corridor(), initial_pose=START, history=True)
    for record in drive(3, states=states, place=place).records:
        estimator.feed(record)
    return estimator


def test_a_leaf_that_was_taken_out_may_stand_anywhere() -> None:
    estimator = driven(is_gone=True)
    gone = estimator.objects[GONE]
    (lower,), (upper,) = gone.interval()
    assert gone.presence < 0.2
    assert upper - lower > FLAT
    assert GONE not in estimator.hung_elsewhere


@pytest.mark.parametrize("is_gone", [True, False])
def test_leaves_that_beams_meet_are_there(is_gone: bool) -> None:
    objects = driven(is_gone=is_gone).objects
    for name in DOORS.keys() - ({GONE} if is_gone else set()):
        assert objects[name].presence > 0.999
        assert np.degrees(objects[name].median[0]) == pytest.approx(DOORS[name][2], abs=1.5)


def test_nothing_is_said_afterwards_of_how_a_leaf_moved_that_no_beam_met() -> None:
    estimator = driven(is_gone=True)
    late = smoothed(estimator.histories[GONE])
    assert late.movements == []
    for belief in late.beliefs:
        (lower,), (upper,) = belief.interval()
        assert belief.presence == estimator.objects[GONE].presence
        assert upper - lower > FLAT
