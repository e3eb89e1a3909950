"""What an object's belief says: means, deviations, intervals, rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import norm

from objstate.building.model import MovableObject
from objstate.config import DoorSettings
from objstate.geometry import FloatArray, wrap
from objstate.objects import ObjectBelief
from objstate.objects.doors import LatticeFilter
from objstate.particles import Weights
from tests.rooms import door, sliding_door, table

DOOR = door("door", 0.0, 0.0)
TURNSTILE = door("turnstile", 0.0, 0.0, limits=(-np.pi, np.pi), wraps=True)


def samples_of(states: FloatArray) -> ObjectBelief:
    return ObjectBelief(table("table", 0.0, 0.0), states, Weights.uniform(len(states)), np.zeros(3))


def lattice(
    item: MovableObject = DOOR, mean: float = 0.8, std: float = 0.1, resolution_deg: float = 1.0
) -> ObjectBelief:
    """A door's belief with Gaussian weights, the short way round where it wraps."""
    prior = LatticeFilter(item, DoorSettings(resolution_deg=resolution_deg)).prior(
        np.random.default_rng(0)
    )
    off = prior.states[:, 0] - mean
    off = wrap(off) if item.wraps else off
    return prior.with_weights(Weights.of(norm.pdf(off / std)))


def held(belief: ObjectBelief, lower: float, upper: float) -> float:
    """The mass between two bounds, each sample's spread over its cell."""
    width, off = belief.cell[0], belief.deviations[:, 0]
    left, right = off - width / 2, off + width / 2
    low, high = lower - belief.mean[0], upper - belief.mean[0]
    inside = (np.minimum(right, high) - np.maximum(left, low)).clip(0.0) / width
    return float(belief.weights.values @ inside)


@settings(max_examples=60)
@given(st.floats(0.0, 1.57), st.floats(0.005, 0.5), st.floats(0.3, 0.99))
def test_an_interval_holds_its_share_of_the_mass(mean: float, std: float, share: float) -> None:
    belief = lattice(mean=mean, std=std)
    (lower,), (upper,) = belief.interval(share)
    tail = (1.0 - share) / 2.0
    below, above = held(belief, -10.0, lower), held(belief, upper, 10.0)
    # at a limit, the half of a cell that reaches beyond it is cut off
    assert below == pytest.approx(tail, abs=1e-9) or lower == DOOR.lower
    assert above == pytest.approx(tail, abs=1e-9) or upper == DOOR.upper
    assert DOOR.lower <= lower <= upper <= DOOR.upper


@settings(max_examples=60)
@given(st.floats(0.0, 1.57), st.floats(0.005, 0.5))
def test_half_of_the_mass_lies_below_the_median(mean: float, std: float) -> None:
    belief = lattice(mean=mean, std=std)
    (median,) = belief.median
    if median in (DOOR.lower, DOOR.upper):
        half_a_cell = belief.cell[0] / 2
        inwards = half_a_cell if median == DOOR.lower else -half_a_cell
        beyond = held(belief, *sorted([median - inwards, median + inwards]))
        assert beyond >= 0.5 - 1e-9
    else:
        assert held(belief, -10.0, median) == pytest.approx(0.5, abs=1e-9)
    (lower,), (upper,) = belief.interval()
    assert lower <= median <= upper


def test_a_door_that_is_probably_closed_is_closed_by_its_median() -> None:
    weights = np.full(len(lattice().states), 0.4 / (len(lattice().states) - 1))
    weights[0] = 0.6
    belief = lattice().with_weights(Weights.of(weights))
    assert belief.median[0] == DOOR.lower
    assert belief.mean[0] > np.radians(10.0)


@pytest.mark.parametrize("middle", [0.3, 3.1, -3.1])
def test_the_median_of_a_turnstile_lies_near_its_mean(middle: float) -> None:
    belief = lattice(TURNSTILE, middle, 0.1)
    assert belief.median[0] == pytest.approx(belief.mean[0], abs=np.radians(0.1))


def test_an_interval_of_samples_is_the_normals() -> None:
    states = np.random.default_rng(0).normal([1.0, -2.0, 0.3], [0.1, 0.2, 0.05], (20_000, 3))
    lower, upper = samples_of(states).interval()
    np.testing.assert_allclose(samples_of(states).median, [1, -2, 0.3], atol=0.01)
    np.testing.assert_allclose(lower, norm.ppf(0.05, [1, -2, 0.3], [0.1, 0.2, 0.05]), atol=0.01)
    np.testing.assert_allclose(upper, norm.ppf(0.95, [1, -2, 0.3], [0.1, 0.2, 0.05]), atol=0.01)


