"""How far walls stand off their places, learnt from a stream made up for it."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.config import MapErrorSettings
from objstate.estimator.map_error import MapError
from objstate.geometry import FloatArray

SETTINGS = MapErrorSettings(weight=5.0)
SECOND = 10**9
CELLS = 60  # places along a wall, each in a cell of its own
BEAMS = 5  # on each of them


def places() -> FloatArray:
    """(n, 2) where beams end, some in each cell."""
    middles = (np.arange(CELLS) + 0.5) * SETTINGS.cell_m
    x = np.repeat(middles, BEAMS) + np.tile(np.linspace(-0.1, 0.1, BEAMS), CELLS)
    return np.column_stack([x, np.full(len(x), 0.2)])


def learnt(off: FloatArray, noise: float, looks: int = 15) -> float:
    """After so many looks at places that are ``off`` (cells,) m, each with another error."""
    rng, error = np.random.default_rng(1), MapError(SETTINGS)
    for look in range(looks):
        readings = np.repeat(off + noise * rng.standard_normal(CELLS), BEAMS)
        error.note(look * SECOND, places(), readings + 0.01 * rng.standard_normal(len(readings)))
    return error.std


@pytest.mark.parametrize("std", [0.01, 0.02, 0.04])
def test_it_finds_the_deviation_of_walls_that_stand_off(std: float) -> None:
    off = std * np.random.default_rng(0).standard_normal(CELLS)
    off *= std / np.sqrt(np.mean(off**2))
    assert learnt(off, noise=0.02) == pytest.approx(std, rel=0.15)


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_where_the_model_is_exact_it_is_next_to_nothing(noise: float) -> None:
    """Errors that are others at each look don't count, however large."""
    assert learnt(np.zeros(CELLS), noise) < 0.004


def test_before_a_place_was_seen_twice_it_is_the_first_guess() -> None:
    error = MapError(SETTINGS)
    assert error.std == pytest.approx(SETTINGS.std_m)
    error.note(0, places(), np.full(CELLS * BEAMS, 0.05))
    assert error.std == pytest.approx(SETTINGS.std_m)


def test_beams_that_something_stopped_do_not_count() -> None:
    error = MapError(SETTINGS)
    for look in range(10):
        error.note(look * SECOND, places(), np.full(CELLS * BEAMS, -2.0 * SETTINGS.most_m))
    assert error.std == pytest.approx(SETTINGS.std_m)


def test_places_seen_by_too_few_beams_do_not_count() -> None:
    error, few = MapError(SETTINGS), places()[:: BEAMS // 2][:: BEAMS // 2]
    for look in range(10):
        error.note(look * SECOND, few, np.full(len(few), 0.05))
    assert error.std == pytest.approx(SETTINGS.std_m)


def test_looks_are_due_when_their_errors_are_others() -> None:
    error = MapError(SETTINGS)
    assert error.is_due(7)
    error.note(7, places(), np.zeros(CELLS * BEAMS))
    assert not error.is_due(7 + SECOND - 1)
    assert error.is_due(7 + SECOND)
