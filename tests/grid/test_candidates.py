"""Things that stay put become candidates; what passes by doesn't."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.grid import Candidates, Layout

LAYOUT = Layout(0.05, 100, 120, np.array([1.0, 2.0, 0.0]))
SECOND = 10**9
ALL = np.ones(LAYOUT.shape, bool)


def values(*blocks: tuple[int, int, int, int]) -> np.ndarray:
    """Free but for blocks of rows and columns."""
    found = np.full(LAYOUT.shape, 0.1, np.float32)
    for top, bottom, left, right in blocks:
        found[top:bottom, left:right] = 0.9
    return found


BOX = (20, 28, 30, 46)


def looked(candidates: Candidates, count: int, *blocks: tuple[int, int, int, int]) -> Candidates:
    begin = max((each.seen_ns for each in candidates.known), default=0)
    for k in range(1, count + 1):
        candidates = candidates.looked(values(*blocks), ALL, begin + 5 * k * SECOND)
    return candidates


def test_what_stays_becomes_more_probable_with_every_look() -> None:
    candidates, before = looked(Candidates(LAYOUT), 1, BOX), 0.0
    for _ in range(20):
        (each,) = candidates.known
        assert each.probability > before
        before, candidates = each.probability, looked(candidates, 1, BOX)
    assert before > 0.85
    assert candidates.real


def test_the_box_about_it_is_where_it_stands() -> None:
    (each,) = looked(Candidates(LAYOUT), 20, BOX).real
    pose, sides = each.box(LAYOUT)
    assert pose == pytest.approx([1.0 + 38 * 0.05, 2.0 + 24 * 0.05, 0.0], abs=1e-9)
    assert sides == pytest.approx((0.75, 0.35))
    x, y = each.outline(LAYOUT).T
    assert 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1)) == pytest.approx(0.32)


def test_the_box_about_it_is_as_large_as_the_thing_on_average() -> None:
    rng, length, width, sides = np.random.default_rng(5), 0.62, 0.33, []
    for x, y in rng.uniform(1.0, 1.05, (40, 2)):
        edges = np.array([y, y + width, x, x + length]) / 0.05
        touched = np.floor(edges).astype(int) + np.array([0, 1, 0, 1])
        (each,) = looked(Candidates(LAYOUT), 20, tuple(touched.tolist())).real
        sides.append(each.box(LAYOUT)[1])
    assert np.mean(sides, axis=0) == pytest.approx([length, width], abs=0.01)


def test_a_long_while_tells_more_than_many_looks_at_once() -> None:
    once = looked(Candidates(LAYOUT), 1, BOX)
    soon, later = (
        once.looked(values(BOX), ALL, once.known[0].seen_ns + gap * SECOND).known[0].probability
        for gap in (1, 300)
    )
    assert once.known[0].probability < soon < 0.5 < later


def test_who_walks_by_never_is_real() -> None:
    candidates = Candidates(LAYOUT)
    for k in range(12):
        block = (40, 46, 5 + 9 * k, 11 + 9 * k)
        candidates = candidates.looked(values(block), ALL, 5 * k * SECOND)
        assert not candidates.real
    assert len(candidates.known) < 4


def test_parts_that_turn_out_to_be_one_thing_are_one() -> None:
    left, right = (20, 28, 30, 36), (20, 28, 40, 46)
    parts = looked(Candidates(LAYOUT), 3, left, right)
    assert len(parts.known) == 2
    (whole,) = looked(parts, 2, BOX).known
    assert whole.name == "unknown_1"
    assert len(whole.cells) == 8 * 16
    assert len(looked(parts, 2, left, right).known) == 2


def test_what_is_looked_through_is_gone_and_what_is_not_seen_stays() -> None:
    candidates = looked(Candidates(LAYOUT), 20, BOX)
    now = candidates.known[0].seen_ns
    unseen = candidates.looked(values(), np.zeros_like(ALL), now + 600 * SECOND)
    assert unseen.known == candidates.known
    for k in range(1, 4):
        candidates = candidates.looked(values(), ALL, now + 5 * k * SECOND)
    assert not candidates.known


def test_two_things_have_two_names_and_specks_none() -> None:
    candidates = looked(Candidates(LAYOUT), 15, BOX, (60, 64, 80, 90), (90, 91, 3, 4))
    assert [each.name for each in candidates.known] == ["unknown_1", "unknown_2"]


def test_what_is_seen_piece_by_piece_grows_together() -> None:
    half = (BOX[0], BOX[1], BOX[2], 38)
    candidates = looked(looked(Candidates(LAYOUT), 2, half), 2, BOX)
    (each,) = candidates.known
    assert len(each.cells) == 8 * 16
