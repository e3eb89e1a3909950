"""Furniture, given the whole log: the backward pass against sums over places that lie far apart."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import Dynamics, FurnitureSettings
from objstate.geometry import FloatArray
from objstate.objects.furniture import SampleFilter
from objstate.objects.furniture_mixture import Piece
from objstate.objects.steps import FurnitureStep
from objstate.smoothing import (
    FurnitureHistory,
    FurnitureRests,
    SmoothedFurniture,
    movements,
    smoothed_furniture,
)
from objstate.smoothing.furniture import SAME
from tests.rooms import table

SECOND = 1_000_000_000
PLACES = np.array([[0.0, 0.0, 0.1], [0.4, -0.25, 0.3], [-0.35, 0.3, -0.2]])
STD = np.array([0.01, 0.01, 0.02])


def piece(moves_per_hour: float) -> Piece:
    dynamics = Dynamics(moves_per_hour=moves_per_hour)
    return Piece(table("table", 0.0, 0.0), FurnitureSettings(presence=0.9, dynamics=dynamics))


def step(of: Piece, seconds: float, weights: FloatArray) -> FurnitureStep:
    """The object is absent, or at one of the places, with weights (4,)."""
    rows = [[w, *place, STD[0] ** 2, 0, 0, STD[1] ** 2, 0, STD[2] ** 2]
            for w, place in zip(weights[1:], PLACES, strict=True)]  # fmt: skip
    return FurnitureStep(
        round(seconds * SECOND), of, float(weights[0]), np.array(rows, dtype=np.float32)
    )


def smoothed(steps: list[FurnitureStep]) -> SmoothedFurniture:
    own = steps[0].piece
    belief = SampleFilter(own.item, own.settings).prior(np.random.default_rng(0))
    return smoothed_furniture(FurnitureHistory(belief, steps))


def at_places(result: SmoothedFurniture) -> FloatArray:
    """(n, 4) probabilities of absence and of each place."""
    out = np.zeros((len(result.mixtures), 4))
    for k, mixture in enumerate(result.mixtures):
        out[k, 0] = mixture.weights[0]
        for weight, place in zip(mixture.weights[1:], mixture.places[1:], strict=True):
            out[k, 1 + int(np.argmin(np.abs(PLACES - place).sum(axis=1)))] += weight
    return out


def arrivals(of: Piece, weights: FloatArray) -> FloatArray:
    """(4,) where a moved object arrives: absent, or relative to a place's own blurred density."""
    best = PLACES[int(np.argmax(weights[1:]))]
    out = np.zeros(4)
    out[0] = 0.1
    for at, covariance in (of.cells, of.nearby(best)):
        for j, place in enumerate(PLACES):
            wide = covariance + np.diag(STD**2) + SAME
            own = 2.0 * np.diag(STD**2) + SAME
            off = of.item.symmetry.nearest(at, float(place[2])) - place
            bells = np.exp(-0.5 * np.einsum("ia,ab,ib->i", off, np.linalg.inv(wide), off))
            out[1 + j] += 0.45 * bells.mean() * np.sqrt(np.linalg.det(own) / np.linalg.det(wide))
    return out


@given(seed=st.integers(0, 2**32 - 1), gaps=st.lists(st.floats(1.5, 200.0), min_size=3, max_size=3))
@settings(max_examples=20, deadline=None)
def test_smoothed_weights_are_those_of_a_chain_over_places(seed: int, gaps: list[float]) -> None:
    rng, own = np.random.default_rng(seed), piece(30.0)
    filtered = rng.dirichlet(np.ones(4), size=4)
    seconds = np.concatenate([[0.0], np.cumsum(gaps)])
    result = at_places(smoothed([step(own, *each) for each in zip(seconds, filtered, strict=True)]))
    expected = filtered[-1]
    assert result[-1] == pytest.approx(expected, abs=1e-6)
    for k in (2, 1, 0):
        moved = own.settings.dynamics.moved(gaps[k])
        arrived = moved * arrivals(own, filtered[k])
        ratio = expected / ((1.0 - moved) * filtered[k] + arrived)
        stayed = (1.0 - moved) * filtered[k] * ratio
        expected = stayed + filtered[k] * (arrived * ratio).sum()
        assert result[k] == pytest.approx(expected, abs=2e-3)


def test_what_is_seen_later_was_so_before() -> None:
    own, unknown, known = piece(0.5), np.full(4, 0.25), np.array([0.001, 0.001, 0.997, 0.001])
    result = smoothed([step(own, 0.0, unknown), step(own, 0.2, unknown), step(own, 0.4, known)])
    assert at_places(result)[:, 2] == pytest.approx([0.997] * 3, abs=0.01)
    assert result.beliefs[0].mean == pytest.approx(PLACES[1], abs=0.02)
    assert result.beliefs[0].presence > 0.99


@pytest.mark.parametrize(("place", "presence"), [(2, 1.0), (0, 0.0)])
def test_furniture_moved_or_taken_away_unseen_is_one_movement(place: int, presence: float) -> None:
    own, before, after = piece(0.5), np.full(4, 1e-12), np.full(4, 1e-12)
    before[1] = after[place] = 1.0
    steps = [step(own, t, before) for t in (0.0, 1.0, 2.0)]
    steps += [step(own, t, after) for t in (100.0, 101.0, 102.0)]
    result = smoothed(steps)
    rests = FurnitureRests(result.stamps_ns, result.mixtures, result.stays)
    (movement,) = movements(rests)
    assert movement.probability > 0.99
    assert 2 * SECOND < movement.from_ns < 10 * SECOND
    assert 90 * SECOND < movement.to_ns < 100 * SECOND
    assert result.beliefs[movement.before].mean == pytest.approx(PLACES[0], abs=0.02)
    assert result.beliefs[movement.after].presence == pytest.approx(presence, abs=0.01)
    assert at_places(result)[2, 1] > 0.99


def test_furniture_that_stands_has_no_movement() -> None:
    own, known = piece(0.5), np.array([1e-6, 1.0 - 3e-6, 1e-6, 1e-6])
    result = smoothed([step(own, t, known) for t in (0.0, 1.0, 500.0, 501.0)])
    assert movements(FurnitureRests(result.stamps_ns, result.mixtures, result.stays)) == []


def test_where_furniture_stood_is_not_where_it_was_carried_while_it_was_seen() -> None:
    """It stands for ten seconds, and is then carried by 60 cm in three, which each scan shows."""
    own = piece(0.5)
    way = np.concatenate([np.zeros(100), np.linspace(0.0, 0.6, 30), np.full(50, 0.6)])
    steps = []
    for k, x in enumerate(way):
        row = [1.0, x, 0.0, 0.1, STD[0] ** 2, 0, 0, STD[1] ** 2, 0, STD[2] ** 2]
        table = np.array([row], dtype=np.float32)
        steps.append(FurnitureStep(round(k * SECOND / 10), own, 0.0, table))
    result = smoothed(steps)
    off = [abs(belief.mean[0] - x) for belief, x in zip(result.beliefs, way, strict=True)]
    assert max(off) < 0.02
    found = movements(FurnitureRests(result.stamps_ns, result.mixtures, result.stays))
    assert max(movement.probability for movement in found) > 0.99
    assert min(movement.from_ns for movement in found) > 9 * SECOND
    assert max(movement.to_ns for movement in found) < 14 * SECOND