@settings(max_examples=40)
@given(st.floats(-np.pi, np.pi), st.floats(0.02, 0.3))
def test_a_turnstile_is_the_same_on_both_sides_of_pi(mean: float, std: float) -> None:
    belief, reference = lattice(TURNSTILE, mean, std), lattice(TURNSTILE, 0.0, std)
    assert wrap(belief.mean[0] - mean) == pytest.approx(0.0, abs=1e-3)
    assert belief.std[0] == pytest.approx(reference.std[0], rel=0.02)
    (lower,), (upper,) = belief.interval()
    assert lower < belief.mean[0] < upper
    (at_zero,), _ = reference.interval()
    assert upper - lower == pytest.approx(-2 * at_zero, rel=0.05, abs=0.01)


def test_yaw_wraps_and_places_do_not() -> None:
    rng = np.random.default_rng(1)
    states = rng.normal([3.1, -3.1, np.pi], 0.1, (4000, 3))
    states[:, 2] = wrap(states[:, 2])
    belief = samples_of(states)
    np.testing.assert_allclose(belief.mean[:2], [3.1, -3.1], atol=0.01)
    assert abs(wrap(2.0 * (belief.mean[2] - np.pi))) < 0.02  # a table looks the same from behind
    np.testing.assert_allclose(belief.std, 0.1, atol=0.01)


def test_the_spread_of_a_lattice_has_its_cells_width() -> None:
    certain = lattice()
    certain = certain.with_weights(Weights.of((np.arange(len(certain.states)) == 40).astype(float)))
    assert certain.std[0] == pytest.approx(certain.cell[0] / np.sqrt(12.0))
    (lower,), (upper,) = certain.interval(0.9)
    assert upper - lower == pytest.approx(0.9 * certain.cell[0])


@pytest.mark.parametrize(
    ("std", "settled"), [(np.radians(1.0), True), (np.radians(4.0), True), (0.2, False)]
)
def test_a_belief_that_is_narrow_is_settled(std: float, settled: bool) -> None:
    assert lattice(std=std).is_certain is settled


def test_a_settled_belief_is_represented_by_its_mean_any_other_by_a_comb() -> None:
    narrow = lattice(std=0.02).represented_by(7)
    np.testing.assert_allclose(narrow.states, [lattice(std=0.02).mean])
    assert narrow.shares.sum() == pytest.approx(1.0)
    wide = lattice(std=0.3)
    comb = wide.represented_by(50)
    assert comb.shares.sum() == pytest.approx(1.0)
    assert comb.shares @ comb.states[:, 0] == pytest.approx(wide.mean[0], abs=0.02)
    assert comb.states[:, 0].std() == pytest.approx(wide.std[0], rel=0.05)


def test_a_row_for_each_coordinate() -> None:
    furniture = replace(samples_of(np.tile([1.0, 2.0, 0.5], (10, 1))), stamp_ns=7)
    rows = furniture.estimates(fit=0.75)
    assert [row.coordinate for row in rows] == ["x", "y", "yaw"]
    assert [row.mean for row in rows] == pytest.approx([1.0, 2.0, 0.5])
    assert [row.value for row in rows] == pytest.approx([1.0, 2.0, 0.5])
    assert all(row.stamp_ns == 7 and row.observed and row.object == "table" for row in rows)
    assert all((row.fit, row.presence, row.lost) == (0.75, 1.0, False) for row in rows)
    (angle,) = replace(lattice(), stamp_ns=0).estimates(fit=None, lost=True)
    assert (angle.coordinate, angle.observed, angle.lost) == ("angle", False, True)
    assert np.isnan(angle.fit)
    assert angle.lower < angle.mean < angle.upper
    (offset,) = replace(lattice(sliding_door("s", 0, 0)), stamp_ns=0).estimates(fit=None)
    assert offset.coordinate == "offset"


def test_before_its_first_moment_a_belief_has_no_rows() -> None:
    with pytest.raises(ValueError, match="without a moment"):
        lattice().estimates(fit=1.0)
