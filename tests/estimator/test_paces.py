"""How often doors are moved, learnt over all of them."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.estimator.doors import Paces
from objstate.objects.mixture import PACES

OFTEN = 3.0 * np.arange(len(PACES))  # log-likelihoods of a door that was moved often
UNTOLD = np.zeros(len(PACES))


def test_doors_are_moved_as_often_as_set_before_any_scan() -> None:
    assert PACES[int(Paces().of("door").argmax())] == pytest.approx(1.0)


def test_doors_that_are_moved_often_make_it_likelier_of_others() -> None:
    paces = Paces()
    before = paces.of("other")
    for name in ("one", "two"):
        paces.observe(name, OFTEN)
    assert paces.of("other") @ PACES > 2.0 * (before @ PACES)


def test_what_a_door_itself_shows_is_not_in_its_prior() -> None:
    paces = Paces()
    before = paces.of("door")
    paces.observe("door", OFTEN)
    assert paces.of("door") == pytest.approx(before)


def test_readings_replace_those_before_and_nothing_told_changes_nothing() -> None:
    paces = Paces()
    before = paces.of("other")
    paces.observe("door", OFTEN)
    paces.observe("door", UNTOLD)
    assert paces.of("other") == pytest.approx(before)
