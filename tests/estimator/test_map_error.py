"""How far walls stand off their places, learnt from a stream made up for it."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.config import MapErrorSettings
from objstate.estimator.map_error import MapError
from objstate.geometry import FloatArray

SETTINGS = MapErrorSettings()
SECOND = 10**9
CELLS = 60  # places along a wall, each in a cell of its own
BEAMS = 5  # on each of them
NORMAL = np.array([0.0, 1.0])  # of the wall
SLANT = np.array([np.sqrt(0.75), 0.5])  # a beam's direction that meets it at 60 degrees


def places() -> FloatArray:
    """(n, 2) where beams end, some in each cell."""
    middles = (np.arange(CELLS) + 0.5) * SETTINGS.cell_m
    x = np.repeat(middles, BEAMS) + np.tile(np.linspace(-0.1, 0.1, BEAMS), CELLS)
    return np.column_stack([x, np.full(len(x), 0.2)])


def note(
    error: MapError, look: int, off: FloatArray, beams: FloatArray, along: FloatArray = NORMAL
) -> None:
    """A look, each second, at places where beams that come along a direction read longer."""
    error.note(look * SECOND, beams, np.tile(along, (len(beams), 1)), off)


def learnt(off: FloatArray, noise: float, looks: int = 15, along: FloatArray = NORMAL) -> float:
    """After so many looks at places that are ``off`` (cells,) m along the wall's normal, each with another error."""
    rng, error = np.random.default_rng(1), MapError(SETTINGS)
    for look in range(looks):
        readings = np.repeat(off + noise * rng.standard_normal(CELLS), BEAMS)
        readings = readings / (along @ NORMAL) + 0.01 * rng.standard_normal(len(readings))
        note(error, look, readings, places(), along)
    return error.std


@pytest.mark.parametrize("along", [NORMAL, SLANT])
@pytest.mark.parametrize("std", [0.01, 0.02, 0.04])
def test_it_finds_the_deviation_of_walls_that_stand_off(std: float, along: FloatArray) -> None:
    """However aslant beams meet them: it is that along their normals."""
    off = std * np.random.default_rng(0).standard_normal(CELLS)
    off *= std / np.sqrt(np.mean(off**2))
    assert learnt(off, noise=0.02, along=along) == pytest.approx(std, rel=0.15)


@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_where_the_model_is_exact_it_is_next_to_nothing(noise: float) -> None:
    """Errors that are others at each look don't count, however large."""
    assert learnt(np.zeros(CELLS), noise) < 0.004


def test_a_few_places_where_something_stands_at_the_wall_do_not_lead() -> None:
    """A box 12 cm deep before every twentieth place, and the rest a centimetre off."""
    off = 0.01 * np.random.default_rng(0).choice([-1.0, 1.0], CELLS)
    off[::20] = -0.12
    assert learnt(off, noise=0.01) < 0.02 < float(np.sqrt(np.mean(off**2)))


def test_before_a_place_was_seen_twice_it_is_the_first_guess() -> None:
    error = MapError(SETTINGS)
    guess = error.std
    assert guess == pytest.approx(SETTINGS.std_m)
    note(error, 0, np.full(CELLS * BEAMS, 0.05), places())
    assert error.std == guess


@pytest.mark.parametrize(("hidden", "counts"), [(0, True), (1, True), (2, False), (BEAMS, False)])
def test_places_of_which_something_hides_a_part_do_not_count(hidden: int, counts: bool) -> None:
    """What is left of them may be the edge of that thing."""
    error = MapError(SETTINGS)
    guess, off = error.std, np.full((CELLS, BEAMS), 0.05)
    off[:, :hidden] = -2.0 * SETTINGS.most_m
    for look in range(10):
        note(error, look, off.ravel(), places())
    assert (error.std != guess) == counts


def test_places_seen_by_too_few_beams_do_not_count() -> None:
    error, few = MapError(SETTINGS), places()[:: BEAMS // 2][:: BEAMS // 2]
    guess = error.std
    for look in range(10):
        note(error, look, np.full(len(few), 0.05), few)
    assert error.std == guess


def test_corners_do_not_count() -> None:
    """Where a wall isn't flat, nothing tells which way it stands off."""
    error, zigzag = MapError(SETTINGS), places()
    guess = error.std
    zigzag[1::2, 1] += 0.05
    for look in range(10):
        note(error, look, np.full(len(zigzag), 0.05), zigzag)
    assert error.std == guess


def test_looks_are_due_when_their_errors_are_others() -> None:
    error = MapError(SETTINGS)
    assert error.is_due(7)
    error.note(7, places(), np.tile(NORMAL, (CELLS * BEAMS, 1)), np.zeros(CELLS * BEAMS))
    assert not error.is_due(7 + SECOND - 1)
    assert error.is_due(7 + SECOND)
