"""A door filtered under two priors of its closed bearing follows whichever is right."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import BuildingErrorSettings, DoorSettings
from objstate.lazy import altered
from objstate.objects import ObjectBelief
from objstate.objects.door_posterior import DoorPosterior
from objstate.objects.doors import LatticeFilter
from objstate.objects.mixture import Doorway, Statics
from tests.rooms import door, sliding_door

NARROW = Statics(0.03**2, math.radians(0.5) ** 2)
WIDE = Statics(0.03**2, math.radians(3.0) ** 2)


def doorway(sliding: bool = False) -> Doorway:
    leaf = sliding_door("door", 0.0, 0.0) if sliding else door("door", 0.0, 0.0)
    return Doorway(leaf, DoorSettings(), BuildingErrorSettings())


def unseen(place: Doorway) -> ObjectBelief:
    return LatticeFilter(place.item, place.settings).prior(np.random.default_rng(0))


def posterior(sliding: bool = False) -> DoorPosterior:
    place = doorway(sliding)
    return DoorPosterior.of(place, unseen(place), [NARROW, WIDE])


def test_a_sliding_door_has_no_bearing_and_one_mixture() -> None:
    assert len(posterior().mixtures) == 2
    assert len(posterior(sliding=True).mixtures) == 1


@given(deviation=st.floats(0.01, 3.0), better=st.sampled_from([0, 1]))
@settings(max_examples=30, deadline=None)
def test_a_door_is_read_off_from_the_best_mixture_whose_prior_is_wide_enough(
    deviation: float, better: int
) -> None:
    totals = [5.0 * (index == better) for index in (0, 1)]
    both = zip(posterior().mixtures, totals, strict=True)
    told = DoorPosterior(tuple(altered(each, total=total) for each, total in both))
    (index,) = told.among(np.array([math.radians(deviation) ** 2]))
    assert index == (better if deviation <= 0.5 else 1)


def test_evidence_of_a_prior_that_no_scan_changed_is_flat() -> None:
    variances = np.radians([0.1, 0.3, 0.5, 1.0, 3.0]) ** 2
    assert posterior().of_bearing(variances) == pytest.approx(np.zeros(5), abs=1e-9)


def test_a_bearing_is_as_likely_as_the_scans_under_the_best_prior_that_is_as_wide() -> None:
    narrow, wide = posterior().mixtures
    variances = np.radians([0.1, 0.5, 1.0, 3.0]) ** 2
    for totals, expected in (((2.0, -7.0), [2.0, 2.0, -7.0, -7.0]), ((-7.0, 2.0), [2.0] * 4)):
        told = DoorPosterior((altered(narrow, total=totals[0]), altered(wide, total=totals[1])))
        assert told.of_bearing(variances) == pytest.approx(expected, abs=1e-9)


def test_states_under_several_priors_are_those_of_the_mixtures_that_hold_them() -> None:
    both, priors = posterior(), [WIDE, NARROW, WIDE]
    resting = np.zeros(len(both.door.states))
    resting[3] = 1.0
    moved = altered(both.mixtures[1], resting=resting)
    whole = DoorPosterior((altered(both.mixtures[0], total=1.0), moved))
    states = whole.under(priors)
    for row, (mixture, prior) in enumerate(
        zip((moved, both.mixtures[0], moved), priors, strict=True)
    ):
        alone = mixture.under([prior])
        assert states.resting[row] == pytest.approx(alone.resting[0])
        assert states.means[row] == pytest.approx(alone.means[0])


def test_a_hinge_is_as_likely_as_under_the_bearings_that_it_may_have() -> None:
    both, variances = posterior(), np.array([0.005, 0.01, 0.03]) ** 2
    bearings = [(0.5, NARROW.bearing), (0.5, WIDE.bearing)]
    assert both.of_hinge(variances, bearings) == pytest.approx(np.zeros(3), abs=1e-9)
