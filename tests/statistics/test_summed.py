"""Looks added up by the minute tell what the looks themselves tell."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.statistics.summed import GAP_STEP, Summed
from objstate.statistics.two_state import Looks

SECOND = 10**9
LOOKS = st.lists(st.tuples(st.integers(0, 10**12), st.booleans()), min_size=1, max_size=60)


def looks_of(drawn: list[tuple[int, bool]]) -> Looks:
    ordered = sorted(drawn)
    return Looks(np.array([s for s, _ in ordered]), np.array([o for _, o in ordered]))


@given(LOOKS)
def test_neighbours_are_those_of_the_looks(drawn: list[tuple[int, bool]]) -> None:
    looks = looks_of(drawn)
    gaps = np.maximum(np.diff(looks.stamps_ns), 1) / 1e9
    expected: dict[tuple[int, int], int] = {}
    for gap, before, after in zip(gaps, looks.open[:-1], looks.open[1:], strict=True):
        key = (round(np.log(gap) / GAP_STEP), 2 * before + after)
        expected[key] = expected.get(key, 0) + 1
    summed = looks.summed()
    found, pairs = summed.neighbours()
    told = {
        (round(np.log(gap) / GAP_STEP), kind): int(row[kind])
        for gap, row in zip(found, pairs, strict=True)
        for kind in range(4)
        if row[kind]
    }
    assert told == expected
    assert summed.moves_seen == np.count_nonzero(np.diff(looks.open.astype(int)))
    assert len(summed) == len(looks)
    assert summed.open.sum() == looks.open.sum()


@given(LOOKS, st.integers(0, 10**12))
def test_the_looks_of_two_logs_are_those_of_one(drawn: list[tuple[int, bool]], cut: int) -> None:
    whole = looks_of(drawn)
    minute = cut - cut % (60 * SECOND)  # no minute is in both
    early = whole.stamps_ns < minute
    parts = [Looks(whole.stamps_ns[which], whole.open[which]).summed() for which in (~early, early)]
    joined, expected = Summed.joined([part for part in parts if len(part)]), whole.summed()
    for name in ("minutes", "counts", "open", "first_ns", "last_ns", "first_open", "last_open"):
        assert getattr(joined, name).tolist() == getattr(expected, name).tolist()
    assert joined.seconds == pytest.approx(expected.seconds)
    for one, other in zip(joined.neighbours(), expected.neighbours(), strict=True):
        assert one.tolist() == other.tolist()
