"""The backward pass and movements against the sum over all paths of a small chain."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import MovableObject
from objstate.config import BuildingErrorSettings, DoorSettings, Dynamics
from objstate.geometry import FloatArray, IntArray
from objstate.objects.mixture import Doorway
from objstate.smoothing import Chain, DoorRests, movements, smoothed_chain
from tests.rooms import door, sliding_door

SECOND = 1_000_000_000
RESTLESS = Dynamics(moves_per_hour=1800.0)  # so that every path counts

gaps = st.lists(st.floats(0.05, 5.0), min_size=3, max_size=3)
seeds = st.integers(0, 2**32 - 1)


def doorway(item: MovableObject, dynamics: Dynamics = RESTLESS) -> Doorway:
    return Doorway(item, DoorSettings(dynamics=dynamics), BuildingErrorSettings())


@cache
def small() -> Doorway:
    """Three cells and two limits, at rest or moving: ten states."""
    return doorway(door("door", 0.0, 0.0, limits=(0.0, 0.13)))


def transition(leaf: Doorway, seconds: float) -> FloatArray:
    """(2 c, 2 c) the whole matrix of ``Doorway.moved``."""
    count = len(leaf.states)
    rows = []
    for row in np.eye(2 * count):
        moved = leaf.moved(row[:count], row[count:], seconds)
        rows.append(np.concatenate([moved.resting, moved.moving]))
    return np.array(rows)


class Filtered(NamedTuple):
    """A chain of four moments with random likelihoods."""

    stamps_ns: IntArray  # (4,)
    filtered: FloatArray  # (4, 10)
    steps: list[FloatArray]  # three (10, 10): transition times likelihood
    stays: list[FloatArray]  # the part of these that rests without a break
    prior: FloatArray  # (10,) times the first likelihood

    @staticmethod
    def of(seed: int, seconds: list[float]) -> Filtered:
        rng, leaf = np.random.default_rng(seed), small()
        likelihood = rng.uniform(1e-3, 1.0, (4, 10)) ** 3
        prior = np.concatenate([leaf.prior, np.zeros(5)]) * likelihood[0]
        steps, stays, filtered = [], [], [prior / prior.sum()]
        stamps_ns = (np.concatenate([[0.0], np.cumsum(seconds)]) * SECOND).astype(np.int64)
        for gap, each in zip(np.diff(stamps_ns) / SECOND, likelihood[1:], strict=True):
            steps.append(transition(leaf, gap) * each)
            rests = np.repeat([leaf.stays(gap), 0.0], 5)
            stays.append(np.diag(rests) * each)
            ahead = filtered[-1] @ steps[-1]
            filtered.append(ahead / ahead.sum())
        return Filtered(stamps_ns, np.array(filtered), steps, stays, prior)

    def paths(self, steps: list[FloatArray]) -> FloatArray:
        """(10, 10, 10, 10) weights of all paths over some steps."""
        return np.einsum("a,ab,bc,cd->abcd", self.prior, *steps)

    @property
    def chain(self) -> Chain:
        return smoothed_chain(
            small(), self.stamps_ns, self.filtered[:, :5].copy(), self.filtered[:, 5:].copy()
        )


@pytest.mark.parametrize(
    "item",
    [
        door("door", 0.0, 0.0),
        door("door", 0.0, 0.0, limits=(-np.pi, np.pi), wraps=True),
        sliding_door("door", 0.0, 0.0),
    ],
    ids=["hinged", "revolving", "sliding"],
)
@given(seconds=st.floats(0.01, 600.0), seed=seeds)
@settings(max_examples=25, deadline=None)
def test_expectations_are_the_adjoint_of_the_transition(
    item: MovableObject, seconds: float, seed: int
) -> None:
    leaf, rng = doorway(item, Dynamics(moves_per_hour=2.0)), np.random.default_rng(seed)
    resting, moving, worth, worth_moving = rng.uniform(size=(4, len(leaf.states)))
    moving[leaf.cells :] = 0.0
    after = leaf.moved(resting, moving, seconds)
    before = leaf.expected(worth, worth_moving, seconds)
    assert after.resting @ worth + after.moving @ worth_moving == pytest.approx(
        resting @ before[0] + moving @ before[1], rel=1e-6
    )


@given(seed=seeds, seconds=gaps)
@settings(max_examples=30, deadline=None)
def test_smoothed_weights_are_those_of_all_paths(seed: int, seconds: list[float]) -> None:
    drive = Filtered.of(seed, seconds)
    paths, chain = drive.paths(drive.steps), drive.chain
    smoothed = np.concatenate([chain.resting, chain.moving], axis=1)
    for k in range(4):
        expected = paths.sum(axis=tuple(j for j in range(4) if j != k)) / paths.sum()
        assert smoothed[k] == pytest.approx(expected, abs=1e-9)


@given(seed=seeds, paces=st.lists(st.floats(0.1, 100.0), min_size=3, max_size=3))
@settings(max_examples=30, deadline=None)
def test_chains_of_several_paces_are_those_of_each(seed: int, paces: list[float]) -> None:
    leaf, rng = doorway(door("door", 0.0, 0.0), Dynamics(moves_per_hour=2.0)), np.random
    weights = rng.default_rng(seed).uniform(size=(2, 4, 2, 3, len(leaf.states)))
    weights[1, ..., leaf.cells :] = 0.0
    stamps_ns = np.array([0, 1, 7, 50]) * SECOND
    every = smoothed_chain(leaf, stamps_ns, *weights, np.array(paces)[:, None])
    for case in range(2):
        for k, pace in enumerate(paces):
            alone = smoothed_chain(leaf, stamps_ns, *weights[:, :, case, k], pace)
            of_it = every.of(case, k)
            assert of_it.resting == pytest.approx(alone.resting)
            assert of_it.stays == pytest.approx(alone.stays)


@given(seed=seeds, seconds=gaps)
@settings(max_examples=30, deadline=None)
def test_the_probability_of_resting_is_that_of_all_paths(seed: int, seconds: list[float]) -> None:
    drive = Filtered.of(seed, seconds)
    chain, everything = drive.chain, drive.paths(drive.steps).sum()
    through = drive.paths(drive.stays).sum() / everything
    assert chain.resting[0] @ chain.stays.prod(axis=0) == pytest.approx(through, abs=1e-9)
    assert chain.resting[3] @ chain.stayed.prod(axis=0) == pytest.approx(through, abs=1e-9)
    last = drive.paths([*drive.steps[:2], drive.stays[2]]).sum() / everything
    assert chain.resting[2] @ chain.stays[2] == pytest.approx(last, abs=1e-9)
    assert chain.resting[3] @ chain.stayed[2] == pytest.approx(last, abs=1e-9)


def seen(leaf: Doorway, seconds: list[float], places: list[int | None]) -> Chain:
    """The chain of a door that is seen in a component at moments, or isn't seen."""
    count = len(leaf.states)
    resting, moving = [leaf.prior], [np.zeros(count)]
    stamps = np.cumsum(seconds)
    for k, place in enumerate(places):
        gap = seconds[k] if k else 0.0
        moved = leaf.moved(resting[-1], moving[-1], gap) if k else None
        rest, move = (moved.resting, moved.moving) if moved else (resting[-1], moving[-1])
        likelihood = np.ones(count) if place is None else np.full(count, 1e-4)
        if place is not None:
            likelihood[place] = 1.0
        total = (likelihood * (rest + move)).sum()
        resting.append(likelihood * rest / total)
        moving.append(likelihood * move / total)
    stamps_ns = (stamps * SECOND).astype(np.int64)
    return smoothed_chain(leaf, stamps_ns, np.array(resting[1:]), np.array(moving[1:]))


