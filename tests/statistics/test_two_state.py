"""What looks tell of a door: as much as they can, and no more."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.geometry import FloatArray
from objstate.statistics.sampling import sample
from objstate.statistics.shares import share_open
from objstate.statistics.two_state import LONGEST_MEMORY, SHORTEST_MEMORY, Looks, memory

DAY = 86400.0


def history(share: float, rate: float, times: FloatArray, rng: np.random.Generator) -> Looks:
    """Looks at a door that opens and closes at constant rates."""
    state, before, seen = bool(rng.random() < share), times[0], []
    for time in times:
        kept = np.exp(-rate * (time - before))
        state = bool(rng.random() < share + (float(state) - share) * kept)
        before = time
        seen.append(state)
    return Looks((times * 1e9).astype(np.int64), np.array(seen))


def visits(count: int, days: float, rng: np.random.Generator) -> FloatArray:
    """Three looks in a row at ``count`` random times."""
    return np.sort((rng.uniform(0, days * DAY, count)[:, None] + [0.0, 1.0, 2.0]).ravel())


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    rng = np.random.default_rng(3)
    held = []
    for _ in range(40):
        share = float(np.sin(rng.uniform(0, np.pi / 2)) ** 2)
        rate = float(np.exp(rng.uniform(-np.log(LONGEST_MEMORY), -np.log(SHORTEST_MEMORY))))
        looks = history(share, rate, visits(40, 20.0, rng), rng)
        known = memory(looks.summed(), rng)
        true = {
            known.open_spell: 1 / (rate * (1 - share)),
            known.closed_spell: 1 / (rate * share),
            share_open(0, looks.summed(), known).share: share,
        }
        held.append([interval.lower <= value <= interval.upper for interval, value in true.items()])
    shares = np.mean(held, axis=0)
    assert (shares > 0.9 - 4 * np.sqrt(0.09 / 40)).all()  # four standard errors


def test_more_looks_tell_more_unless_they_lie_together() -> None:
    rng = np.random.default_rng(0)
    rate = 1 / 3600.0
    few, many = (history(0.3, rate, np.arange(n) * DAY, rng) for n in (20, 500))
    crowded = history(0.3, rate, np.arange(500) * 0.1, rng)
    widths = [
        interval.upper - interval.lower
        for interval in (
            share_open(0, looks.summed(), memory(looks.summed(), rng)).share
            for looks in (many, few, crowded)
        )
    ]
    assert widths == sorted(widths)
    assert widths[0] < 0.12
    assert widths[2] > 0.6


@given(
    st.lists(st.integers(0, 10**7), min_size=1, max_size=40),
    st.lists(st.booleans(), min_size=40, max_size=40),
)
def test_figures_are_what_they_can_be(seconds: list[int], states: list[bool]) -> None:
    looks = Looks(np.sort(seconds) * 10**9, np.array(states[: len(seconds)]))
    known = memory(looks.summed(), np.random.default_rng(0))
    cell = share_open(0, looks.summed(), known)
    assert 0 < known.closed_spell.lower <= known.closed_spell.upper
    assert 0 < cell.independent <= len(looks) + 1e-9
    assert 0 <= cell.share.lower <= cell.share.value <= cell.share.upper <= 1
    assert (cell.share.lower == 0) == (not looks.open.any())
    assert (cell.share.upper == 1) == bool(looks.open.all())


def test_looks_far_apart_are_independent_and_close_ones_are_one() -> None:
    rng = np.random.default_rng(0)
    known = memory(history(0.5, 1 / 600.0, np.arange(300) * 60.0, rng).summed(), rng)
    apart = Looks((np.arange(10) * 400 * DAY * 1e9).astype(np.int64), np.arange(10) < 5)
    together = Looks((np.arange(10) * 1e9).astype(np.int64), np.ones(10, dtype=bool))
    assert share_open(0, apart.summed(), known).independent == pytest.approx(10, rel=0.01)
    assert share_open(0, together.summed(), known).independent == pytest.approx(1, rel=0.05)


def test_samples_follow_a_likelihood_that_is_known() -> None:
    points = sample(
        lambda x: -0.5 * ((x - 0.3) ** 2).sum(axis=1) / 0.02**2, 3, np.random.default_rng(1)
    )
    assert points.shape == (1000, 3)
    assert points.mean(axis=0) == pytest.approx([0.3] * 3, abs=0.003)
    assert points.std(axis=0) == pytest.approx([0.02] * 3, rel=0.15)
