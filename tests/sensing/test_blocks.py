"""Blocks leave out nothing that is near, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.sensing.blocks import Blocks

LONG = np.array([[-100.0, 3.0, 100.0, 3.0], [0.0, -100.0, 0.0, 100.0]])  # m


def gap(segment: np.ndarray, place: np.ndarray) -> float:
    """Distance of a place from a segment, by many points on it."""
    points = np.linspace(segment[:2], segment[2:], 20_001)
    return float(np.hypot(*(points - place).T).min())


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.floats(-60, 60), st.floats(-60, 60), st.floats(0.0, 30.0))
def test_segments_are_those_that_come_near(seed: int, x: float, y: float, radius: float) -> None:
    rng = np.random.default_rng(seed)
    start = rng.uniform(-50.0, 50.0, (30, 2))
    segments = np.vstack([np.hstack([start, start + rng.normal(0.0, 4.0, (30, 2))]), LONG])
    found = Blocks(segments).within(np.array([x, y]), radius).tolist()
    for segment in segments:
        distance = gap(segment, np.array([x, y]))
        if abs(distance - radius) > 0.02:
            assert (segment.tolist() in found) is (distance < radius)


@pytest.mark.parametrize("count", [0, 1])
def test_there_may_be_next_to_nothing(count: int) -> None:
    segments = np.zeros((count, 4))
    assert len(Blocks(segments).within(np.array([50.0, 0.0]), 1.0)) == 0
    assert len(Blocks(segments).within(np.zeros(2), 1.0)) == count
