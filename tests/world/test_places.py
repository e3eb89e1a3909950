"""Furniture in several drives: fixed, or moved between them."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.geometry import FloatArray
from objstate.world.places import OWN_STD, PlaceEvidence, put_together

PRIOR = np.diag([0.2, 0.2, 0.26]) ** 2
STD = np.array([0.01, 0.01, 0.02])


def seen(place: FloatArray, seed: int, presence: float = 1.0) -> PlaceEvidence:
    """A drive that found a piece at a place (3,) beside the model's."""
    found = place + STD * np.random.default_rng(seed).standard_normal(3)
    information = np.diag((STD**2 + OWN_STD**2) ** -1.0)
    return PlaceEvidence(information, information @ found, PRIOR, presence)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000))
def test_what_stands_in_one_place_is_fixed_there(seed: int) -> None:
    place = np.random.default_rng(seed).normal(0.0, 0.1, 3)
    drives = [{"cabinet": seen(place, 10 * seed + k)} for k in range(4)]
    (cabinet,) = put_together(drives)
    assert cabinet.fixed > 0.95
    off = cabinet.moved - place
    assert off @ np.linalg.solve(cabinet.covariance, off) < 16.3  # 99.9 % of chi squared
    (twice,) = put_together(drives[:2])
    assert (cabinet.std < twice.std).all()


def test_what_is_moved_between_drives_isnt() -> None:
    drives = [{"chair": seen(np.array([0.1 * k, 0.0, 0.0]), k)} for k in range(3)]
    (chair,) = put_together(drives)
    assert chair.fixed < 0.01


def test_what_is_away_on_some_days_isnt() -> None:
    there = [{"bin": seen(np.zeros(3), k)} for k in range(3)]
    nothing = PlaceEvidence(np.zeros((3, 3)), np.zeros(3), PRIOR, 1e-6)
    (bin_,) = put_together([*there, {"bin": nothing}])
    assert bin_.fixed < 0.5
    assert put_together(there[:1]) == []  # one drive can't tell


def test_evidence_is_written_and_read() -> None:
    once = seen(np.array([0.1, 0.0, 0.2]), 0)
    again = PlaceEvidence.read(json.loads(json.dumps(once.words())))
    np.testing.assert_allclose(again.pull, once.pull, atol=1e-3)
    np.testing.assert_allclose(again.prior, once.prior, rtol=1e-4)
    with pytest.raises(ValueError, match="another form"):
        PlaceEvidence.read(once.words() | {"pull": [0.0]})