def test_a_door_moved_unseen_gives_one_movement_over_the_time_unseen() -> None:
    leaf = doorway(door("door", 0.0, 0.0), Dynamics(moves_per_hour=2.0))
    chain = seen(leaf, [0.0, 0.2, 0.2, 60.0, 0.2, 0.2], [5, 5, 5, 20, 20, 20])
    (movement,) = movements(DoorRests([(1.0, chain)]))
    assert movement.probability > 0.99
    begin, end = chain.stamps_ns[[2, 3]]
    assert begin < movement.from_ns < begin + 6 * SECOND
    assert end - 6 * SECOND < movement.to_ns < end
    assert np.argmax(chain.resting[movement.before]) == 5
    assert np.argmax(chain.resting[movement.after]) == 20
    assert chain.resting[2, 5] > 0.99  # and before it, it surely stood where it was seen


def test_a_door_that_stands_gives_no_movement_however_long_it_is_unseen() -> None:
    leaf = doorway(door("door", 0.0, 0.0), Dynamics(moves_per_hour=2.0))
    chain = seen(leaf, [0.0, 0.2, 0.2, 600.0, 0.2], [5, 5, 5, 5, 5])
    assert movements(DoorRests([(1.0, chain)])) == []


def test_a_movement_that_changed_nothing_joins_its_spells() -> None:
    leaf = doorway(door("door", 0.0, 0.0), Dynamics(moves_per_hour=2.0))
    chain = seen(leaf, [0.0, 0.2, 0.2, 60.0, 0.2, 0.2], [5, 5, 5, 20, 20, 20])
    assert movements(DoorRests([(1.0, chain)]), lambda first, last: 0.4) == []


def test_two_movements_with_a_stop_between_are_two() -> None:
    leaf = doorway(door("door", 0.0, 0.0), Dynamics(moves_per_hour=2.0))
    places = [5] * 3 + [20] * 10 + [5] * 3
    chain = seen(leaf, [0.0, 0.5, 0.5, *([3.0] + [0.5] * 9), *([3.0] + [0.5] * 2)], places)
    first, second = movements(DoorRests([(1.0, chain)]))
    assert first.to_ns < second.from_ns
    assert np.argmax(chain.resting[first.after]) == np.argmax(chain.resting[second.before]) == 20


def test_what_comes_later_makes_a_door_known_from_the_first_moment_on() -> None:
    leaf = doorway(door("door", 0.0, 0.0), Dynamics(moves_per_hour=2.0))
    chain = seen(leaf, [0.0, 0.2, 0.2, 0.2], [None, None, None, 5])
    assert chain.resting[0, 5] == pytest.approx(chain.resting[3, 5], abs=0.01)
