"""Pieces of one form: laws of who stands where."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import FurnitureSettings
from objstate.geometry import FloatArray
from objstate.objects.exclusion import alike, compete, exclusive, spacing
from objstate.objects.furniture_mixture import ORDER, Conditioned, FurnitureMixture, Piece
from tests.rooms import table

SIZE = (0.4, 0.4)
STD = 0.01
BLANK = FurnitureMixture.unknown(
    Piece(table("a", 0.0, 0.0, size=SIZE), FurnitureSettings(prior_std_m=0.5))
)


def mixture(weights: Sequence[float], places: Sequence[tuple[float, float]]) -> FurnitureMixture:
    """A piece that is known to be at some places; what is left is its absence."""
    at = np.array([[x, y, 0.0] for x, y in places])
    covariances = np.zeros((len(at), *BLANK.covariances.shape[1:]))
    covariances[:, ORDER, ORDER] = STD**2
    cells = np.full(len(BLANK.weights), 1e-30)
    cells[0] = max(1.0 - sum(weights), 1e-30)
    return FurnitureMixture(
        BLANK.piece,
        np.concatenate([cells, weights]),
        np.concatenate([BLANK.places, at]),
        np.concatenate([BLANK.robots, np.zeros((len(at), 3))]),
        np.concatenate([BLANK.covariances, covariances]),
        np.zeros((len(cells) + len(at), 0)),
    )


def seen(
    before: FurnitureMixture, shown: Sequence[tuple[float, float]], nats: float
) -> Conditioned:
    """After a scan by which a piece is likelier at some places."""
    off = np.hypot(*np.moveaxis(before.places[:, None, :2] - np.array(shown), 2, 0))
    shows = (off < 0.1).any(axis=1) & (np.arange(len(off)) >= len(BLANK.weights))
    log_likelihood = np.where(shows, nats, 0.0)
    log_weights = np.log(before.weights) + log_likelihood
    return Conditioned(before, log_weights, before.places, before.robots, before.covariances,
                       before.motions)  # fmt: skip


def at(after: FurnitureMixture, place: tuple[float, float]) -> float:
    off = np.hypot(*(after.places[1:, :2] - place).T)
    return float(after.weights[1:][off < 0.1].sum())


HERE, THERE = (0.0, 0.0), (1.0, 0.0)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.0, 2000.0))
def test_one_that_is_seen_is_only_one_of_two(nats: float) -> None:
    """Either was put there; the other isn't in the room."""
    pieces = [mixture([share], [HERE]) for share in (0.6, 0.2)]
    after = exclusive([seen(each, [HERE], nats) for each in pieces])
    total = sum(at(each, HERE) for each in after)
    assert total <= 1.0 + 1e-4
    if nats > 30.0:
        assert total == pytest.approx(1.0, abs=1e-3)
        assert all(each.presence == pytest.approx(at(each, HERE), abs=1e-3) for each in after)
    # the scan doesn't tell them apart
    assert at(after[0], HERE) / at(after[1], HERE) == pytest.approx(3.0, rel=1e-3)


@settings(max_examples=30, deadline=None)
@given(st.floats(0.05, 0.95), st.floats(0.0, 500.0), st.integers(1, 30))
def test_scans_of_both_tell_nothing_of_who_is_who(share: float, nats: float, scans: int) -> None:
    pieces = [mixture([p, 1.0 - p], [HERE, THERE]) for p in (share, 1.0 - share)]
    for _ in range(scans):
        pieces = exclusive([seen(each, [HERE, THERE], nats) for each in pieces])
    assert at(pieces[0], HERE) == pytest.approx(share, abs=1e-3)
    assert at(pieces[1], THERE) == pytest.approx(share, abs=1e-3)


def test_what_is_told_of_one_is_told_of_the_other() -> None:
    """A look that shows that one of two places is empty moves both."""
    pieces = [mixture([0.49, 0.49], [HERE, THERE]), mixture([0.49, 0.49], [HERE, THERE])]
    both = exclusive([seen(each, [HERE, THERE], 0.0) for each in pieces])
    after = exclusive([seen(each, [HERE], 50.0) for each in both])
    assert at(after[0], HERE) + at(after[1], HERE) == pytest.approx(1.0, abs=1e-3)
    assert at(after[0], THERE) == pytest.approx(at(after[1], HERE), abs=0.1)


def test_pieces_far_from_one_another_are_filtered_each_by_itself() -> None:
    pieces = [mixture([0.9], [HERE]), mixture([0.7], [THERE])]
    scans = [seen(each, [HERE], 1.0) for each in pieces]
    for together, each in zip(exclusive(scans), scans, strict=True):
        alone = each.weighed(each.alone)
        np.testing.assert_array_equal(together.weights, alone.weights)
        np.testing.assert_array_equal(together.places, alone.places)


def test_form_alone_makes_pieces_alike() -> None:
    forms: dict[str, tuple[float, float]] = {"a": SIZE, "b": (0.4, 0.5), "c": SIZE}
    pieces = {
        name: Piece(table(name, k, 2.0 * k, 0.3 * k, size=size), FurnitureSettings())
        for k, (name, size) in enumerate(forms.items())
    }
    assert alike(pieces) == [["a", "c"], ["b"]]


def test_two_squares_overlap_nearer_than_their_side() -> None:
    assert 0.8 * SIZE[0] < spacing(BLANK.piece.item) <= SIZE[0]
    beside: FloatArray = np.array([0.0, SIZE[0] * 1.01])
    first = mixture([0.9], [HERE])
    assert not compete(first, mixture([0.9], [(float(beside[0]), float(beside[1]))]))
    assert compete(first, mixture([0.9], [(0.0, 0.2)]))


def test_a_component_that_is_too_wide_to_be_at_a_place_does_not_explain_it_beside_another() -> None:
    """One of two stands where it stood; the other one's place is empty."""
    one, other = mixture([0.99, 0.005], [HERE, HERE]), mixture([0.002, 0.948], [HERE, THERE])
    one.covariances[-1, ORDER[:2], ORDER[:2]] = 0.1**2
    pieces = [seen(each, [HERE], 15.0) for each in (one, other)]
    pieces[1].log_weights[-1] -= 60.0
    after = exclusive(pieces)
    assert at(after[0], HERE) > 0.9
    assert at(after[1], HERE) < 0.1
    assert after[1].presence < 0.1
