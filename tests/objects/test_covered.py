"""What an object covers of a grid under its belief."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from objstate.config import Settings
from objstate.grid import Layout
from objstate.objects import ObjectBelief, filter_for
from objstate.objects.covered import covered
from tests import rooms

LAYOUT = Layout(0.05, 80, 80, np.array([-2.0, -2.0, 0.0]))
DOOR = rooms.door("door", 0.013, 0.007)  # else edges lie between cells, and rounding decides


def belief(angle: float, std: float) -> ObjectBelief:
    prior = filter_for(DOOR, Settings()).prior(np.random.default_rng(0))
    weights = np.exp(-0.5 * ((prior.states[:, 0] - angle) / std) ** 2)
    return prior.with_weights(prior.weights.of(weights + 1e-30))


@pytest.mark.parametrize("std", [0.02, 0.3, 10.0])
def test_a_few_states_cover_about_what_all_do(std: float) -> None:
    whole = covered(LAYOUT, belief(0.8, std)).plane(0.0)
    few = covered(LAYOUT, belief(0.8, std), most=40).plane(0.0)
    assert np.abs(whole - few).max() <= 2.0 / 40.0 + 1e-6
    assert few.sum() == pytest.approx(whole.sum(), rel=0.02)


def test_what_may_be_absent_covers_no_more_than_its_presence() -> None:
    maybe = replace(belief(0.8, 0.01), presence=0.6)
    for most in (None, 40):
        assert covered(LAYOUT, maybe, most=most).values.max() == pytest.approx(0.6, abs=1e-3)
