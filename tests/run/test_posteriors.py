"""Histograms say what the samples say."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import MovableObject
from objstate.objects import ObjectBelief
from objstate.particles import Weights
from objstate.run.posteriors import BINS, PLACE_BIN, histograms
from tests.rooms import door, table


def gridded(item: MovableObject, weights: np.ndarray) -> ObjectBelief:
    states = np.linspace(item.lower, item.upper, len(weights))
    return ObjectBelief(
        item, states[:, None], Weights.of(weights), np.array([states[1] - states[0]])
    )


def free(item: MovableObject, states: np.ndarray) -> ObjectBelief:
    return ObjectBelief(item, states, Weights.uniform(len(states)), np.zeros(states.shape[1]))


@settings(max_examples=30)
@given(seed=st.integers(0, 10**6), count=st.integers(2, 300))
def test_shares_of_a_door_sum_to_one_and_keep_the_mean(seed: int, count: int) -> None:
    leaf = door("d", 0.0, 0.0)
    belief = gridded(leaf, np.random.default_rng(seed).dirichlet(np.full(count, 0.3)))
    (found,) = histograms(belief, 5)
    assert (found.stamp_ns, found.object, found.coordinate) == (5, "d", "angle")
    assert (found.lower, found.upper) == (leaf.lower, leaf.upper)
    assert found.shares.sum() == pytest.approx(1.0)
    width = (leaf.upper - leaf.lower) / BINS
    middles = leaf.lower + width * (np.arange(BINS) + 0.5)
    # half a bin, and half a cell that reaches beyond a limit
    assert found.shares @ middles == pytest.approx(
        belief.mean[0], abs=width / 2 + belief.cell[0] / 2
    )


def test_an_even_door_is_even() -> None:
    (found,) = histograms(gridded(door("d", 0.0, 0.0), np.ones(1000)), 0)
    assert found.shares == pytest.approx(
        np.full(BINS, 1 / BINS), rel=0.05
    )  # half a cell is beyond each limit


@settings(max_examples=30)
@given(x=st.floats(-50, 50), spread=st.floats(0.001, 0.3), seed=st.integers(0, 100))
def test_places_of_furniture_lie_in_bins_of_one_lattice(x: float, spread: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    states = np.array([x, -x, 3.0]) + spread * rng.standard_normal((200, 3))
    belief = free(table("t", 0.0, 0.0), states)
    found = {each.coordinate: each for each in histograms(belief, 0)}
    assert list(found) == ["x", "y", "yaw"]
    for name, middle in (("x", x), ("y", -x)):
        assert found[name].shares.sum() == pytest.approx(1.0)
        assert found[name].lower / PLACE_BIN == pytest.approx(round(found[name].lower / PLACE_BIN))
        assert found[name].lower < middle < found[name].upper
        middles = found[name].lower + PLACE_BIN * (np.arange(BINS) + 0.5)
        if spread < 0.15:  # then no sample is beyond the bins
            assert found[name].shares @ middles == pytest.approx(
                states[:, "xy".index(name)].mean(), abs=PLACE_BIN
            )


def test_directions_on_both_sides_of_pi_keep_their_places() -> None:
    states = np.array([[0.0, 0.0, np.pi - 0.01], [0.0, 0.0, np.pi + 0.01]])
    yaw = histograms(free(table("t", 0.0, 0.0), states), 0)[2]
    assert (yaw.shares[0], yaw.shares[-1]) == (0.5, 0.5)
    assert (yaw.lower, yaw.upper) == (-np.pi, np.pi)
