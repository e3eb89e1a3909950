"""The process within a cell, and its derivatives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from objstate.habits.chain import chain, slopes
from objstate.habits.design import LOCAL

values = st.floats(-3.0, 3.0)
local = st.integers(2, 4).flatmap(
    lambda regions: st.lists(values, min_size=LOCAL + regions - 2, max_size=LOCAL + regions - 2)
)


@given(local, st.floats(0.0, 1e5))
def test_transitions_are_those_of_the_generator(u: list[float], seconds: float) -> None:
    of = chain(np.array(u))
    region = np.arange(len(of.leaves)) // 2
    generator = of.leaves[:, None] * of.arrives * (region[:, None] != region)
    generator -= np.diag(generator.sum(axis=1))
    moved = of.over(seconds)
    assert np.allclose(moved, expm(generator * seconds), atol=1e-7)
    assert np.allclose(moved.sum(axis=1), 1.0)
    assert np.allclose(of.settled @ moved, of.settled)


@given(local)
def test_slopes_are_those_of_the_generator(u: list[float]) -> None:
    at, step = np.array(u), 1e-6

    def generator(point: np.ndarray) -> np.ndarray:
        of = chain(point)
        return np.asarray((of.right * of.rates) @ of.left)

    of = chain(at)
    for k, slope in enumerate(slopes(at, of)):
        off = step * np.eye(len(at))[k]
        wanted = (generator(at + off) - generator(at - off)) / (2 * step)
        found = of.right @ slope @ of.left
        assert found == pytest.approx(wanted, rel=1e-4, abs=1e-6 * np.abs(generator(at)).max())
